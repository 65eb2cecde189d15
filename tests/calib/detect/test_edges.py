"""A flat sample found by its edges in drawn photos: where it lies, how it is tilted, and how sure that is."""

import numpy as np
import pytest

from photogonio.calib.adjust.flat_sample import moved_points
from photogonio.calib.detect.edges import plane_edges
from photogonio.calib.detect.gray import GrayPart
from photogonio.calib.geometry.print_map import draw_print
from tests.drawn.boards import BOARD
from tests.drawn.flat_samples import CAMERA, PLANE, POSES, SIZE, photo


def test_edges_of_the_print_are_not_taken_for_the_samples():
    """Points are kept only where the ground behind is one tone as far as an edge is looked for."""
    print_, usable, pose = draw_print(BOARD), np.ones(SIZE[::-1], bool), POSES[0]
    level = photo(pose, np.zeros(8), 0.004, 0)
    free = plane_edges(GrayPart(level, usable), CAMERA, pose, PLANE, 3.0)
    held = plane_edges(GrayPart(level, usable), CAMERA, pose, PLANE, 3.0, print_)
    assert free is not None and held is not None
    over = print_.on_print(free.places[:, :2])
    assert over.any() and len(held) < len(free)
    inner = held.places[
        (held.places[:, :2] > 3.0).all(1), :2
    ]  # not where a slanted ray passes the print's border
    _, apart = print_.at(inner)
    # seen from above, 2 mm over the board: about three pixels a millimetre
    assert (apart * 3.2 > 4.0).all()


@pytest.mark.parametrize("k", range(3))
def test_edges_lie_where_the_sheet_ends(k):
    """Moved by half a millimetre, a pixel and a half: across each edge, to a tenth of a pixel in the mean."""
    values = np.zeros(8)
    values[:2] = 0.4, -0.3
    found = plane_edges(
        GrayPart(photo(POSES[k], values, 0.004, k), np.ones(SIZE[::-1], bool)), CAMERA, POSES[k], PLANE, 6.0
    )
    true = CAMERA.project(POSES[k], moved_points(found.places, PLANE, values))
    off = np.einsum("ij,ij->i", found.pixels - true, found.normals)
    assert len(found) > 30 and np.abs(off).max() < 0.5 and abs(off.mean()) < 0.1
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1.0)
    np.testing.assert_array_equal(found.places[:, 2], PLANE.height)


def test_corners_of_the_sheet_are_left_alone():
    """There the other edge is near: nothing is looked for within a twelfth of a side of them."""
    found = plane_edges(
        GrayPart(photo(POSES[0], np.zeros(8), 0.004, 0), np.ones(SIZE[::-1], bool)),
        CAMERA,
        POSES[0],
        PLANE,
        3.0,
    )
    nearest = np.linalg.norm(found.places[:, None, :2] - PLANE.outline, axis=2).min(axis=1)
    assert nearest.min() >= 0.08 * 56 - 1e-9


def test_a_sheet_farther_off_than_is_looked_is_not_found():
    values = np.zeros(8)
    values[0] = 5.0  # some fifteen pixels
    level = photo(POSES[0], values, 0.004, 0)
    found = plane_edges(GrayPart(level, np.ones(SIZE[::-1], bool)), CAMERA, POSES[0], PLANE, 3.0)
    if found is not None:  # the sides along which it moved are where they were
        assert np.ptp(found.places[:, 0]) > 0 and set(np.round(np.abs(found.places[:, 1]), 6)) == {28.0}
