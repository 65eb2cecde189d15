"""Drawn photos of the board, what is found in them, and by how much that misses."""

import numpy as np

from photogonio.calib.geometry.board import board_size
from tests.drawn.boards import BOARD, CAMERA, looking_at

NOISE = 0.004
MIDDLE = np.append(board_size(BOARD) / 2, 0.0)
OFFSETS = ((5, 3, 185), (90, 20, 160), (-75, 40, 165), (20, 95, 160), (-15, -90, 165), (60, -60, 170))
POSES = [looking_at(MIDDLE + np.array(o, float), MIDDLE, 0.3 * k - 0.7) for k, o in enumerate(OFFSETS)]


def misses(seen) -> np.ndarray:
    """Found less true pixel of every corner of all photos, (n, 2)."""
    pairs = zip(seen, POSES, strict=True)
    return np.concatenate([s.corners.pixels - CAMERA.project(p, s.corners.points) for s, p in pairs])
