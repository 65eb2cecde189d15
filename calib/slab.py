"""Paper beside a thick flat sample, which throws a shadow that shading knows nothing of, and light of its sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from calib.board import board_size
from calib.lamps import block_name, place_in_world
from calib.shading import Reading
from calib.sight import Sight
from calib.together import Settled
from capture.photoset import Board, Plane, Sphere

THICK = 1 / 40  # of the board's larger side: a thinner sample's shadow is a line beside its edge
BESIDE = (
    1.0  # heights around the shadow and the sample that its sides throw light on, and the lamp's width blurs
)
FEWEST = 400  # samples of paper that must be left


def is_thick(board: Board | None, sample: Sphere | Plane) -> bool:
    """Whether a flat sample stands so high on the board that its shadow matters."""
    if board is None or not isinstance(sample, Plane):
        return False
    return sample.height > THICK * float(board_size(board).max())


def clear_of_shadows(sample: Plane, settled: Settled, sights: Sequence[Sight]) -> None:
    """Leave out of the sights' paper what lies in the sample's shadow, with the lamps where they settled."""
    for sight in sights:
        lamp = settled.lamps.get(sight.light)
        if sight.reading is None or lamp is None:
            continue
        place = place_in_world(lamp, settled.values[block_name(lamp.name)], sight.pose)
        toward = place if lamp.kind == "point" else place / np.linalg.norm(place) * 1e6 * sample.height
        if toward[2] <= sample.height:
            continue
        clear = ~shaded(sight.reading.samples.points, toward, sample)
        if clear.sum() >= FEWEST:
            sight.reading = _kept(sight.reading, clear)


def shaded(points: np.ndarray, lamp: np.ndarray, sample: Plane) -> np.ndarray:
    """(n,) bool: points (n, 3) of the board in the shadow that ``sample``'s prism throws, or close to either."""
    outline = np.asarray(sample.outline, float)
    reach = lamp[2] / (lamp[2] - sample.height)
    thrown = lamp[:2] + reach * (outline - lamp[:2])
    hull = cv2.convexHull(np.vstack([outline, thrown]).astype(np.float32))
    near = [cv2.pointPolygonTest(hull, (float(x), float(y)), True) for x, y in points[:, :2]]
    return np.array(near) > -BESIDE * sample.height


def _kept(reading: Reading, keep: np.ndarray) -> Reading:
    return replace(
        reading,
        samples=reading.samples.keep(keep),
        level=reading.level[keep],
        noise=reading.noise[keep],
    )
