"""How large the error of shading's model is in the shadows of one set, as squares of the print show it: less than
is expected of any set, or up to twice as much (path-traced sets: 1.1 to 1.9 times).

Errors within a square go together, so a square's summed scores count as one draw; as they are once that square is left
out of the fit, which else would follow it (a jackknife: Bell and McCaffrey, "Bias reduction in standard errors for
linear regression with multi-stage samples", 2002). Noise makes a known part of their size; the rest, over what the
expected error would make of it, is the share of it that there is.

Only errors that differ from square to square can be found so. What balls throw is smooth and moves the lamp instead,
and an edge close to a polished ball lies within one square or two: path-traced sets show little of either, yet their
lamps come out worse, and too sure, where less than expected is reckoned with.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

_EXPECTED = 5.0  # squares that what is expected counts as
_MOST = 2.0  # of what is expected
_NOTHING = 1e-9  # of the largest


@dataclass(frozen=True, slots=True)
class ErrorShown:
    """What one view's squares show, in units of all that the view tells."""

    beyond: float  # squared scores beyond what else there is
    expected: float  # the same if errors were as large as expected
    size: float  # sum of squares' expected squared scores, all errors as they are taken to be
    squared: float  # sum of the same squared


NOTHING = ErrorShown(0.0, 0.0, 0.0, 0.0)


def shown(
    score: np.ndarray,
    residual: np.ndarray,
    normal: np.ndarray,
    square: np.ndarray,
    share: np.ndarray,
    factor: float,
) -> ErrorShown:
    """From weighted scores (count, n) and residuals (n,) of samples that tell of the error, in standard errors.

    ``normal`` (count, count) is the information of all samples, ``square`` (n,) that in which a sample lies, ``share``
    (n,) its expected variance over the one that its standard error holds, in which it counts ``factor`` squared.
    """
    if not len(square):
        return NOTHING
    parts, order = _whitening(normal) @ score, np.argsort(square, kind="stable")
    edges = np.flatnonzero(np.diff(square[order])) + 1
    groups = np.split(parts[:, order], edges, axis=1)
    lever = np.stack([one @ one.T for one in groups])
    summed = np.stack([one @ r for one, r in zip(groups, np.split(residual[order], edges), strict=True)])
    free = (1 + _NOTHING) * np.eye(len(parts)) - lever
    total = float((np.linalg.solve(free, summed[:, :, None]) ** 2).sum())
    each, size = (parts**2).sum(0), np.trace(lever, axis1=1, axis2=2)
    rest = float(each @ (1 - factor**2 * share))
    return ErrorShown(total - rest, float(each @ share), float(size.sum()), float(size @ size))


def _whitening(normal: np.ndarray) -> np.ndarray:
    """Rows that make ``normal`` the unit matrix, of what it tells at all."""
    scale = 1 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    size, axes = np.linalg.eigh(normal * scale * scale[:, None])
    strong = size > _NOTHING * size.max()
    return (axes[:, strong] / np.sqrt(size[strong])).T * scale


def pooled(views: Iterable[ErrorShown]) -> float:
    """Of the expected error, what all views show together."""
    found = list(views)
    beyond, expected = sum(v.beyond for v in found), sum(v.expected for v in found)
    squares = sum(v.size for v in found) ** 2 / max(sum(v.squared for v in found), 1e-300)
    told = min(max(beyond / max(expected, 1e-300), 0.0), _MOST**2)
    return float(np.sqrt((_EXPECTED + squares * told) / (_EXPECTED + squares)))
