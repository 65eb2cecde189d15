"""What photos of the board leave open, and how its print departs from the manifest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.diagnose.board.board_shape import bad_photos, board_shape, views_told
from photogonio.calib.geometry.board import Corners
from photogonio.calib.geometry.pose import fit_pose
from tests.drawn.calibrations import Drawn
from tests.drawn.setups import (
    SIZE,
)


def view_codes(size, photos) -> list[str]:
    return [one.code for one in views_told(size, photos)]


def posed(drawn: Drawn, chosen: list[int] | None = None):
    """Calibration photos as (name, corners, true pose)."""
    every = range(len(drawn.boards)) if chosen is None else chosen
    return [(f"c{k}", drawn.boards[k], drawn.world.boards[k]) for k in every]


def test_frontal_photos():
    drawn = Drawn(1)
    boards = [(n, c, replace(p, rotation=np.diag([1.0, -1, -1]))) for n, c, p in posed(drawn)]
    assert "frontal-photos" in view_codes(SIZE, boards)
    assert "frontal-photos" not in view_codes(SIZE, posed(drawn))


def test_photos_tilted_alike():
    drawn = Drawn(1)
    steep = max(drawn.world.boards, key=lambda p: p.rotation[2, 2])
    boards = [(n, c, steep) for n, c, _ in posed(drawn)]
    assert "tilted-alike" in view_codes(SIZE, boards)


def test_no_corner_in_the_outer_third():
    drawn = Drawn(1)
    middle = (np.array(SIZE) - 1) / 2
    near = [(n, c.keep((np.abs(c.pixels - middle) < 0.55 * middle).all(1)), p) for n, c, p in posed(drawn)]
    assert "corners-in-middle" in view_codes(SIZE, near)
    wide = [(n, replace(c, pixels=middle + 1.5 * (c.pixels - middle)), p) for n, c, p in posed(drawn)]
    assert "corners-in-middle" not in view_codes(SIZE, wide)


def test_too_few_photos():
    assert "few-camera-photos" in view_codes(SIZE, posed(Drawn(1), [0, 1]))


def moved(corners: Corners, change) -> Corners:
    """The same corners as if the manifest knew of ``change``, which the print has undergone."""
    return replace(corners, points=change(corners.points))


def test_a_print_of_unequal_scales():
    drawn = Drawn(5)
    drawn.boards, drawn.samples = (
        [moved(c, lambda p: p * [1, 1 / 1.006, 1]) for c in group] for group in (drawn.boards, drawn.samples)
    )
    drawn.camera()
    assert drawn.told("board-stretched")
    stretch = drawn.remarks.residuals["board"]["stretch"]
    assert stretch == pytest.approx(0.006, abs=6 * drawn.remarks.residuals["board"]["stretch_error"])


def test_a_board_that_is_not_flat():
    """Found by its bow: corners stand up to 1 mm off a plane 180 mm wide."""
    drawn = Drawn(6)
    flat = [c.points.copy() for c in drawn.boards]
    for k, pose in enumerate(drawn.world.boards):
        bent = flat[k] + np.column_stack([np.zeros((len(flat[k]), 2)), ((flat[k][:, 0] - 90) / 90) ** 2])
        noise = 0.03 * drawn.rng.normal(size=(len(bent), 2))
        drawn.boards[k] = replace(drawn.boards[k], pixels=drawn.world.camera.project(pose, bent) + noise)
    drawn.samples = []
    state = drawn.camera()
    camera, model, boards = state.camera, state.model, state.boards
    shape = board_shape(model, camera, boards, False)
    assert shape is not None
    assert "board-bent" in [one.code for one in shape.told()]
    assert drawn.told("board-bent")


def test_a_photo_whose_corners_do_not_fit():
    drawn = Drawn(7)
    blurred = drawn.boards[2]
    noise = 1.5 * drawn.rng.normal(size=blurred.pixels.shape)
    drawn.boards[2] = replace(blurred, pixels=blurred.pixels + noise)
    drawn.camera()
    assert [o.name for o in drawn.remarks.left_out] == ["c2"]
    assert "its corners miss by" in drawn.remarks.left_out[0].reason
    boards = [(n, c, fit_pose(drawn.world.camera, c).pose) for n, c, _ in posed(drawn)]
    assert [k for k, _ in bad_photos(drawn.world.camera, boards)] == [2]
