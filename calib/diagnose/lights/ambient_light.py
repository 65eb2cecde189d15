"""Light that is on the board whatever the lamp does: a window, a lit room. Shadows and falloff tell it apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from photogonio.calib.adjust.state import State
from photogonio.calib.detect.observation import Observation
from photogonio.calib.diagnose.base import Doubt, LightDeparture
from photogonio.calib.setup import ViewSetup
from photogonio.calib.shading.correction import NO_FALLOFF
from photogonio.calib.shading.fit import ShadingFit
from photogonio.calib.shading.parameters import EVEN
from photogonio.capture.diagnosis import Diagnosis, Entry

_BESIDE = 0.015  # of the lamp's light: light from elsewhere that is told, and
_SURE_BESIDE = 5.0  # standard errors at which it is
_MEASURED = ("white patch", "board")  # sources of a strength that paper can be weighed against


@dataclass(frozen=True, slots=True)
class Beside:
    """Radiance of white paper without the lamp, the same in all photos."""

    level: float
    error: float
    bright: float  # the same by a lamp alone, the median over the photos


def light_beside(shading: dict[str, ShadingFit]) -> Beside | None:
    """As the shading of all photos tells it together; None if there is none."""
    if not shading:
        return None
    level, error = np.array([f.beside for f in shading.values()]).T
    sure = np.isfinite(level) & (error > 0)
    if not sure.any():
        return None
    level, error = level[sure], error[sure]
    bright = float(np.median([f.level for f in shading.values()]))
    mean = float(np.average(level, weights=error**-2.0))
    scatter = np.sum(((level - mean) / error) ** 2) / max(len(level) - 1, 1)
    return Beside(mean, float(np.sqrt(max(scatter, 1.0) / np.sum(error**-2.0))), bright)


class AmbientLight(LightDeparture):
    """Light on the board whatever the lamp does, which shading reckons with from the start."""

    code = "ambient-light"
    after = ("lamp-beam", "vignetting")
    anew = ("lamp-beam", "vignetting")
    entries = (
        Entry(
            "ambient-light",
            "Something besides the lamp lights the board. Allowed for as an even sky of the lamp's "
            "colour, which a window "
            "is not.",
            "Darken the room, or take a photo with the lamp off from the same place, role `ambient`.",
            least=0.015,
            sigmas=5.0,
            source="of the lamp's light; path-traced and rendered sets in dark rooms have 0.002 to 0.006",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        one = light_beside(state.settled.shading)
        if one is None:
            return []
        share, error = one.level / one.bright, one.error / one.bright
        return [Diagnosis(self.code, "", float(share), float(error), _BESIDE, _SURE_BESIDE, grounds=one)]

    def remedy(self, state: State, found: Sequence[Diagnosis]) -> State:
        known = (found[0].grounds.level, found[0].grounds.error)
        state = state.with_paper(lambda _, reading: replace(reading, beside=known))
        return replace(state, narrow=0.0, falloff=NO_FALLOFF)

    def numbers(self, found: Diagnosis) -> dict[str, object]:
        return {"light_beside_lamps": {"share": found.amount, "error": found.error}}

    def doubt(self, state: State, views: Sequence[ViewSetup]) -> Doubt:
        return Doubt(0.0, room_doubt(state))

    def message(self, found: Diagnosis, *, allowed: bool) -> str:
        if not found.told:
            return ""
        how = (
            "allowed for as if it came from all over the sky alike and had the lamp's colour"
            if allowed
            else "which is left in what the sample shows, since no paper or patch was weighed against the lamps"
        )
        return (
            f"the board is lit by something besides the lamp, by {found.amount:.0%} of what the lamp gives: {how}; "
            'darken the room, or add a photo with the lamp off (role "ambient")'
        )


def room_doubt(state: State) -> float:
    """Standard error, relative, that it leaves in what patch and paper tell of the lamps' strengths: where it is not
    allowed for, all of it that chance does not explain."""
    found = state.found.get(AmbientLight.code)
    if found is None:
        return 0.0
    return found.error if found.allowed else float(np.sqrt(max(found.amount**2 - found.error**2, 0.0)))


def ambient_known(state: State, views: Sequence[ViewSetup]) -> np.ndarray | None:
    """Irradiance (c,) of level ground by that light, if there is any and it can be known."""
    found = state.found.get(AmbientLight.code)
    return None if found is None or not found.allowed else ambient_irradiance(views, state.observations)


def ambient_irradiance(views: Sequence[ViewSetup], observations: Sequence[Observation]) -> np.ndarray | None:
    """The same, in the units of the views' strengths; None if no photo's paper was weighed against its lamp."""
    paper = {s.view.name: s for s in observations if s.shading is not None}
    light = []
    for view in views:
        observation = paper.get(view.name)
        reading = None if observation is None else observation.reading
        if observation is None or observation.shading is None or reading is None:
            continue
        if view.light.kind == "point" and view.strength_source in _MEASURED:
            toward, falloff = view.light.toward(reading.samples.points)
            middle = float(np.median(np.clip(toward[:, 2], 0.0, None) * falloff))
            light.append(max(float(observation.shading[EVEN]), 0.0) * middle * view.strength)
    return np.median(light, axis=0) if light else None
