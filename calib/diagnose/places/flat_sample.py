"""A flat sample that lies beside its outline, is larger, or is tilted: its edges in several photos tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from photogonio.calib.adjust.flat_sample import PlaneMove, flat_move
from photogonio.calib.adjust.state import State
from photogonio.calib.diagnose.base import Departure, Stage
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.photoset import Plane

_TILTED = np.radians(0.7)
_SURE = 5.0  # standard errors at which it is told


class FlatSample(Departure):
    """The sample is taken to lie where its edges are, but level."""

    stage = Stage.PLACES
    entries = (
        Entry(
            "flat-sample-not-believed",
            "The flat sample's edges are not where the manifest puts them, by too much to be believed.",
            "Check `sample.outline` and `sample.height`.",
        ),
        Entry(
            "flat-sample-tilted",
            "The flat sample is tilted against the board, and taken as level.",
            "Lay it flat.",
            least=0.0122,
            sigmas=_SURE,
            source="radians; level samples have at most 0.0001 where they are drawn, 0.0004 in a path-traced set",
        ),
        Entry(
            "flat-sample-moved",
            "The flat sample lies beside its outline; this is allowed for.",
            "Correct `outline`.",
        ),
        Entry(
            "flat-sample-size",
            "The flat sample is larger or smaller than its outline; this is allowed for.",
            "Correct `sample.outline`.",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        move = flat_move(state.photoset, state.settled.camera, state.observations)
        if move is None:
            return []
        state.remarks.residuals["sample"] = numbers(move)
        # what is too little to be told moves the sample all the same, by no more than it is sure of
        return [
            Diagnosis("flat-sample-moved", allowed=True, grounds=move),
            *told(move, state.photoset.length_unit),
        ]

    def remedy(self, state: State, found: Sequence[Diagnosis]) -> State:
        sample = state.photoset.sample
        assert isinstance(sample, Plane)
        moved = found[0].grounds.applied(sample)
        return replace(state, photoset=replace(state.photoset, sample=moved))


def numbers(move: PlaneMove) -> dict[str, object]:
    """For setup.json's residuals."""
    x, y, turn, height, *slopes, wider, deeper = move.values.tolist()
    error = move.errors.tolist()
    return {
        "shift": [x, y, height],
        "shift_error": [error[0], error[1], error[3]],
        "turn": turn,
        "turn_error": error[2],
        "tilt": slopes,
        "tilt_error": error[4:6],
        "growth": [wider, deeper],
        "growth_error": error[6:],
    }


def told(move: PlaneMove, unit: str) -> list[Diagnosis]:
    """What of it a person should look at."""
    if not move.plausible:
        return [
            Diagnosis(
                "flat-sample-not-believed",
                "the flat sample's edges are not where the manifest puts them: not believed, the manifest's are kept; "
                "check sample.outline and sample.height",
            )
        ]
    x, y, _, height, *_, wider, deeper = move.values.tolist()
    said = []
    tilt, sure = move.tilt
    if tilt > max(_SURE * sure, _TILTED):
        message = (
            f"the flat sample is tilted by {np.degrees(tilt):.1f} degrees against the board, and is taken as level: "
            "lay it flat"
        )
        said.append(Diagnosis("flat-sample-tilted", message, tilt, sure, float(_TILTED), _SURE))
    far = np.abs(move.values) > np.maximum(_SURE * move.errors, move.expected)
    if far[:4].any():
        message = (
            f"the flat sample lies {x:+.2g}, {y:+.2g} {unit} beside its outline and {height:+.2g} {unit} higher than "
            "in the manifest; this is allowed for"
        )
        said.append(Diagnosis("flat-sample-moved", message, allowed=True, detail={"shift": [x, y, height]}))
    if far[6:].any():
        message = (
            f"the flat sample is {wider:+.1%} larger along x and {deeper:+.1%} along y than its outline in the "
            "manifest; this is allowed for"
        )
        said.append(Diagnosis("flat-sample-size", message, allowed=True, detail={"growth": [wider, deeper]}))
    return said
