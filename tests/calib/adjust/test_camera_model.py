"""A camera and a pose as blocks of values come back as they were, and project as OpenCV does."""

import numpy as np

from photogonio.calib.adjust.camera_model import block_pose, camera_term, pose_block, project
from tests.drawn.adjustments import MODEL, POSE, VALUES, assert_slopes, seen_corners
from tests.drawn.boards import CAMERA


def test_blocks_come_back():
    camera = MODEL.camera(MODEL.block(CAMERA))
    np.testing.assert_array_equal(camera.matrix, CAMERA.matrix)
    np.testing.assert_array_equal(camera.distortion, CAMERA.distortion)
    pose = block_pose(pose_block(POSE))
    np.testing.assert_allclose(pose.rotation, POSE.rotation, atol=1e-12)
    np.testing.assert_array_equal(pose.translation, POSE.translation)


def test_derivatives_are_those_of_differences():
    assert_slopes(camera_term(MODEL))


def test_what_is_expected_of_a_camera_is_told_in_standard_errors():
    """Pixels a thousandth from square where 5e-4 are expected, and an axis 2 pixels aside where 5 are."""
    block = VALUES["camera"].copy()
    middle = (np.array(MODEL.size) - 1) / 2
    block[:4] = [500.0, 500.5, middle[0] + 2, middle[1]]
    residual, _ = camera_term(MODEL)({"camera": block})
    np.testing.assert_allclose(residual[:3], [2.0, 0.4, 0.0], atol=1e-9)


def test_projected_points_move_with_their_places():
    points, step = seen_corners().points, 1e-4
    pixels, _, _, by_point = project(MODEL, VALUES["camera"], VALUES["pose"], points)
    np.testing.assert_allclose(pixels, CAMERA.project(POSE, points), atol=1e-9)
    for k, move in enumerate(step * np.eye(3)):
        there = project(MODEL, VALUES["camera"], VALUES["pose"], points + move)[0]
        np.testing.assert_allclose(by_point[:, :, k], (there - pixels) / step, atol=1e-3)
