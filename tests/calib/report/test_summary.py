"""What a calibration found, in numbers and for the eye."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.adjust.camera_model import CameraModel
from photogonio.calib.detect.highlights import Highlight
from photogonio.calib.detect.limb import Limb
from photogonio.calib.geometry.camera import Pose
from photogonio.calib.geometry.mirror import mirrored_point
from photogonio.calib.report.summary import account, corner_error, marks
from tests.drawn.calibrations import Drawn, at_rest
from tests.drawn.setups import SIZE


def test_a_good_set_is_not_complained_of():
    drawn = Drawn(3)
    drawn.settled()
    # the drawn photos of the board do leave the pictures' corners empty
    assert set(drawn.remarks.codes()) <= {"corners-in-middle"}
    assert drawn.remarks.left_out == []


def test_the_error_in_the_pictures_corner_is_that_of_many_cameras(drawn):
    """Cameras drawn about the settled one, each projecting what that one sees in the corner."""
    world, readings = drawn
    model = CameraModel(SIZE, world.camera.distortion, (0, 1))
    block = model.block(world.camera)
    spread = np.diag([2.0, 2.0, 1.0, 1.0, 1e-3, 1e-3]) ** 2
    settled = replace(at_rest(world, readings).settled, model=model)
    settled.values["camera"] = block
    far = 1e3 * world.camera.rays(np.zeros((1, 2)))
    here, rng = Pose(np.eye(3), np.zeros(3)), np.random.default_rng(0)
    cameras = [model.camera(block + rng.normal(size=6) * np.sqrt(np.diag(spread))) for _ in range(3000)]
    pixels = np.array([camera.project(here, far)[0] for camera in cameras])
    sampled = np.sqrt(pixels.var(axis=0).mean())
    assert corner_error(settled, spread) == pytest.approx(sampled, rel=5 / np.sqrt(2 * 3000) + 0.01)


def test_errors_are_told_by_name_and_only_where_there_are_any(drawn):
    state = at_rest(*drawn)
    account(state)
    assert "camera" not in state.remarks.residuals and "lamp_radius" not in state.remarks.residuals
    assert state.remarks.residuals["corner_residual_sigmas"] == 1.0
    model = CameraModel(SIZE, state.camera.distortion, (0, 3))
    settled = replace(state.settled, model=model, covariance={"camera": np.diag([1.0, 4, 9, 16, 1e-6, 1e-8])})
    settled.values["camera"] = model.block(state.camera)
    account(replace(state, settled_or_none=settled))
    told = state.remarks.residuals["camera"]["standard_errors"]
    assert told == pytest.approx(
        {"fx": 1, "fy": 2, "cx": 3, "cy": 4, "distortion[0]": 1e-3, "distortion[3]": 1e-4}
    )


def test_marks_are_where_things_were_found_and_belong(drawn):
    world, _ = drawn
    state = at_rest(*drawn)
    one = state.observations[0]
    one.highlights = [Highlight(1, np.array([30.0, 40.0]), 0.1, 1.0, 4.0, False)]
    one.limb = Limb(np.array([[5.0, 6.0]]), np.ones(1))
    found = marks(state.photoset, state.settled, one)
    np.testing.assert_array_equal(found.corners, one.corners.pixels)
    np.testing.assert_allclose(
        found.corners + found.corner_misses, world.camera.project(one.pose, one.corners.points)
    )
    assert found.highlights.tolist() == [[30.0, 40.0]] and found.limb.tolist() == [[5.0, 6.0]]
    for pixel, ball in zip(found.expected_highlights, world.balls, strict=True):
        point = mirrored_point(ball.center, ball.radius, one.pose.center, world.lamps[0])
        np.testing.assert_allclose(pixel, world.camera.project(one.pose, point[None])[0], atol=1e-6)
    nothing = replace(one, corners=None, limb=None, highlights=[], light="unknown")
    empty = marks(state.photoset, state.settled, nothing)
    assert all(getattr(empty, name).shape == (0, 2) for name in empty.__slots__)
