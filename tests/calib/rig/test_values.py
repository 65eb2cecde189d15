"""Values of a rig: their names, how they may change, and what becomes of them when some are held."""

import numpy as np
import pytest

from photogonio.calib.adjust.camera_model import CameraModel, camera_term
from photogonio.calib.adjust.rig_values import model_of_rig
from photogonio.calib.rig.gaussian import RigExpected
from photogonio.calib.rig.values import WORDS, camera_name, camera_terms, changes_of, held, kind_of, steady

CAMERA = np.array([1000.0, 1001.0, 400.0, 300.0, -0.1, 0.02, 1e-4, -2e-4])
VALUES = {
    "camera 0 1 2 3": CAMERA,
    "lamp": np.array([2.0, -3.0, 0.0, 0.01, 0.0]),
    "ball 0": np.array([2.1]),
    "light L000": np.array([100.0, 200.0, 300.0]),
    "paper": np.log([0.8, 0.8, 0.75]),
}


@pytest.mark.parametrize("name", VALUES)
def test_every_value_of_a_rig_may_change(name):
    directions = np.hstack(changes_of(name, VALUES[name]))
    assert kind_of(name) in WORDS
    assert np.linalg.matrix_rank(directions / np.abs(directions).max(1, keepdims=True)) == len(VALUES[name])


def test_a_name_of_a_camera_says_its_terms():
    assert camera_terms(camera_name((0, 1, 4))) == (0, 1, 4) and camera_terms(camera_name(())) == ()


def test_a_camera_that_is_expected_is_found_there_without_a_photo():
    root = np.diag([1.0, 1.0, 2.0, 2.0, 0.01, 0.01, 1e-4, 1e-4])
    covariance = root @ (np.eye(8) + 0.3) @ root
    camera, model = model_of_rig(RigExpected("camera 0 1 2 3", CAMERA, covariance, 9), (800, 600))
    assert isinstance(model, CameraModel) and np.allclose(model.block(camera), CAMERA)
    residual, slopes = camera_term(model)({"camera": CAMERA})
    assert np.allclose(residual, 0.0)
    # the term's information is that of what is expected
    assert np.allclose(slopes["camera"].T @ slopes["camera"] @ covariance, np.eye(8), atol=1e-6)


def test_what_is_held_tells_what_goes_with_it():
    covariance = np.array([[4.0, 1.8], [1.8, 1.0]])
    one = held(RigExpected("lamp", np.array([3.0, 1.0]), covariance, 5), [1], 1e-6)
    # of two normal values: mean - cov / var * off, var - cov^2 / var
    assert np.allclose(one.value, [3.0 - 1.8, 0.0], atol=1e-6)
    assert np.allclose(one.covariance, [[4.0 - 1.8**2, 0.0], [0.0, 0.0]], atol=1e-6)


def test_lamps_that_are_carried_by_hand_have_no_place():
    place = VALUES["light L000"]
    assert steady("light L000", place, np.eye(3) * 2.0**2)
    assert not steady("light L000", place, np.eye(3) * 60.0**2)
    assert steady("paper", VALUES["paper"], np.eye(3))
