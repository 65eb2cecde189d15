"""One photo's board, ball and lamps as blocks of values, and what derivatives of terms are checked by."""

import numpy as np

from photogonio.calib.adjust.bundle import Term
from photogonio.calib.adjust.camera_model import CameraModel, pose_block
from photogonio.calib.adjust.sightings import Sighting
from photogonio.calib.geometry.board import Corners
from photogonio.calib.geometry.mirror import mirrored_point
from tests.drawn.boards import CAMERA, SIZE, looking_at

MODEL = CameraModel(SIZE, CAMERA.distortion, (0, 1, 2, 3), 5e-4, 5.0, ((1, 0.1), (2, 5e-4)))
TARGET = np.array([48.0, 36, 0])
POSE = looking_at(np.array([60.0, -70, 160]), TARGET, 0.3)
BALL = np.array([30.0, 50, 9, 9.0])
VALUES = {
    "camera": MODEL.block(CAMERA),
    "pose": pose_block(POSE),
    "ball": BALL,
    "lamp": np.array([150.0, 90, 300]),
    "flash": np.array([30.0, -40, 5]),
    "far": np.array([0.3, -0.5, 0.8]),
    "limb offset": np.array([0.1]),
}
POINTS = np.array([[12.0 * x, 12.0 * y, 0] for x in range(1, 8) for y in range(1, 6)])


def seen_corners(sigma: float = 0.1) -> Corners:
    pixels = CAMERA.project(POSE, POINTS)
    ids = np.arange(len(POINTS))
    return Corners(ids, POINTS, pixels, np.full(len(ids), sigma), np.zeros(0, int), np.zeros((0, 4, 2)))


def sighting(light: str) -> Sighting:
    place = VALUES[light] if light != "flash" else POSE.inverse().apply(VALUES[light])
    place = 1e9 * place if light == "far" else place
    pixel = CAMERA.project(POSE, mirrored_point(BALL[:3], BALL[3], POSE.center, place)[None])[0]
    return Sighting("pose", light, "ball", light == "far", light == "flash", pixel + 0.3, 0.2)


STEPS = {
    "camera": np.r_[np.full(4, 0.02), np.full(4, 1e-4)],
    "pose": np.r_[np.full(3, 1e-5), np.full(3, 1e-3)],
}


def assert_slopes(term: Term) -> None:
    """All of them: a slope left out makes the adjustment stop short, and its errors look small."""
    base, stated = term(VALUES)
    for block, value in VALUES.items():
        steps = STEPS.get(block, np.full(len(value), 1e-3 if block != "far" else 1e-5))
        for k, step in enumerate(steps):
            ahead, behind = dict(VALUES), dict(VALUES)
            ahead[block], behind[block] = value.copy(), value.copy()
            ahead[block][k] += step
            behind[block][k] -= step
            slope = (term(ahead)[0] - term(behind)[0]) / (2 * step)
            claimed = stated[block][:, k] if block in stated else np.zeros(len(base))
            scale = np.abs(slope).max() + 1e-6
            # central differences of this width are right to about 1e-4 of the largest slope
            np.testing.assert_allclose(claimed, slope, atol=1e-3 * scale, err_msg=f"{block}[{k}]")
