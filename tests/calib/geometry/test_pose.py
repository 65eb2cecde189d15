"""The board's pose by its corners, and how sure it is."""

import numpy as np

from photogonio.calib.geometry.pose import fit_pose
from tests.drawn.board_photos import POSES
from tests.drawn.boards import CAMERA


def test_the_pose_is_found_again_within_its_error(closer):
    for one, pose in zip(closer, POSES, strict=True):
        fit = fit_pose(CAMERA, one.corners)
        assert fit is not None and fit.pose.center[2] > 0
        np.testing.assert_allclose(fit.pose.center, pose.center, atol=0.002 * np.linalg.norm(pose.center))
