"""Lamps whose places are known less, or are others, than it is taken for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogonio.calib.adjust.lamps import block_name, middle_of
from photogonio.calib.adjust.state import Settled, State
from photogonio.calib.detect.observation import Observation
from photogonio.calib.diagnose.base import Departure, Stage
from photogonio.calib.diagnose.photos.moved_lamp import SHARED_APART, SURE_APART, aside
from photogonio.calib.diagnose.photos.unusable_photos import contradiction
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.linear.prepare import untold_by_brackets
from photogonio.capture.photoset import Plane

UNSURE = 0.0873  # radians: a gloss of a flat sample would be seen elsewhere by its own width


class LampNotBelieved(Departure):
    """Photos of a lamp that was not found, of which mirror balls alone tell and contradict one another, or whose
    direction nothing tells, are left out."""

    stage = Stage.LAMP
    entries = (
        Entry(
            "lamp-not-believed",
            "A photo's lamp was not found, or its mirror balls contradict one another, or the white patch shows "
            "another falloff than that lamp's, or, of a flat sample, its direction is known to no better than 5 "
            "degrees. It is left out.",
            "See that the balls are not cut off, in shadow, or elsewhere than the manifest says.",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        settled = state.settled
        doubts = {
            name: contradiction(settled, [s for s in state.observations if s.light == name])
            for name in settled.lamps
        }
        # while codes are read by a curve that is not theirs nobody knows how well lamps are found: print will tell
        guessed = state.tone is None and untold_by_brackets(state.photoset)
        if isinstance(state.photoset.sample, Plane) and not guessed:
            doubts |= unsure(settled, middle_of(state.photoset), [s.light for s in state.observations])
        why = {
            s.view.name: doubts.get(s.light, f"light {s.light!r} is seen in no mirror ball and on no paper")
            for s in state.observations
            if not s.probe
        }
        left_out = {name: reason for name, reason in why.items() if reason is not None}
        if not left_out:
            return []
        return [Diagnosis("lamp-not-believed", amount=len(left_out), views=tuple(left_out), grounds=left_out)]

    def remedy(self, state: State, found: Sequence[Diagnosis]) -> State:
        for name, reason in found[0].grounds.items():
            state.remarks.leave_out(name, reason, "lamp-not-believed")
        return state.keeping(s for s in state.observations if s.view.name not in found[0].views)


def unsure(settled: Settled, middle: np.ndarray, lights: Sequence[str]) -> dict[str, str]:
    """Lamps whose directions from the ``middle`` (3,) are all but unknown, with the reason, where those of most photos'
    ``lights`` are known: their highlights lie outside the picture, and too little of the balls' shadows is in it.

    A sample that is a ball tells its lamp's direction itself; a flat one has the light of each photo from one, and
    would be taken for another surface.
    """
    errors = {}
    for name, lamp in settled.lamps.items():
        if lamp.fixed or lamp.attached or lamp.one_ray or block_name(name) not in settled.covariance:
            continue
        offset = settled.values[block_name(name)] - (middle if lamp.kind == "point" else 0.0)
        far = float(np.linalg.norm(offset))
        across = np.eye(3) - np.outer(offset, offset) / far**2
        spread = across @ settled.covariance[block_name(name)] @ across
        errors[name] = float(np.sqrt(np.linalg.norm(spread, 2))) / far
    left = {name: error for name, error in errors.items() if error > UNSURE}
    if 2 * sum(light in left for light in lights) >= len(lights):
        return {}
    return {
        name: "its lamp's direction is known to no better than "
        f"{min(np.degrees(error), 90.0):.0f} degrees: no mirror ball shows it, and too little of their shadows is seen"
        for name, error in left.items()
    }


class LonelyHighlights(Departure):
    """Lamps of which one ray alone is known."""

    stage = Stage.PLACES
    entries = (
        Entry(
            "one-mirror-ball",
            "Lamps are seen in one mirror ball only, so put as far away as the others.",
            "Let two polished balls show every lamp.",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        lamps = state.settled.lamps.values()
        lonely = [lamp.name for lamp in lamps if lamp.one_ray and lamp.kind == "point"]
        if not lonely:
            return []
        message = f"seen in one mirror ball only, so put as far away as the other lights: {', '.join(lonely)}"
        return [Diagnosis("one-mirror-ball", message, len(lonely))]


class SharedLight(Departure):
    """Lights that stood in several places under one name: each photo's paper tells its own, if it shows enough."""

    stage = Stage.PLACES
    entries = ()  # told as lamps that moved are

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        return apart(state.settled, state.observations)


def apart(settled: Settled, observations: Sequence[Observation]) -> list[Diagnosis]:
    """The lights that the paper of their photos surely has in different directions."""
    said = []
    for lamp in settled.lamps.values():
        names = tuple(
            s.view.name for s in observations if s.light == lamp.name and s.view.name in settled.shading
        )
        fits = [settled.shading[name] for name in names]
        if lamp.attached or len(fits) < 2:
            continue
        toward = np.array([fit.place / np.linalg.norm(fit.place) for fit in fits])
        angles = np.linalg.norm(toward - np.median(toward, axis=0), axis=1)
        errors = np.array([aside(fit) for fit in fits])
        worst = float(angles[angles > SURE_APART * errors].max(initial=0.0))
        if worst > SHARED_APART:
            message = (
                f"photos of light {lamp.name!r} show it in directions {np.degrees(worst):.0f} degrees apart: give each "
                "place of a lamp an id of its own"
            )
            error, least = float(errors.max()), float(SHARED_APART)
            said.append(
                Diagnosis("lamp-in-several-places", message, worst, error, least, SURE_APART, views=names)
            )
    return said
