"""A flat sample found by its edges in drawn photos: where it lies, how it is tilted, and how sure that is."""

import numpy as np

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
