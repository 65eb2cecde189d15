"""Whether codes hang on what lies round about them, which no curve of all pixels makes: local tone mapping.

Programs that do so brighten what lies in the dark and darken what lies in the light. White print of one photo that is
dimmer than its lamp's light has it where its surroundings are bright, and brighter where they are dark, is such.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogonio.calib.response.curve import steepness
from photogonio.calib.response.paper_codes import PaperCodes
from photogonio.calib.response.paper_light import design_of
from photogonio.calib.response.unknowns import Unknowns
from photogonio.capture import robust
from photogonio.capture.containers.tone import srgb

_REACH = 0.08  # of the print's extent in the picture, that is round about
_WILD = 5.0  # standard deviations


def by_surroundings(layout: Unknowns, photos: Sequence[PaperCodes], values: np.ndarray) -> float:
    """Slope of white print's miss by its surroundings' light, logarithms of both: the middle of all photos. 0: codes
    hang on their own light alone."""
    shown = [(k, one) for k, one in enumerate(photos) if one.white.any()]
    return float(np.median([_of_photo(layout, one, k, values) for k, one in shown])) if shown else 0.0


def _of_photo(layout: Unknowns, one: PaperCodes, number: int, values: np.ndarray) -> float:
    seen = one.pose.apply(one.points)
    place = seen[:, :2] / seen[:, 2:]
    reach = _REACH * float(np.linalg.norm(np.ptp(place, axis=0)))
    weight = np.exp(-0.5 * ((place[one.white, None] - place) ** 2).sum(-1) / reach**2)
    around = np.log(weight @ srgb(one.code).mean(1) / weight.sum(1))
    miss = np.mean(
        [
            (design_of(layout, one, number, values, c)[1] * steepness(one.code[:, c]))[one.white]
            for c in range(layout.channels)
        ],
        axis=0,
    )
    miss = miss - np.median(miss)
    around = around - around.mean()
    tame = np.abs(miss) <= _WILD * robust.deviation(miss)
    power = float(around[tame] @ around[tame])
    return float(around[tame] @ miss[tame]) / power if power > 0 else 0.0
