"""How sharp a photo is: the width of the edges of its markers, which are steps from white to black."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

ALONG = (0.3, 0.5, 0.7)  # of a marker's side: where its edge is crossed, clear of the corners
CELLS = 7.0  # of the smallest usual markers, on a side: black border and white cells
REACH = 0.8  # of a cell, that a profile goes either way
FARTHEST = 24.0  # pixels
STEP = 0.25
LOW, HALF, HIGH = (
    0.2,
    0.5,
    0.8,
)  # levels: the rise is measured between the outer ones, the edge is at the middle one
TO_TENTHS = 1.523  # times that: from a tenth to nine tenths, of a blur that is a normal distribution
CONTRAST = 0.3  # of the bright end: less is no edge of print
FEWEST = 8
UNLIKE = 1.6  # widths across and down that differ by more are no matter of focus


@dataclass(frozen=True, slots=True)
class Sharpness:
    """Widths of edges from a tenth to nine tenths of their step, pixels."""

    width: float  # median of all
    across: float  # of edges that go up and down in the picture; NaN: too few
    down: float

    @property
    def smeared(self) -> bool:
        """Whether the photo is blurred one way much more than the other: a hand that moved."""
        low, high = sorted((self.across, self.down))
        return bool(np.isfinite(high) and high > UNLIKE * low and high > 3.0)


def sharpness(level: np.ndarray, quads: np.ndarray) -> Sharpness | None:
    """Of gray (h, w), linear in light, with markers whose corners are ``quads`` (m, 4, 2); None if too few edges can be
    read."""
    if not len(quads):
        return None
    places, normal, reach = _crossed(quads)
    width, _ = _rises(level, places, normal, reach)
    good = np.isfinite(width)
    if good.sum() < FEWEST:
        return None
    level_edges = np.abs(normal[:, 1]) > np.abs(normal[:, 0])
    parts = [width[good & mask] for mask in (~level_edges, level_edges)]
    across, down = (float(np.median(part)) if len(part) >= FEWEST else float("nan") for part in parts)
    return Sharpness(float(np.median(width[good])), across, down)


def placed_quads(level: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """(m, 4, 2) the markers' corners where the lines of their edges meet, at half the step of ``level`` (linear in
    light), which blur leaves where it is; corners alone come out inside. A side without a clear edge stays."""
    if not len(quads):
        return quads
    places, normal, reach = _crossed(quads)
    _, off = _rises(level, places, normal, reach)
    shape = (*quads.shape[:2], len(ALONG))
    off, normal = off.reshape(shape), normal.reshape(*shape, 2)[:, :, 0]
    clear = np.isfinite(off).all(axis=2)
    move = np.where(clear, np.median(np.where(clear[..., None], off, 0.0), axis=2), 0.0)
    start = quads + move[..., None] * normal  # a point of each side's line
    along = np.roll(quads, -1, axis=1) - quads
    before, ahead = np.roll(start, 1, axis=1), np.roll(along, 1, axis=1)
    gap = start - before
    cross = ahead[..., 0] * along[..., 1] - ahead[..., 1] * along[..., 0]
    share = (gap[..., 0] * along[..., 1] - gap[..., 1] * along[..., 0]) / np.where(cross == 0, np.nan, cross)
    met = before + share[..., None] * ahead
    good = np.isfinite(met) & (np.abs(met - quads) < 2 * reach)
    return np.where(good.all(axis=2, keepdims=True), met, quads)


def _crossed(quads: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """(n, 2) where the edges of ``quads`` (m, 4, 2) are crossed, (n, 2) outward normals there, and how far, pixels."""
    ends = np.roll(quads, -1, axis=1)
    side = np.linalg.norm(ends - quads, axis=2)
    middle = quads.mean(axis=1)
    share = np.array(ALONG)[:, None]
    places = quads[:, :, None] + share * (ends - quads)[:, :, None]  # (m, 4, a, 2)
    normal = np.stack([ends[..., 1] - quads[..., 1], quads[..., 0] - ends[..., 0]], axis=2)
    normal /= np.maximum(side, 1e-9)[..., None]
    outward = np.sign(np.einsum("mki,mki->mk", (quads + ends) / 2 - middle[:, None], normal))
    normal = (normal * outward[..., None])[:, :, None].repeat(len(ALONG), axis=2).reshape(-1, 2)
    reach = float(np.clip(REACH * np.median(side) / CELLS, 3.0, FARTHEST))
    return places.reshape(-1, 2), normal, reach


def _rises(
    level: np.ndarray, places: np.ndarray, normals: np.ndarray, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """(n,) widths of edges at ``places`` (n, 2), bright on the side of ``normals``, and how far along these each has
    its half level; NaN where there is none."""
    along = np.arange(-reach, reach + STEP / 2, STEP)
    at = (places[:, None] + along[:, None] * normals[:, None]).astype(np.float32)
    profile = cv2.remap(
        np.ascontiguousarray(level, np.float32), at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderValue=np.nan
    )
    tail = max(2, len(along) // 8)
    dark, bright = profile[:, :tail].mean(axis=1), profile[:, -tail:].mean(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = (profile - dark[:, None]) / (bright - dark)[:, None]
    edge = bright - dark > CONTRAST * np.abs(bright)
    rows = np.arange(len(share))
    crossings = []
    for limit in (LOW, HALF, HIGH):
        k = np.maximum(np.argmax(share > limit, axis=1), 1)
        before, after = share[rows, k - 1], share[rows, k]
        with np.errstate(invalid="ignore", divide="ignore"):
            crossings.append(along[k] - STEP * (after - limit) / (after - before))
    with np.errstate(invalid="ignore"):
        width = TO_TENTHS * (crossings[2] - crossings[0])
    good = edge & np.isfinite(width) & (width > 0)
    return np.where(good, width, np.nan), np.where(good, crossings[1], np.nan)
