"""A sample ball that stands beside the manifest's centre: where corners, limbs and shading put it, if that can be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from photogonio.calib.adjust.state import Settled, State
from photogonio.calib.adjust.terms import SAMPLE_PLACE
from photogonio.calib.diagnose.base import Departure, Stage
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.photoset import Sphere

_IMPLAUSIBLE = 4.0  # expected errors of the manifest at which a move is not believed


class SampleBall(Departure):
    """The ball is taken to be where it settled, as far as that is believed."""

    stage = Stage.PLACES
    entries = (
        Entry(
            "sample-moved",
            "The sample ball stands a little off the manifest's centre; this is allowed for.",
            "Correct `sample.center`.",
            least=SAMPLE_PLACE,
            source="of its radius; drawn sets in order have at most 0.012, path-traced ones, whose balls stand beside "
            "their places by up to half a millimetre, 0.02",
        ),
        Entry(
            "sample-not-believed",
            "The sample ball seems to stand farther off than anybody can mistake; the manifest's place is kept.",
            "Check `sample.center` and `sample.radius`, and with a ruler whether the board's squares are as long as "
            "the manifest says.",
            least=_IMPLAUSIBLE * SAMPLE_PLACE,
            source="of its radius, or a fourth as much of the radius itself; 4 times what is expected of a manifest",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        sample, settled = state.photoset.sample, state.settled
        if not isinstance(sample, Sphere) or "sample" not in settled.values:
            return []
        block = settled.values["sample"]
        error = np.sqrt(np.diag(settled.covariance["sample"]))
        shift = block[:3] - sample.center
        state.remarks.residuals["sample"] = {
            "shift": shift.tolist(),
            "shift_error": error[:3].tolist(),
            "radius_change": float(block[3] - sample.radius),
            "radius_error": float(error[3]),
            "covariance": settled.covariance["sample"].tolist(),
        }
        return [_told(sample, float(np.linalg.norm(shift)), settled, state.photoset.length_unit)]

    def remedy(self, state: State, found: Sequence[Diagnosis]) -> State:
        if not found[0].allowed:
            return state
        block = state.settled.values["sample"]
        sample = Sphere(block[:3].copy(), float(block[3]))
        return replace(state, photoset=replace(state.photoset, sample=sample))


def _told(sample: Sphere, moved: float, settled: Settled, unit: str) -> Diagnosis:
    """In words where it matters."""
    if not believed(sample, settled):
        return Diagnosis(
            "sample-not-believed",
            f"the sample ball seems to stand {moved:.3g} {unit} off the manifest's center: not believed, the "
            "manifest's is kept; check sample.center, sample.radius, and with a ruler whether the board's squares are "
            "as long as the manifest says",
            amount=moved,
        )
    message = f"the sample ball stands {moved:.3g} {unit} off the manifest's center; this is allowed for"
    far = moved > SAMPLE_PLACE * sample.radius
    return Diagnosis("sample-moved", message if far else "", amount=moved, allowed=True)


def believed(sample: Sphere, settled: Settled) -> bool:
    """Whether the refined sample is plausible."""
    block = settled.values["sample"]
    off = float(np.linalg.norm(block[:3] - sample.center)) / sample.radius
    return off < _IMPLAUSIBLE * SAMPLE_PLACE and abs(block[3] / sample.radius - 1) < SAMPLE_PLACE
