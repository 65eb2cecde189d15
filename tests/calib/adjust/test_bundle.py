"""The adjustment: a perfect world found again, errors that hold, terms whose derivatives are their differences."""

import numpy as np
import pytest

from photogonio.calib.adjust.bundle import Part, adjust, prior_term, quadratic_term
from photogonio.calib.adjust.camera_model import camera_term
from photogonio.calib.adjust.sightings import corner_term, limb_term
from photogonio.calib.geometry.board import Corners
from photogonio.calib.geometry.cones import outline
from tests.drawn.adjustments import BALL, MODEL, POSE, VALUES, assert_slopes, seen_corners
from tests.drawn.boards import CAMERA


def terms() -> dict:
    turn = POSE.inverse()
    parts = [Part("flash", slice(0, 3), turn.rotation, turn.translation), Part("ball", slice(0, 4))]
    at = np.concatenate([part.value(VALUES) for part in parts]) + 0.2
    root = np.random.default_rng(3).normal(size=(9, 7))
    return {
        "quadratic": quadratic_term(parts, at, root.T @ root, root.T @ np.ones(9)),
        "prior": prior_term("lamp", np.zeros(3), np.array([1.0, 2, 3])),
    }


@pytest.mark.parametrize("name", terms())
def test_derivatives_are_those_of_differences(name):
    assert_slopes(terms()[name])


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
