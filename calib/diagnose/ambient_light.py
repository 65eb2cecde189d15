"""Light that is on the board whatever the lamp does: a window, a lit room. Shadows and falloff tell it apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from photogonio.calib.detect.highlights import Highlight
from photogonio.calib.detect.observation import Observation, start_over
from photogonio.calib.remarks import Remarks
from photogonio.calib.setup import ViewSetup
from photogonio.calib.shading.fit import ShadingFit
from photogonio.calib.shading.parameters import EVEN

_BESIDE = 0.015  # of the lamp's light: light from elsewhere that is told, and
_SURE_BESIDE = 5.0  # standard errors at which it is
_MEASURED = ("white patch", "board")  # sources of a strength that paper can be weighed against


@dataclass(frozen=True, slots=True)
class Beside:
    """Radiance of white paper without the lamp, the same in all photos."""

    level: float
    error: float
    bright: float  # the same by a lamp alone, the median over the photos

    @property
    def told(self) -> bool:
        """Whether it is so much, and so surely, that it must be allowed for."""
        return self.level > max(_BESIDE * self.bright, _SURE_BESIDE * self.error)

    @property
    def doubt(self) -> float:
        """Standard error, relative, that it leaves in what patch and paper tell of the lamps' strengths: where it is
        not allowed for, all of it that chance does not explain."""
        left = self.error if self.told else np.sqrt(max(self.level**2 - self.error**2, 0.0))
        return float(left) / self.bright


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


def expect(
    observations: Sequence[Observation], highlights: Sequence[list[Highlight]], beside: Beside
) -> None:
    """Let the shading of all photos reckon with it from the start."""
    start_over(observations, highlights)
    for observation in observations:
        reading = observation.reading
        if reading is not None:
            observation.reading = replace(reading, beside=(beside.level, beside.error))


def note_beside(beside: Beside | None, ambient: np.ndarray | None, remarks: Remarks) -> None:
    """What was found, and a warning if it is much, which says whether ``ambient`` light of the sample's is known."""
    if beside is None:
        return
    share, doubt = beside.level / beside.bright, beside.error / beside.bright
    remarks.residuals["light_beside_lamps"] = {"share": float(share), "error": float(doubt)}
    if beside.told:
        allowed = (
            "allowed for as if it came from all over the sky alike and had the lamp's colour"
            if ambient is not None
            else "which is left in what the sample shows, since no paper or patch was weighed against the lamps"
        )
        remarks.tell(
            "ambient-light",
            f"the board is lit by something besides the lamp, by {share:.0%} of what the lamp gives: {allowed}; darken "
            'the room, or add a photo with the lamp off (role "ambient")',
            amount=float(share),
            error=float(doubt),
            least=_BESIDE,
            sigmas=_SURE_BESIDE,
            allowed=True,
        )


def ambient_irradiance(views: Sequence[ViewSetup], observations: Sequence[Observation]) -> np.ndarray | None:
    """Irradiance (c,) of level ground by that light, in the units of the views' strengths; None if no photo's paper
    was weighed against its lamp."""
    paper = {s.view.name: s for s in observations if s.has_paper and s.shading is not None}
    found = []
    for view in views:
        observation = paper.get(view.name)
        if observation is not None and view.light.kind == "point" and view.strength_source in _MEASURED:
            toward, falloff = view.light.toward(observation.reading.samples.points)
            middle = float(np.median(np.clip(toward[:, 2], 0.0, None) * falloff))
            found.append(max(float(observation.shading[EVEN]), 0.0) * middle * view.strength)
    return np.median(found, axis=0) if found else None
