"""The response curve of a camera whose encoding is unknown, from exposure series of still scenes.

Three candidates: Debevec & Malik, SIGGRAPH 1997, and Robertson et al., ICIP 1999, both as OpenCV has them,
and a spline through the comparagram (Mann, "Comparametric equations", IEEE TIP 2000), which uses every
pixel. The one that best predicts one exposure from another is taken, and refused if that is not good
enough.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from scipy.interpolate import BSpline

CODES = 256
LOW, HIGH = 4, 250  # codes that noise and clipping leave alone
KNOTS = 10  # of the spline in the logarithm of the code
STIFFNESS = 1e-2  # against ripples of the period of the exposure step, which no bracket can see
LEAST_COUNT = 30  # pixels behind one entry of the comparagram
WIDEST_GAP = 48  # codes that no pixel pair tells of
OPENCV_PIXELS = 40_000  # that OpenCV's methods are given
WORST = 0.10  # relative error of predicted exposure beyond which no curve is believed
BACKWARD = 0.02  # of the curve's height by which it may fall before it is refused


@dataclass(frozen=True, slots=True)
class Series:
    """Photos of one still view."""

    codes: tuple[np.ndarray, ...]  # (h, w, c) uint8 each
    exposures: tuple[float, ...]  # relative


@dataclass(frozen=True, slots=True)
class Response:
    table: np.ndarray  # (256, c) linear signal of each code: 0 at 0, 1 at 255, rising
    method: str
    error: float  # rms relative error of predicted exposures, over codes and channels


def recover_response(series: Sequence[Series]) -> Response:
    """The curve that best keeps to reciprocity. Raises ValueError, saying why, if none is good enough."""
    pairs = [pair for one in series for pair in neighbours(one)]
    if not pairs:
        raise ValueError("needs photos of one view with different exposures")
    entries = [comparagram(pairs, c) for c in range(series[0].codes[0].shape[2])]
    if not all(spans(entry) for entry in entries):
        raise ValueError("the exposures of the brackets share too few levels")
    found = []
    for name, method in (("debevec", debevec), ("robertson", robertson), ("comparagram", spline)):
        table = normalised(method(series, entries))
        if table is not None:
            found.append(Response(table, name, reciprocity_error(table, entries)))
    if not found:
        raise ValueError("no curve that rises with exposure fits the brackets")
    best = min(found, key=lambda response: response.error)
    if not best.error <= WORST:
        what = f"the best curve ({best.method}) predicts exposures to {best.error:.0%} only"
        raise ValueError(f"{what}; something moved, or the stated exposures are wrong")
    return best


def neighbours(series: Series) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Pairs of photos next to one another in exposure: the darker, the brighter, the logarithm of their
    ratio.
    """
    order = np.argsort(series.exposures, kind="stable")
    pairs = []
    for a, b in pairwise(order):
        step = np.log(series.exposures[b] / series.exposures[a])
        if step > 0.01:
            pairs.append((series.codes[a], series.codes[b], float(step)))
    return pairs


def comparagram(pairs: Sequence[tuple[np.ndarray, np.ndarray, float]], channel: int) -> np.ndarray:
    """Entries (n, 4) of one channel: code in the darker photo, in the brighter one, log exposure step,
    pixels.

    For each code of one photo the mean code of the same pixels in the other, in both directions, so that
    the noise of neither biases the curve.
    """
    entries = []
    for dark, bright, step in pairs:
        joint = np.bincount(
            dark[..., channel].ravel().astype(np.int64) * CODES + bright[..., channel].ravel(),
            minlength=CODES * CODES,
        ).reshape(CODES, CODES)
        codes = np.arange(CODES)
        for counts, flip in ((joint, False), (joint.T, True)):
            total = counts.sum(axis=1)
            mean = counts @ codes / np.maximum(total, 1)
            clipped = counts[:, HIGH:].sum(axis=1) + counts[:, :LOW].sum(axis=1)
            good = (total >= LEAST_COUNT) & (clipped == 0) & (codes >= LOW) & (codes <= HIGH)
            first, second = (mean, codes) if flip else (codes, mean)
            entries.append(np.column_stack([first, second, np.full(CODES, step), total])[good])
    return np.concatenate(entries)


def spans(entries: np.ndarray) -> bool:
    """Whether entries reach over the codes without a wide gap."""
    codes = np.concatenate([entries[:, :2].ravel(), [LOW, HIGH]])
    return len(entries) > 0 and float(np.diff(np.sort(codes)).max()) <= WIDEST_GAP


