"""What photos say beside what was expected, and what is expected of values by name."""

import numpy as np

from photogonio.calib.rig.gaussian import NOTHING, RigExpected, RigPrior, told_beside


def test_what_photos_alone_say_is_found_beside_what_was_expected():
    rng = np.random.default_rng(8)
    root = rng.normal(size=(3, 3))
    data, alone = root @ root.T, rng.normal(size=3)
    mean, prior = rng.normal(size=3), np.diag([4.0, 0.0, 1e4])
    covariance = np.linalg.inv(data + prior)
    value = covariance @ (data @ alone + prior @ mean)
    told = told_beside("a", value, covariance, mean, prior)
    assert np.allclose(told.information, data, atol=1e-6 * 1e4)
    assert np.allclose(told.information @ told.value, data @ alone, atol=1e-4)


def test_what_no_photo_tells_has_no_information():
    mean, prior = np.zeros(2), np.diag([4.0, 9.0])
    covariance = np.linalg.inv(prior + np.diag([1.0, 0.0]))
    told = told_beside("a", covariance @ np.array([3.0, 0.0]), covariance, mean, prior)
    assert np.allclose(told.information, np.diag([1.0, 0.0]), atol=1e-8)
    assert np.allclose(told.value[0], 3.0)


def test_off_by_its_error_is_one_standard_error():
    covariance = np.array([[4.0, 1.0], [1.0, 2.0]])
    off = np.linalg.cholesky(covariance) @ np.array([0.6, 0.8])
    expected = RigExpected("camera 0", np.zeros(2), covariance, 5)
    assert np.isclose(np.linalg.norm(expected.root @ off), 1.0)


def test_values_are_found_by_name_and_by_their_first_word():
    one = RigExpected("camera 0 1", np.zeros(6), np.eye(6), 4)
    prior = RigPrior((one,))
    assert prior.get("camera 0 1") is one and prior.get("camera") is None
    assert prior.starting("camera") is one and prior.starting("cam") is None
    assert NOTHING.get("camera 0 1") is None
