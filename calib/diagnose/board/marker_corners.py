"""In which order the manifest lists the corners of loose markers, told by where the photos show them.

OpenCV numbers a marker's corners clockwise from the top left of its own drawing. Other prints of the same markers stand
otherwise: AprilTags as their makers publish them are half a turn from OpenCV's. Where markers' middles are hangs on no
order, so that a homography of the middles tells where each corner lies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations

import cv2
import numpy as np

from photogonio.calib.detect.first_look import FirstLook
from photogonio.calib.diagnose.base import LookDeparture, Stage
from photogonio.calib.geometry.board import Corners, board_points
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.photoset import LooseMarkers

ORDERS = np.array(list(permutations(range(4))))  # (24, 4): the first is the order as it is listed
_NEAR, _FAR = (
    0.15,
    0.4,
)  # of a marker's side: how near corners lie in the right order, and how far in a wrong one
_FEWEST, _MIDDLES = 2, 4  # markers that tell an order, and as many as have middles that tell a homography
_SPREAD = 0.05  # of the way along them, that middles lie apart across: else they lie in a row
_TURNS: dict[tuple[int, ...], str] = {
    (1, 2, 3, 0): "a quarter turn",
    (2, 3, 0, 1): "half a turn",
    (3, 0, 1, 2): "a quarter turn",
}


class MarkerCornerOrder(LookDeparture):
    """Corners of loose markers that are listed in another order than OpenCV's are taken as the photos show them."""

    stage = Stage.LOOK
    entries = (
        Entry(
            "marker-corner-order",
            "The corners of loose markers are listed in another order than that of OpenCV's drawing; they are taken as "
            "the photos show them. AprilTags as their makers print them stand half a turn from OpenCV's.",
            "Nothing, or list them clockwise from the drawing's top left.",
        ),
    )

    def evidence(self, look: FirstLook) -> Sequence[Diagnosis]:
        board = look.photoset.board
        if not isinstance(board, LooseMarkers):
            return []
        orders = listed_order(board, [one.corners for one in look.photos.every if one.corners is not None])
        if not orders:
            return []
        message = order_warning(board, orders)
        return [Diagnosis("marker-corner-order", message, len(orders), allowed=True, grounds=orders)]

    def remedy(self, look: FirstLook, found: Sequence[Diagnosis]) -> FirstLook:
        board = look.photoset.board
        assert isinstance(board, LooseMarkers)
        board = reordered(board, found[0].grounds)
        photoset = look.reader.photoset = replace(look.photoset, board=board)
        points, every = board_points(board), []
        for one in look.photos.every:
            corners = one.corners
            here = None if corners is None else replace(corners, points=points[corners.ids])
            every.append(replace(one, corners=here))
        return replace(look, photoset=photoset, photos=look.photos.replaced(every))


def listed_order(board: LooseMarkers, views: Sequence[Corners]) -> dict[int, np.ndarray]:
    """The order (4,) of the listed corners of each marker, by id, that the photos show otherwise than listed.

    Corner k of the print is where the manifest has corner ``order[k]``. Only flat markers are judged.
    """
    quads = {k: np.asarray(c, float).reshape(4, 3) for k, c in board.marker_corners}
    flat = {k: quad[:, :2] for k, quad in quads.items() if not quad[:, 2].any()}
    misses: dict[int, list[np.ndarray]] = {}
    for corners in views:
        ids = [int(k) for k in corners.marker_ids if int(k) in flat]
        if len(ids) < _FEWEST or len(set(ids)) < len(ids):
            continue
        listed = np.array([flat[k] for k in ids])
        seen = corners.marker_pixels[[int(k) in flat for k in corners.marker_ids]]
        for number, own in zip(ids, _misses(listed, seen), strict=True):
            misses.setdefault(number, []).append(own)
    found = {}
    for number, rows in misses.items():
        middle = np.median(rows, axis=0)
        best = int(np.argmin(middle))
        if middle[best] < _NEAR and middle[0] > _FAR:
            found[number] = ORDERS[best]
    return found


def _misses(listed: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """How far the corners of markers ``listed`` (n, 4, 2) lie from those ``seen`` (n, 4, 2) in each order, (n, 24), in
    sides: by the homography of their middles, or where these tell none by one of all corners in that order."""
    middles = listed.mean(1)
    extent = np.linalg.svd(middles - middles.mean(0), compute_uv=False)
    if len(listed) >= _MIDDLES and extent[1] > _SPREAD * extent[0]:
        bound = _NEAR * float(np.median(_sides(listed)))
        maps = [cv2.findHomography(seen.mean(1), middles, cv2.RANSAC, bound)[0]] * len(ORDERS)
    else:
        flat = seen.reshape(-1, 2)
        maps = [cv2.findHomography(flat, listed[:, order].reshape(-1, 2))[0] for order in ORDERS]
    off = np.full((len(listed), len(ORDERS)), np.inf)
    for k, (order, matrix) in enumerate(zip(ORDERS, maps, strict=True)):
        # y is down in pictures and up on the page: a map that keeps sides would look at the print from behind
        if matrix is not None and _turned_over(matrix, seen.mean((0, 1))):
            there = cv2.perspectiveTransform(seen.reshape(1, -1, 2), matrix).reshape(seen.shape)
            off[:, k] = np.linalg.norm(listed[:, order] - there, axis=2).mean(1)
    return off / _sides(listed)[:, None]


def _turned_over(matrix: np.ndarray, place: np.ndarray) -> bool:
    """Whether a homography (3, 3) mirrors what is about a place (2,)."""
    return bool(np.linalg.det(matrix) / (matrix[2] @ np.append(place, 1.0)) ** 3 < 0)


def _sides(quads: np.ndarray) -> np.ndarray:
    """Mean side (n,) of quadrangles (n, 4, 2), whatever the order of their corners."""
    around = quads - quads.mean(1, keepdims=True)
    return np.sqrt(2.0) * np.linalg.norm(around, axis=2).mean(1)


def reordered(board: LooseMarkers, orders: dict[int, np.ndarray]) -> LooseMarkers:
    """The board with the corners of markers listed in other ``orders``."""
    corners = tuple((k, np.asarray(c, float).reshape(4, 3)) for k, c in board.marker_corners)
    return replace(board, marker_corners=tuple((k, c[orders[k]] if k in orders else c) for k, c in corners))


def order_warning(board: LooseMarkers, orders: dict[int, np.ndarray]) -> str:
    """What was found, for the one who wrote the manifest."""
    kinds = {tuple(int(n) for n in order) for order in orders.values()}
    how = _TURNS.get(next(iter(kinds)), "another order") if len(kinds) == 1 else "other orders"
    whose = "of all markers" if len(orders) == len(board.marker_corners) else f"of {_numbers(sorted(orders))}"
    tags = "; prints of AprilTags stand half a turn from it" if "APRILTAG" in board.dictionary else ""
    return (
        f"board.marker: the corners {whose} are listed {how} from the order of OpenCV's drawing (clockwise from its "
        f"top left{tags}). They are taken as the photos show them"
    )


def _numbers(ids: list[int]) -> str:
    return ("marker " if len(ids) == 1 else "markers ") + ", ".join(map(str, ids))
