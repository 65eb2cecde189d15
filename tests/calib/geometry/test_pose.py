"""The board's pose by its corners, and how sure it is."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.geometry.board import Corners, board_points
from photogonio.calib.geometry.camera import Pose
from photogonio.calib.geometry.pose import fit_pose, joined, pose_covariance
from tests.drawn.board_photos import POSES
from tests.drawn.boards import BOARD, CAMERA


def test_the_pose_is_found_again_within_its_error(closer):
    for one, pose in zip(closer, POSES, strict=True):
        fit = fit_pose(CAMERA, one.corners)
        assert fit is not None and fit.pose.center[2] > 0
        np.testing.assert_allclose(fit.pose.center, pose.center, atol=0.002 * np.linalg.norm(pose.center))


def corners(pose: Pose, noise: float = 0.0, seed: int = 0) -> Corners:
    points = board_points(BOARD)
    pixels = CAMERA.project(pose, points)
    pixels = pixels + noise * np.random.default_rng(seed).normal(size=pixels.shape)
    ids = np.arange(len(points))
    return Corners(ids, points, pixels, np.full(len(ids), 0.1), np.zeros(0, int), np.zeros((0, 4, 2)))


@pytest.mark.parametrize("pose", POSES)
def test_true_corners_give_the_true_pose_and_never_the_one_behind_the_board(pose):
    fit = fit_pose(CAMERA, corners(pose))
    np.testing.assert_allclose(
        fit.pose.center, pose.center, atol=1e-3
    )  # OpenCV undistorts to 1e-6 of a radian
    assert fit.inlier.all() and fit.rms < 1e-3 and fit.pose.center[2] > 0


def test_corners_that_are_elsewhere_do_not_count():
    seen = corners(POSES[1], 0.05)
    pixels = seen.pixels.copy()
    pixels[[3, 17]] += [6.0, -4.0]
    fit = fit_pose(CAMERA, replace(seen, pixels=pixels))
    assert np.flatnonzero(~fit.inlier).tolist() == [3, 17] and fit.rms < 0.1
    few = seen.keep(seen.ids < 5)
    assert fit_pose(CAMERA, few) is None and fit_pose(CAMERA, seen.keep(seen.ids < 0)) is None


def test_the_covariance_is_that_of_many_trials():
    """Sixty fits tell a standard deviation to 9 %."""
    pose = POSES[2]
    found = np.array([fit_pose(CAMERA, corners(pose, 0.1, k)).pose.translation for k in range(60)])
    stated = pose_covariance(CAMERA, pose, board_points(BOARD), 0.1)[3:, 3:]
    ratio = np.sqrt(np.linalg.eigvalsh(np.linalg.solve(stated, np.cov(found.T)) + 0).real)
    assert (np.abs(ratio - 1) < 0.4).all()


def test_corners_of_many_photos_are_joined_to_their_middles():
    """A corner that one photo shows elsewhere, or not at all, is where most show it."""
    photos = [corners(POSES[0], 0.02, k) for k in range(5)]
    pixels = photos[3].pixels.copy()
    pixels[7] += 30.0
    photos[3] = replace(photos[3], pixels=pixels)
    photos[1] = photos[1].keep(photos[1].ids != 4)
    whole = joined(photos)
    np.testing.assert_array_equal(whole.ids, photos[0].ids)
    np.testing.assert_array_equal(whole.points, photos[0].points)
    assert np.abs(whole.pixels - CAMERA.project(POSES[0], whole.points)).max() < 0.06
    assert (whole.sigma == 0.1).all()
