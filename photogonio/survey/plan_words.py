"""A plan in words: where each photo's camera and lamp stand, and what it is for."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.design.places import Step
from photogonio.reconstruct.design.spots import Piece, Spot, Stance, apart
from photogonio.survey.words import where

RETRO = 20.0  # degrees between lamp and camera
MIRROR = 14.0  # between the camera and the mirror direction of the lamp, at the middle
GRAZING = 65.0  # from the normal
BEHIND = 110.0  # between lamp and camera, of a ball


def purpose(stance: Stance, piece: Piece) -> str:
    """What a photo shows, in the field's words."""
    between = apart(stance.camera, stance.lamp)
    if stance.flash or between < RETRO:
        return "toward the lamp (retro-reflection)"
    if piece.ball:
        return (
            "against the light (grazing mirror directions)"
            if between > BEHIND
            else f"{between:.0f} degrees between"
        )
    up = stance.lamp.place * np.array([-1.0, -1.0, 1.0])
    if apart(stance.camera, Spot.of(up)) < MIRROR:
        return "in the mirror direction"
    steep = [90.0 - one.elevation for one in (stance.camera, stance.lamp)]
    return "grazing" if max(steep) > GRAZING else "beside the mirror direction"


def instruction(step: Step, piece: Piece, unit: str) -> str:
    """One photo as a sentence."""
    camera, lamp = step.stance.camera, step.stance.lamp
    place = f"camera {where(camera)}, {camera.distance:.0f} {unit} from the sample"
    lit = "flash on the camera" if step.stance.flash else f"lamp {where(lamp)}, {lamp.distance:.0f} {unit}"
    return f"{place}; {lit}: {purpose(step.stance, piece)}"


def lowered(step: Step) -> str:
    """What it does to the error of f."""
    return f"{percent(step.before)} -> {percent(step.after)}"


def percent(variance: float) -> str:
    """Standard error of f in per cent, of a mean relative variance."""
    return f"{100.0 * np.sqrt(variance):.2g} %"
