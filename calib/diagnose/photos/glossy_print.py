"""Black print that shines: toner, glossy paper. Where it shows the lamp it is no even share of the white beside it, and
tells neither how the board is lit nor, by itself, whether a photo is sharp. White, many times brighter, is read alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from photogonio.calib.adjust.state import State
from photogonio.calib.detect.paper_near_balls import Close
from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.diagnose.base import Departure, Stage
from photogonio.calib.remarks import listed
from photogonio.calib.shading.initial import Shares, square_ratios
from photogonio.capture.diagnosis import Diagnosis, Entry

# relative error of black over white in a square, beside noise; path-traced matte prints have 0.02, toner of roughness
# 0.2 has 0.05 to 2
_EVEN = 0.07
_UNEVEN = (
    1.5  # times this error and noise, by which shares scatter that are not even; of noise alone once in 200
)
_SQUARES = 6  # evenly lit ones, that tell it
_SHARE, _FEWEST = 0.2, 2  # of the photos, and how many of them at least: one alone has light on its lens
_QUANTILES, _SIGMAS = (0.1, 0.9), 2.563  # that many standard deviations apart
_WHITE = 0.98  # share of white print in a pixel close to a ball that counts as white
_SAMPLES, _CLOSE = 200, 30  # of white that are worth a fit


class GlossyPrint(Departure):
    """Black print that shines: the white is read alone, in all photos, for what black shows of the lamp differs from
    each to each."""

    stage = Stage.PHOTO
    entries = (
        Entry(
            "glossy-print",
            "Black print is no even share of the white beside it: toner, or paper, that mirrors the lamp, "
            "or light that "
            "spreads in the lens. Lamps are found by the white alone, less surely, which is in the stated errors.",
            "Print on matte paper, without toner; clean the lens.",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        shiny = shining({name: square_ratios(reading) for name, reading in state.papers()})
        if not shiny:
            return []
        message = (
            f"the black print is no even share of the white beside it, in {len(shiny)} photos ({listed(shiny)}): it "
            "shines, or light spreads in the lens. Only the white is read; print on matte paper, without toner"
        )
        return [Diagnosis("glossy-print", message, len(shiny), views=tuple(shiny), allowed=True)]

    def remedy(self, state: State, found: Sequence[Diagnosis]) -> State:
        state.remarks.residuals["shining_print"] = list(found[0].views)
        return state.with_paper(lambda _, reading: white_alone(reading))


def shining(shares: Mapping[str, Shares]) -> list[str]:
    """Photos in which black print is an uneven share of the white, if they are too many for mishaps; else none."""
    found = [name for name, own in shares.items() if _scatter(own) > _UNEVEN]
    return found if len(found) >= max(_SHARE * len(shares), _FEWEST) else []


def _scatter(shares: Shares) -> float:
    """By how many times their errors the squares' shares of black in white scatter."""
    ratios, errors, _ = shares
    if len(ratios) < _SQUARES:
        return 0.0
    middle = float(np.median(ratios))
    low, high = np.quantile((ratios - middle) / np.hypot(_EVEN * middle, errors), _QUANTILES)
    return float(high - low) / _SIGMAS


def white_alone(reading: PaperReading) -> PaperReading | None:
    """A reading without its black print; None if that is too little.

    Where a film lies over all of the sheet white shines as black does: by how much of the white black is more there
    than in the photo's darkest squares, white is unsure, in all of a square alike.
    """
    white, close = reading.samples.white, reading.close
    if white.sum() < _SAMPLES:
        return None
    level, square = reading.level[white], reading.samples.square[white]
    doubt = _crowd(square) * (_film(reading, reading.samples.points[white]) * level) ** 2
    return replace(
        reading,
        samples=reading.samples.keep(white),
        level=level,
        noise=reading.noise[white] + doubt,
        close=None if close is None else _white_close(reading, close),
    )


def _crowd(square: np.ndarray) -> float:
    """Samples of a square."""
    return len(square) / max(len(np.unique(square)), 1)


def _film(reading: PaperReading, points: np.ndarray) -> np.ndarray:
    """Share (n,) of the white light at ``points`` (n, 3) that may be a film's, by the nearest squares' black print."""
    ratios, _, places = square_ratios(reading)
    if len(ratios) < _SQUARES:
        return np.zeros(len(points))
    nearest = cKDTree(places).query(points[:, :2])[1]
    return np.maximum(ratios - np.quantile(ratios, _QUANTILES[0]), 0.0)[nearest]


def _white_close(reading: PaperReading, close: Close) -> Close | None:
    close = close.keep(close.white > _WHITE)
    if len(close.level) < _CLOSE:
        return None
    doubt = _crowd(close.square) * (_film(reading, close.points) * close.level) ** 2
    return replace(close, noise=close.noise + doubt)
