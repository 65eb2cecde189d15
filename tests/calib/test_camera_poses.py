"""Where the camera stood in each photo: photos and boards that do not fit are named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.detect.observation import FIXED_POSE
from photogonio.capture.errors import InputError
from tests.drawn.calibrations import Drawn


def test_too_few_corners():
    drawn = Drawn(8)
    drawn.samples[1] = drawn.samples[1].keep(np.arange(len(drawn.samples[1])) < 4)
    drawn.camera()
    assert [o.name for o in drawn.remarks.left_out] == ["s1"]
    assert "board corners agree" in drawn.remarks.left_out[0].reason


def test_a_still_camera_that_moved():
    drawn = Drawn(9, fixed=True)
    assert drawn.world.views[0] is drawn.world.views[1]
    drawn.samples[4] = replace(drawn.samples[4], pixels=drawn.samples[4].pixels + np.array([5.0, 0]))
    state = drawn.camera()
    camera, observations = state.camera, state.observations
    assert drawn.said("s4: the board is 5.0 px off")
    moved = [s.view.name for s in observations if s.pose_block != FIXED_POSE]
    assert moved == ["s4"]
    corners = observations[4].corners
    assert corners is not None
    shift = camera.project(observations[4].pose, corners.points) - camera.project(
        observations[0].pose, corners.points
    )
    # both poses are fitted to two dozen corners or more, drawn to tenths of a pixel
    np.testing.assert_allclose(shift.mean(0), [5.0, 0.0], atol=0.3)


def test_a_board_whose_corners_miss_by_many_pixels_is_refused_by_name():
    """Corners of each of its squares exchanged two by two, as no lens has them: nothing of it may be believed."""
    drawn = Drawn(3)
    for photos in (drawn.boards, drawn.samples):
        for k, corners in enumerate(photos):
            points = corners.points.copy()
            points[:, 0] += 6.0 * np.sin(points[:, 1] / 9.0)
            photos[k] = replace(corners, points=points)
    with pytest.raises(InputError, match=r"\[board\]: its corners miss their places by .* px"):
        drawn.camera()


def test_corners_are_as_sure_as_the_worse_axis_of_the_picture_shows():
    """Where the print lies along the rows of pixels, which cut all edges along them alike, corners err several times as
    much across as along: by the middle of both a pose would be stated several times too sure."""
    rng, along, across = np.random.default_rng(7), 0.02, 0.3
    drawn = Drawn(8)
    for photos in (drawn.boards, drawn.samples):
        for k, corners in enumerate(photos):
            off = rng.normal(size=corners.pixels.shape) * [along, across]
            photos[k] = replace(corners, pixels=corners.pixels + off, sigma=np.full(len(corners), 0.01))
    state = drawn.camera()
    stated = np.concatenate([c.sigma for _, c, _ in state.boards])
    np.testing.assert_allclose(stated, across, rtol=0.25)  # some hundred corners, drawn with their own errors
