"""The angles at which tables of values are written, and what is said of a BRDF in remarks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.modes.angles import unit_vectors

STEP, TURN = 5.0, 15.0  # degrees, of the polar angles and of the azimuths, at most
ROWS = 20_000  # that `fit` takes one by one
LAST = 88.0  # degrees: at 90 many BRDFs have no finite value
STEEP, STEEP_STEP = 75.0, 2.5  # degrees: from here on f changes fast with either polar angle
_STEPS = (5.0, 4.0, 3.0, 2.5, 2.0, 1.5, 1.25, 1.0)  # of polar angles, where a peak is looked at
_LOOKS, _REACH, _FINE = (45.0, 70.0), 15.0, 0.125  # degrees: incidences, and exit angles about them
_CLOSE = 0.004  # rms of what lines between rows miss of a peak, over that of f
_COARSER = 1.05  # steps of the search for a number of rows
_FIRST = 0.25  # step of azimuth about a peak, in polar steps, which grazing needs
_GROWTH, _FAST_GROWTH = 1.25, 1.5  # of the next steps; the second where azimuths go all the way round


@dataclass(frozen=True, slots=True)
class Steps:
    """Degrees between polar angles that tell the peaks about the mirror's direction and about the light's own."""

    mirror: float = STEP
    retro: float = STEP

    @classmethod
    def of(cls, brdf: Brdf, azimuths: Callable[[Steps], np.ndarray]) -> Steps:
        """As coarse as will do, or, with exit azimuths by the steps, as fine as so many rows allow as ``fit`` takes one
        by one; of a surface that turns the coarsest, since its grid has four axes."""
        if brdf.turning:
            return cls()
        found = cls(_step(brdf, np.pi), _step(brdf, 0.0))
        while len(found.polar_nodes()) ** 2 * len(azimuths(found)) > ROWS:
            found = cls(*(min(_COARSER * step, STEP) for step in (found.mirror, found.retro)))
        return found

    def polar_nodes(self) -> np.ndarray:
        """Polar angles, degrees."""
        return polar_nodes(min(self.mirror, self.retro))

    def half_turn(self, growth: float = _GROWTH) -> np.ndarray:
        """Azimuths from the light's own side to the mirror's, degrees: finer about a peak that is narrow."""
        near, far = _offsets(self.retro, growth), 180.0 - _offsets(self.mirror, growth)[::-1]
        if self.retro == STEP:
            near = np.arange(0.0, 90.0, TURN)
        if self.mirror == STEP:
            far = np.arange(90.0, 181.0, TURN)
        return np.concatenate([near, far[far > near[-1]]])

    def whole_turn(self) -> np.ndarray:
        """Such ones all the way round."""
        half = self.half_turn(_FAST_GROWTH)
        return np.concatenate([half, 360.0 - half[-2:0:-1]])


def polar_nodes(step: float = STEP) -> np.ndarray:
    """Polar angles, degrees, at most ``step`` apart."""
    upright = np.arange(0.0, STEEP - 1e-9, step)
    return np.concatenate([upright, np.arange(STEEP, LAST, min(step, STEEP_STEP)), [LAST]]).round(2)


def turns(step: float = TURN) -> np.ndarray:
    """Azimuths of a whole turn, degrees."""
    return np.arange(0.0, 360.0, step)


def scale_in_words(brdf: Brdf) -> str:
    """What the values are up to."""
    return "absolute scale" if brdf.scale == "absolute" else "relative scale: up to one factor a channel"


def title(brdf: Brdf) -> str:
    """What the BRDF is called: by the set or table that it came from."""
    return str(brdf.source.get("name") or "photogonio")


def _step(brdf: Brdf, phi: float) -> float:
    """The largest step with which lines follow f in the plane of incidence, about exit angles like the light's."""
    offset = np.arange(-_REACH, _REACH + 0.5 * _FINE, _FINE)
    found = STEP
    for look in _LOOKS:
        theta = look + offset
        theta = theta[theta < LAST]
        exit = unit_vectors(np.radians(theta), phi)
        f = np.maximum(brdf(np.broadcast_to(unit_vectors(np.radians(look), 0.0), exit.shape), exit), 0.0)
        missed = {step: _missed(theta, f, step) for step in _STEPS}
        found = min(found, next((step for step in _STEPS if missed[step] < _CLOSE), _STEPS[-1]))
    return found


def _missed(theta: np.ndarray, f: np.ndarray, step: float) -> float:
    """Of the worst channel, rms of what lines between nodes on multiples of ``step`` miss of f (n, c), over f's."""
    nodes = np.arange(np.ceil(theta[0] / step), np.floor(theta[-1] / step) + 1) * step
    kept = (theta >= nodes[0]) & (theta <= nodes[-1])
    lines = [np.interp(theta[kept], nodes, np.interp(nodes, theta, one)) for one in f.T]
    error = np.mean((np.array(lines) - f[kept].T) ** 2, axis=1)
    return float(np.sqrt((error / np.maximum(np.mean(f[kept] ** 2, axis=0), 1e-300)).max()))


def _offsets(step: float, growth: float) -> np.ndarray:
    """Degrees from 0 to at most 90, growing apart to the usual azimuths' step."""
    found, apart = [0.0], _FIRST * step
    while found[-1] + apart <= 90.0:
        found.append(found[-1] + apart)
        apart = min(growth * apart, TURN)
    return np.round(found, 2)  # as the files have it
