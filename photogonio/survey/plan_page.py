"""The plan as a page: a picture from above and a list to tick, to be read on a screen or printed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources

import numpy as np
from jinja2 import Environment, StrictUndefined

from photogonio.reconstruct.design.places import Step
from photogonio.reconstruct.design.spots import Spot
from photogonio.survey.plan_words import lowered, percent, purpose
from photogonio.survey.planning import Aim
from photogonio.survey.words import COMPASS, where

SIZE = 230.0  # of the picture's half side
HORIZON = 180.0  # radius of the horizon in it
RINGS = (15, 30, 45, 60, 75)  # degrees above the board
APART = 11.0  # two marks that would hide one another are moved so far


@dataclass(frozen=True, slots=True)
class Mark:
    """A numbered place in the picture."""

    x: float
    y: float
    text: str
    kind: str  # "camera" | "lamp" | "flash" | "taken-camera" | "taken-lamp"


@dataclass(frozen=True, slots=True)
class ListedPhoto:
    """One photo in the list."""

    number: int
    camera: str
    lamp: str
    purpose: str
    lowered: str
    worth: bool


def plan_page(aim: Aim, steps: Sequence[Step], verdict: str, source: str, unit: str = "mm") -> str:
    """The page as HTML text."""
    text = resources.files("photogonio.survey").joinpath("templates/plan.html").read_text(encoding="utf-8")
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.from_string(text).render(
        what=aim.what,
        verdict=verdict,
        source=source,
        size=SIZE,
        horizon=HORIZON,
        rings=[(degrees, round(_radius(degrees), 1)) for degrees in RINGS],
        sides=_sides(),
        board=_board(aim),
        marks=marks(aim, steps),
        rows=rows(aim, steps, unit),
        before=percent(steps[0].before) if steps else "",
        after=percent(steps[-1].after) if steps else "",
    )


def rows(aim: Aim, steps: Sequence[Step], unit: str) -> list[ListedPhoto]:
    """The list."""
    found = []
    for k, step in enumerate(steps, start=1):
        camera, lamp = step.stance.camera, step.stance.lamp
        lit = "flash on the camera" if step.stance.flash else f"{where(lamp)}, {lamp.distance:.0f} {unit}"
        away = f"{where(camera)}, {camera.distance:.0f} {unit}"
        found.append(ListedPhoto(k, away, lit, purpose(step.stance, aim.piece), lowered(step), step.worth))
    return found


def marks(aim: Aim, steps: Sequence[Step]) -> list[Mark]:
    """Places as they are seen from straight above, the board's x to the right."""
    found = []
    for one in aim.taken:
        found += [_mark(one.camera, "", "taken-camera"), _mark(one.lamp, "", "taken-lamp")]
    used: list[tuple[float, float]] = []
    for k, step in enumerate(steps, start=1):
        camera = _mark(step.stance.camera, str(k), "camera")
        found.append(_clear(camera, used))
        if not step.stance.flash:
            found.append(_clear(_mark(step.stance.lamp, str(k), "lamp"), used))
        else:
            found[-1] = Mark(found[-1].x, found[-1].y, str(k), "flash")
    return found


def _mark(spot: Spot, text: str, kind: str) -> Mark:
    reach, turn = _radius(spot.elevation), np.radians(spot.azimuth)
    return Mark(round(float(reach * np.cos(turn)), 1), round(float(-reach * np.sin(turn)), 1), text, kind)


def _clear(mark: Mark, used: list[tuple[float, float]]) -> Mark:
    """The mark moved along its ring until it hides none of those before it."""
    x, y = mark.x, mark.y
    reach = max(float(np.hypot(x, y)), APART)
    for _ in range(60):
        if all(np.hypot(x - a, y - b) >= APART for a, b in used):
            break
        turn = np.arctan2(y, x) + APART / reach
        x, y = reach * np.cos(turn), reach * np.sin(turn)
    used.append((x, y))
    return Mark(round(float(x), 1), round(float(y), 1), mark.text, mark.kind)


def _radius(elevation: float) -> float:
    return HORIZON * (90.0 - max(elevation, 0.0)) / 90.0


def _sides() -> list[tuple[float, float, str]]:
    found = []
    for k, name in enumerate(COMPASS):
        turn = np.radians(45.0 * k)
        reach = HORIZON + 22.0
        found.append((round(float(reach * np.cos(turn)), 1), round(float(4 - reach * np.sin(turn)), 1), name))
    return found


def _board(aim: Aim) -> tuple[float, float, float, float]:
    """x, y, width and height of the board about the sample, as a sign of which way it lies."""
    width, height = aim.board or (180.0, 140.0)
    scale = 60.0 / max(width, height)
    middle = aim.middle[:2] if aim.board else np.array([0.5 * width, 0.5 * height])
    left, top = -middle[0] * scale, -(height - middle[1]) * scale
    return round(float(left), 1), round(float(top), 1), round(width * scale, 1), round(height * scale, 1)