def spline(series: Sequence[Series], entries: Sequence[np.ndarray]) -> np.ndarray:
    """Logarithm of the signal as a cubic spline in the logarithm of the code, by least squares on the
    comparagram.

    The constant is free: the spline's coefficients are solved with the least norm.
    """
    inner = np.linspace(np.log(LOW), np.log(HIGH), KNOTS)
    spacing = inner[1] - inner[0]
    knots = inner[0] + spacing * np.arange(
        -3, KNOTS + 3
    )  # even: a power law costs nothing, nor one whose power changes evenly

    def basis(code: np.ndarray) -> np.ndarray:
        return BSpline.design_matrix(np.clip(np.log(code), inner[0], inner[-1]), knots, 3).toarray()

    codes = np.arange(LOW, HIGH + 1)
    columns = []
    for entry in entries:
        # signal's relative noise falls with the code: entries count by pixels and by code
        weight = np.sqrt(np.minimum(entry[:, 3], 1000.0)) * np.sqrt(entry[:, 0])
        design = (basis(entry[:, 1]) - basis(entry[:, 0])) * weight[:, None]
        bend = np.diff(np.eye(design.shape[1]), 3, axis=0) * STIFFNESS * np.linalg.norm(design)
        target = np.concatenate([entry[:, 2] * weight, np.zeros(len(bend))])
        solution = np.linalg.lstsq(np.vstack([design, bend]), target, rcond=1e-9)[0]
        columns.append(np.exp(np.interp(np.arange(CODES), codes, basis(codes) @ solution)))
    return np.column_stack(columns)


def debevec(series: Sequence[Series], _: Sequence[np.ndarray]) -> np.ndarray:
    return opencv(cv2.createCalibrateDebevec(samples=200, lambda_=20.0), series[0])


def robertson(series: Sequence[Series], _: Sequence[np.ndarray]) -> np.ndarray:
    return opencv(cv2.createCalibrateRobertson(max_iter=60), series[0])


def opencv(calibration: cv2.CalibrateCRF, series: Series) -> np.ndarray:
    """(256, c); OpenCV takes three channels at a time."""
    times = np.array(series.exposures, np.float32)
    height, width, channels = series.codes[0].shape
    step = max(1, round(np.sqrt(height * width / OPENCV_PIXELS)))
    columns = []
    for first in range(0, channels, 3):
        three = np.minimum(np.arange(first, first + 3), channels - 1)
        photos = [np.ascontiguousarray(codes[::step, ::step, three]) for codes in series.codes]
        columns.append(calibration.process(photos, times).reshape(CODES, 3))
    return np.hstack(columns)[:, :channels].astype(float)


def normalised(table: np.ndarray) -> np.ndarray | None:
    """Rising, 0 at code 0 and 1 at 255, the ends that no pixel tells extended; None if it falls too much."""
    codes = np.arange(CODES, dtype=float)
    columns = []
    for curve in table.T:
        if not np.isfinite(curve).all() or not (curve[LOW : HIGH + 1] > 0).all():
            return None
        rising = np.maximum.accumulate(curve[LOW : HIGH + 1])
        if np.max(rising - curve[LOW : HIGH + 1]) > BACKWARD * rising[-1]:
            return None
        # below, in proportion to the code as every encoding ends; above, by the power law of the last codes
        power = np.log(rising[-1] / rising[-31]) / np.log(HIGH / (HIGH - 30))
        low, high = codes[:LOW] / LOW * rising[0], rising[-1] * (codes[HIGH + 1 :] / HIGH) ** power
        whole = np.concatenate([low, rising, high])
        columns.append(whole / whole[-1])
    return np.column_stack(columns)


def reciprocity_error(table: np.ndarray, entries: Sequence[np.ndarray]) -> float:
    """Rms over the comparagram of the relative error of the brighter photo's signal predicted from the
    darker's.

    Entries weigh as the darker photo's code: one code's worth of error is more where codes are low.
    """
    codes, squares, weights = np.arange(CODES), 0.0, 0.0
    for curve, entry in zip(table.T, entries, strict=True):
        bright = np.log(np.interp(entry[:, 1], codes, curve))
        dark = np.log(np.maximum(np.interp(entry[:, 0], codes, curve), 1e-12))
        squares += float((entry[:, 0] * (bright - dark - entry[:, 2]) ** 2).sum())
        weights += float(entry[:, 0].sum())
    return float(np.sqrt(squares / weights))
