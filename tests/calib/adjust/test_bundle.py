"""The adjustment: every term's derivatives against differences, a perfect world found again, errors that hold."""

import numpy as np
import pytest

from photogonio.calib.adjust.bundle import (
    CameraModel,
    Part,
    Sighting,
    adjust,
    camera_term,
    corner_term,
    highlight_term,
    limb_term,
    pose_block,
    prior_term,
    quadratic_term,
)
from photogonio.calib.geometry.board import Corners
from photogonio.calib.geometry.cones import outline
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


def terms() -> dict:
    turn = POSE.inverse()
    parts = [Part("flash", slice(0, 3), turn.rotation, turn.translation), Part("ball", slice(0, 4))]
    at = np.concatenate([part.value(VALUES) for part in parts]) + 0.2
    root = np.random.default_rng(3).normal(size=(9, 7))
    limb = outline(CAMERA, POSE, BALL[:3], BALL[3], 24) + 0.4
    return {
        "camera": camera_term(MODEL),
        "corners": corner_term(MODEL, "pose", seen_corners()),
        "highlights": highlight_term(MODEL, [sighting("lamp")]),
        "flash": highlight_term(MODEL, [sighting("flash")]),
        "distant": highlight_term(MODEL, [sighting("far")]),
        "limb": limb_term(MODEL, "pose", "ball", limb, np.full(24, 0.5)),
        "quadratic": quadratic_term(parts, at, root.T @ root, root.T @ np.ones(9)),
        "prior": prior_term("lamp", np.zeros(3), np.array([1.0, 2, 3])),
    }


STEPS = {
    "camera": np.r_[np.full(4, 0.02), np.full(4, 1e-4)],
    "pose": np.r_[np.full(3, 1e-5), np.full(3, 1e-3)],
}


@pytest.mark.parametrize("name", terms())
def test_derivatives_are_those_of_differences(name):
    """All of them: a slope left out makes the adjustment stop short, and its errors look small."""
    term = terms()[name]
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


def test_a_perfect_world_is_found_again():
    rng = np.random.default_rng(5)
    start = {n: v.copy() for n, v in VALUES.items()}
    start["pose"] += np.r_[1e-3 * rng.normal(size=3), 0.1 * rng.normal(size=3)]  # a pixel, ten errors
    start["ball"] += [0.3, -0.2, 0.1, 0.05]
    start["limb offset"] = np.zeros(1)
    limb = outline(CAMERA, POSE, BALL[:3], BALL[3], 48)
    used = [
        (corner_term(MODEL, "pose", seen_corners()), True),
        (limb_term(MODEL, "pose", "ball", limb, np.full(48, 0.5)), True),
        (prior_term("limb offset", np.zeros(1), np.array([0.01])), False),
        (prior_term("ball", BALL, np.full(4, 1.0)), False),  # one photo does not tell a ball's distance
    ]
    found = adjust(start, used, frozenset({"camera", "lamp", "flash", "far"}))
    np.testing.assert_allclose(found.values["pose"], VALUES["pose"], atol=1e-5)
    np.testing.assert_allclose(found.values["ball"], BALL, atol=1e-3)
    assert found.cost < 1e-4


def test_the_limb_moves_the_camera_no_farther_than_corners_allow():
    """Corners, limb and expectations that contradict one another settle where their slopes cancel."""
    limb = outline(CAMERA, POSE, BALL[:3], BALL[3], 48) + np.array([2.0, 0])
    used = [
        (corner_term(MODEL, "pose", seen_corners(0.05)), True),
        (limb_term(MODEL, "pose", "ball", limb, np.full(48, 0.3)), True),
        (camera_term(MODEL), False),
        (prior_term("ball", BALL, np.full(4, 0.05)), False),
        (prior_term("limb offset", np.zeros(1), np.array([0.1])), False),
    ]
    held = frozenset({"lamp", "flash", "far"})
    first = adjust(VALUES, used, held)
    away = VALUES | {"camera": VALUES["camera"] + np.r_[2.0, -2, 1.5, -1, 3e-3, -3e-3, 1e-4, 1e-4]}
    second = adjust(away, used, held)
    assert second.cost == pytest.approx(first.cost, rel=1e-4)
    error = np.sqrt(np.diag(first.covariance["camera"]))
    assert (np.abs(second.values["camera"] - first.values["camera"]) < 0.05 * error).all()


def test_stated_errors_are_those_of_many_trials():
    rng = np.random.default_rng(8)
    stated, found = [], []
    truth = corner_term(MODEL, "pose", seen_corners())
    assert np.abs(truth(VALUES)[0]).max() < 1e-6
    for _ in range(60):
        clean = seen_corners()
        noisy = clean.pixels + clean.sigma[:, None] * rng.normal(size=clean.pixels.shape)
        corners = Corners(clean.ids, clean.points, noisy, clean.sigma, clean.marker_ids, clean.marker_pixels)
        term = corner_term(MODEL, "pose", corners)
        done = adjust({n: VALUES[n] for n in ("camera", "pose")}, [(term, False)], frozenset({"camera"}))
        found.append(done.values["pose"] - VALUES["pose"])
        stated.append(np.diag(done.covariance["pose"]))
    ratio = np.mean(np.square(found), axis=0) / np.mean(stated, axis=0)
    # a mean of 60 squares scatters by sqrt(2 / 60) = 0.18: four times that
    assert (np.abs(ratio - 1) < 0.75).all(), ratio
