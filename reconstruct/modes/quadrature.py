"""Rules to integrate over the hemisphere without sampling noise.

Elevations are integrated over rho = sqrt(2) sin(theta / 2), sin(theta) dtheta = 2 rho drho: in rho the modes are
polynomials, and theta, cos(theta) and sin(theta) are analytic from the pole to the horizon, so that a Gauss rule is
exact for expansions and converges fast for whatever is smooth. Near peaks and at the horizon the interval is cut into
panels that halve toward the place.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

GRAZING_POWER = 6  # of the last panel: 1 - rho = width t^6 makes cos(theta)^(k - 1) smooth enough for k > 1/6


@lru_cache(maxsize=128)
def gauss(points: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre nodes and weights on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    return (nodes + 1) / 2, weights / 2


def panel_rule(bounds: np.ndarray, points: int, more: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of Gauss points on each interval between ascending ``bounds``.

    ``points`` on each, and ``more`` shared out among them by width, for what oscillates on the whole interval.
    """
    counts = points + np.ceil(more * np.diff(bounds) / (bounds[-1] - bounds[0])).astype(int)
    nodes, weights = zip(*[gauss(int(count)) for count in counts], strict=True)
    start, width = np.repeat(bounds[:-1], counts), np.repeat(np.diff(bounds), counts)
    return start + width * np.concatenate(nodes), width * np.concatenate(weights)


def graded_bounds(low: float, high: float, peaks: tuple[float, ...], level: int) -> np.ndarray:
    """Ascending bounds from ``low`` to ``high``, at each peak and at halving distances from it, 2^-level the least."""
    steps = np.concatenate([[0.0], (high - low) * 0.5 ** np.arange(1, level + 1)])
    bounds = np.concatenate([[low, high], *[(peak - steps, peak + steps) for peak in peaks]], axis=None)
    bounds = np.unique(np.clip(bounds, low, high))
    return bounds[np.concatenate([[True], np.diff(bounds) > 1e-9])]


def elevation_rule(
    points: int, more: int = 0, *, level: int = 0, peak: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """theta and weights with sum w g(theta) = integral of g sin(theta) dtheta from 0 to pi / 2.

    ``points`` and ``more`` as for :func:`panel_rule`. Level 0 is one panel, exact for polynomials in rho of degree
    up to 2 (points + more) - 2. A higher level grades the panels toward the horizon and toward theta = ``peak``, and
    bears an integrable singularity at the horizon.
    """
    theta, weight = _elevation_rule(points, more, level, peak)
    return theta.copy(), weight.copy()


# albedos of many lobes take the same rules, which cost as much as what they are used for
@lru_cache(maxsize=1024)
def _elevation_rule(points: int, more: int, level: int, peak: float | None) -> tuple[np.ndarray, np.ndarray]:
    if level == 0:
        rho, weight = panel_rule(np.array([0.0, 1.0]), points, more)
    else:
        peaks = (1.0,) if peak is None else (1.0, float(np.sqrt(2) * np.sin(min(peak, np.pi / 2) / 2)))
        bounds = graded_bounds(0.0, 1.0, peaks, level)
        rho, weight = panel_rule(bounds[:-1], points, more)
        nodes, shares = gauss(points)
        width = 1 - bounds[-2]
        rho = np.append(rho, 1 - width * nodes**GRAZING_POWER)
        weight = np.append(weight, width * GRAZING_POWER * nodes ** (GRAZING_POWER - 1) * shares)
    return 2 * np.arcsin(np.minimum(rho / np.sqrt(2), np.sqrt(0.5))), 2 * rho * weight


def azimuth_rule(points: int, more: int = 0, *, level: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """dphi in [0, pi] and weights; both signs of the nodes together make a rule for the whole turn.

    Level 0 is equally spaced, exact for cos(k dphi) with k < 2 (points + more). A higher level has panels graded
    toward 0 and pi, the retro- and the mirror direction, and broken at pi / 2.
    """
    if level == 0:
        count = points + more
        return np.pi * (np.arange(count) + 0.5) / count, np.full(count, np.pi / count)
    return panel_rule(graded_bounds(0.0, np.pi, (0.0, np.pi), level), points, more)
