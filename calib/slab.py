"""Paper beside a thick flat sample, which throws a shadow that shading knows nothing of, and light of its sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from calib.board import board_size
from calib.lamps import block_name, place_in_world
from calib.occlusion import direct
from calib.shading import Reading
from calib.sight import Sight
from calib.together import Settled
from capture.photoset import Board, Plane, Sphere

THICK = 1 / 40  # of the board's larger side: a thinner sample's shadow is a line beside its edge
BESIDE = 0.4  # heights around the shadow and the sample that the lamp's width blurs, and where it may be off
MOST = 0.15  # of the direct light: paper that white sides would light up so much is not read
ALBEDO, ALBEDO_SPREAD = 0.35, 0.25  # of the sides: anything
FEWEST = 400  # samples of paper that must be left
ALONG, UP = 24, 4  # pieces of a side


def is_thick(board: Board | None, sample: Sphere | Plane) -> bool:
    """Whether a flat sample stands so high on the board that its shadow matters."""
    if board is None or not isinstance(sample, Plane):
        return False
    return sample.height > THICK * float(board_size(board).max())


def clear_of_slab(sample: Plane, settled: Settled, sights: Sequence[Sight]) -> None:
    """Take the sample's shadow and the light of its sides out of the sights' paper, with the lamps where they
    settled."""
    for sight in sights:
        lamp = settled.lamps.get(sight.light)
        if sight.reading is None or lamp is None or lamp.kind != "point":
            continue
        place = place_in_world(lamp, settled.values[block_name(lamp.name)], sight.pose)
        if place[2] <= sample.height:
            continue
        points = sight.reading.samples.points
        thrown = side_light(points, place, sample) / direct(points, place)
        clear = ~shaded(points, place, sample) & (thrown < MOST)
        if clear.sum() >= FEWEST:
            sight.reading = _cleared(sight.reading, clear, thrown)


def shaded(points: np.ndarray, lamp: np.ndarray, sample: Plane) -> np.ndarray:
    """(n,) bool: points (n, 3) of the board in the shadow that ``sample``'s prism throws, or close to either."""
    outline = np.asarray(sample.outline, float)
    reach = lamp[2] / (lamp[2] - sample.height)
    thrown = lamp[:2] + reach * (outline - lamp[:2])
    hull = cv2.convexHull(np.vstack([outline, thrown]).astype(np.float32))
    near = [cv2.pointPolygonTest(hull, (float(x), float(y)), True) for x, y in points[:, :2]]
    return np.array(near) > -BESIDE * sample.height


def side_light(points: np.ndarray, lamp: np.ndarray, sample: Plane) -> np.ndarray:
    """Irradiance (n,) of the board at ``points`` (n, 3) by the prism's sides, white and diffuse, that a lamp of unit
    strength lights."""
    outline, total = np.asarray(sample.outline, float), np.zeros(len(points))
    middle = outline.mean(0)
    height = (np.arange(UP) + 0.5) / UP * sample.height
    share = ((np.arange(ALONG) + 0.5) / ALONG)[:, None]
    for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        along = end - start
        normal = np.array([along[1], -along[0]]) / np.hypot(*along)
        normal *= np.sign(normal @ (start - middle))
        for z in height:
            pieces = np.column_stack([start + share * along, np.full(ALONG, z)])
            offset = lamp - pieces
            sent = np.maximum(offset[:, :2] @ normal, 0.0) / np.linalg.norm(offset, axis=1) ** 3
            way = points[:, None, :] - pieces
            facing = np.maximum(way[..., :2] @ normal, 0.0) * z / np.sum(way**2, axis=-1) ** 2
            total += facing @ sent * (np.hypot(*along) / ALONG) * (sample.height / UP) / np.pi
    return total


def _cleared(reading: Reading, keep: np.ndarray, thrown: np.ndarray) -> Reading:
    """Samples to ``keep``, less what sides of middling albedo throw on them, and that much less sure."""
    thrown = thrown[keep]
    level = reading.level[keep] / (1.0 + ALBEDO * thrown)
    samples = reading.samples.keep(keep)
    samples = replace(samples, value=samples.value / (1.0 + ALBEDO * thrown)[:, None])
    noise = reading.noise[keep] + (ALBEDO_SPREAD * thrown * level) ** 2
    return replace(reading, samples=samples, level=level, noise=noise)
