"""The printed target: what is drawn is what the manifest beside it says, found again by OpenCV."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.capture.target.layout import KINDS, PAPERS, black_rectangles, make_target, marker_corners

PIXELS = 8.0  # a millimetre; markers' cells of 15 / 7 mm do not fall on whole pixels
TARGETS = [(paper, kind) for paper in PAPERS for kind in KINDS]


def drawn(target) -> np.ndarray:
    """The pattern with a white margin of 10 mm, 8-bit, each pixel's ink by area (supersampled 4 x 4)."""
    fine = 4
    scale, margin = PIXELS * fine, 10.0
    width, height = (round((size + 2 * margin) * scale) for size in target.size)
    page = np.full((height, width), 255, np.uint8)
    for x, y, w, h in black_rectangles(target):
        left, right = (round((v + margin) * scale) for v in (x, x + w))
        low, high = (round((v + margin) * scale) for v in (y, y + h))
        page[height - high : height - low, left:right] = 0
    return cv2.resize(page, (width // fine, height // fine), interpolation=cv2.INTER_AREA)


def world(pixels: np.ndarray, page: np.ndarray) -> np.ndarray:
    """Pixels (n, 2) as millimetres, x right and y up from the pattern's lower-left corner."""
    x, y = pixels[:, 0] + 0.5, page.shape[0] - (pixels[:, 1] + 0.5)
    return np.column_stack([x, y]) / PIXELS - 10.0


@pytest.mark.parametrize("paper", PAPERS)
def test_the_charuco_board_is_found_where_the_manifest_says(paper):
    target = make_target(paper=paper)
    board, page = target.board, drawn(target)
    marks = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    made = cv2.aruco.CharucoBoard(board.squares, board.square_length, board.marker_length, marks)
    corners, ids, _, _ = cv2.aruco.CharucoDetector(made).detectBoard(page)
    columns, rows = board.squares
    assert len(ids) == (columns - 1) * (rows - 1)
    true = np.column_stack([ids.ravel() % (columns - 1) + 1, rows - 1 - ids.ravel() // (columns - 1)])
    error = world(corners.reshape(-1, 2), page) - true * board.square_length
    assert np.abs(error).max() < 0.05  # 0.4 pixels


@pytest.mark.parametrize("paper", PAPERS)
def test_the_grid_is_found_where_the_manifest_says(paper):
    target = make_target(paper=paper, kind="aruco-grid")
    page = drawn(target)
    marks = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, target.board.dictionary))
    corners, ids, _ = cv2.aruco.ArucoDetector(marks).detectMarkers(page)
    columns, rows = target.board.markers
    assert len(ids) == columns * rows - 4  # sample, two balls and patch stand in the place of one each
    number, true = marker_corners(target.board)
    place = {int(k): corner for k, corner in zip(number, true, strict=True)}
    for found, k in zip(corners, ids.ravel(), strict=True):
        assert (
            np.abs(world(found.reshape(4, 2), page) - place[int(k)]).max() < 0.2
        )  # unrefined: to 1.5 pixels


@pytest.mark.parametrize(("paper", "kind"), TARGETS)
def test_everything_fits_on_the_paper(paper, kind):
    target = make_target(paper=paper, kind=kind)
    width, height = target.page
    x, y = target.corner
    assert (
        x >= 9.99
        and y >= 25.99
        and x + target.size[0] <= width - 9.99
        and y + target.size[1] <= height - 9.99
    )
    places = np.array([*target.balls, target.sample, *target.patch])
    assert (places >= 0).all() and (places <= target.size).all()
    near = np.linalg.norm(np.array(target.balls) - target.sample, axis=1)
    assert near.min() > 25 + 8 + 20  # a ball of 25 mm does not hide those of 8 mm


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"paper": "a5"}, "--paper: expected one of"),
        ({"kind": "chess"}, "--kind: expected one of"),
        ({"square": 60.0}, "--square: 60 mm leaves"),
        ({"square": 0.0}, "--square: expected a length above 0"),
        ({"square": float("nan")}, "--square: expected a length above 0"),
        ({"square": 1.0}, "--square: 1 mm takes 24099 markers, more than the 1000 there are"),
        ({"dictionary": "DICT_9"}, "--dictionary: OpenCV has no"),
        ({"dictionary": "DICT_4X4_50"}, "--dictionary: DICT_4X4_50 has 50 markers, the board needs 52"),
    ],
)
def test_impossible_targets_are_refused(wrong, said):
    with pytest.raises(InputError, match=said):
        make_target(**wrong)


@pytest.mark.parametrize(("paper", "kind"), TARGETS)
def test_the_strip_of_greys_lies_between_pattern_and_ruler(paper, kind):
    for square in (12.0, 20.0, 27.0):
        target = make_target(paper=paper, kind=kind, square=square)
        greys = [grey for grey, _ in target.greys]
        assert greys == sorted(greys, reverse=True)
        assert 0.0 < greys[-1] < greys[0] < 1.0
        corners = np.concatenate([outline for _, outline in target.greys])
        assert corners[:, 1].max() <= -4.0  # white beside the markers, which they are found by
        assert corners[:, 1].min() + target.corner[1] > 12.0  # above ruler and text
        assert corners[:, 0].min() >= 0.0 and corners[:, 0].max() <= target.size[0] + 1e-9
