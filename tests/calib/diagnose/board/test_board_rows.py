"""A board of more or fewer rows than the manifest says."""

from dataclasses import replace

import numpy as np

from photogonio.calib.detect.photo_reader import look
from photogonio.calib.diagnose.board.board_rows import board_doubts
from photogonio.capture.photoset import LooseMarkers
from tests.drawn.board_photos import POSES
from tests.drawn.boards import BOARD, CAMERA, draw, quiet, radiance, reader_of, views_of


def test_rows_that_the_board_has_not_or_has_besides_are_told():
    images = {f"{k}.png": radiance(draw(CAMERA, pose, 0.004, k), 0.004) for k, pose in enumerate(POSES)}
    reader = reader_of(BOARD, images)
    seen = look(reader, views_of(reader), quiet, "")
    boards = [(s.view.name, s.corners, pose) for s, pose in zip(seen, POSES, strict=True)]
    assert board_doubts(BOARD, CAMERA, boards, set()) == []
    fewer = replace(BOARD, squares=(8, 5))
    assert any(
        "20 to 23 are seen, which the board has not" in w for w in board_doubts(fewer, CAMERA, boards, set())
    )
    assert board_doubts(fewer, CAMERA, boards, {20, 21, 22, 23}) == []
    more = replace(BOARD, squares=(8, 7))
    assert any(
        "24 to 27 of the board are seen in none" in w for w in board_doubts(more, CAMERA, boards, set())
    )


def test_loose_markers_have_no_rows_and_no_photos_tell_nothing():
    loose = LooseMarkers("DICT_4X4_50", ((0, np.zeros((4, 3))),))
    assert board_doubts(loose, CAMERA, [("a", None, None)], set()) == []
    assert board_doubts(BOARD, CAMERA, [], set()) == []
