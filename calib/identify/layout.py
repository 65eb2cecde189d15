"""Which printed board photos show of which nothing is known: its dictionary, kind, rows, columns and proportions.

A board's markers are numbered row by row. For each number of columns the places of all markers on the board follow
from their numbers, and only for the right one does a plane seen from somewhere put them where they are in the photo.
The size of its squares cannot be seen: it is that of a sheet of ours of the same layout, or to be told.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import cv2
import numpy as np

from photogonio.calib.geometry.board import dictionary
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import CharucoBoard, GridBoard, PrintedBoard
from photogonio.capture.target.layout import DICTIONARIES, PAPERS, make_target

FAMILIES = (  # dictionaries of which each begins with the one before: to try a photo, to read it, and the largest
    *((f"DICT_{n}X{n}_50", f"DICT_{n}X{n}_250", f"DICT_{n}X{n}_1000") for n in (5, 6, 4, 7)),
    ("DICT_APRILTAG_36h11",),
    ("DICT_ARUCO_MIP_36h12",),
    ("DICT_ARUCO_ORIGINAL",),
    ("DICT_APRILTAG_25h9",),
    ("DICT_APRILTAG_16h5",),
)
Family = tuple[str, ...]
NEARLY_ALL = 0.9  # of the markers of a dictionary: a number as high hints that the board has more
FEWEST = 6  # markers of a photo that tell a layout
TRIED = 6  # photos that are asked for a layout
WIDEST = 40  # columns that are tried
OFF = 0.12  # of a marker's side: how far a marker's middle may lie from its place, in the median
BETTER = 1.5  # times as near as by any other layout
SHEETS = (20.0, 15.0, 25.0, 30.0, 10.0, 12.0, 40.0)  # squares of our sheets, mm, the likeliest first
UNKNOWN_SQUARE = 20.0  # mm, where nothing tells
MARKER_STEP = 0.05  # of a square: in such steps people choose a marker's side
UNSURE_SHARE, UNSURE_PIXELS = 0.008, 0.8  # of a square, and pixels, that a side as found may be off


@dataclass(frozen=True, slots=True)
class Markers:
    """Markers of one family in one photo."""

    family: Family
    ids: np.ndarray  # (m,) int
    quads: np.ndarray  # (m, 4, 2) pixels, clockwise from the top left

    def __len__(self) -> int:
        return len(self.ids)


@dataclass(frozen=True, slots=True)
class Layout:
    """A board but for its size."""

    family: Family
    kind: str  # "charuco" | "aruco-grid"
    columns: int
    first_id: int
    legacy: bool = False

    def places(self, ids: np.ndarray) -> np.ndarray:
        """(m, 2) column and row of markers' squares, from the top left."""
        number = np.asarray(ids) - self.first_id
        if self.kind == "aruco-grid":
            return np.column_stack([number % self.columns, number // self.columns])
        upper = (self.columns + self.legacy) // 2  # markers in the first row; the second has the others
        pair, within = np.divmod(number, self.columns)
        second = within >= upper
        column = 2 * np.where(second, within - upper, within) + np.where(second == self.legacy, 1, 0)
        return np.column_stack([column, 2 * pair + second])


@dataclass(frozen=True, slots=True)
class FoundBoard:
    """A board as photos show it."""

    board: PrintedBoard
    sheet: (
        str | None
    )  # the paper of a sheet of ours with this layout, which tells the size; None: it is a guess


def seen_markers(tone: np.ndarray, family: Family | None = None) -> Markers | None:
    """The markers in a photo (h, w) uint8, of the family that has most of them or of the one given; None without any.

    Each family is tried by its first markers alone, of which any board has some: reading a photo takes as long as there
    are markers in the dictionary.
    """
    if family is None:
        for one in FAMILIES:
            tried = _read(tone, one, one[0])
            if tried is not None and len(tried) >= FEWEST:
                family = one
                break
        else:
            return None
    main = family[min(1, len(family) - 1)]
    found = _read(tone, family, main)
    top = len(dictionary(main).bytesList)
    if found is not None and main != family[-1] and found.ids.max() >= NEARLY_ALL * top:
        return _read(tone, family, family[-1])
    return found


def _read(tone: np.ndarray, family: Family, name: str) -> Markers | None:
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    quads, ids, _ = cv2.aruco.ArucoDetector(dictionary(name), settings).detectMarkers(tone)
    if ids is None or not len(ids):
        return None
    shown = np.array([np.asarray(q, float).reshape(4, 2) for q in quads])
    return Markers(family, np.asarray(ids).reshape(-1).astype(int), shown)


def find_board(photos: Sequence[Markers]) -> FoundBoard | None:
    """The board of several photos, each with its markers; None if they tell of none."""
    best: tuple[int, Layout] | None = None
    for family in dict.fromkeys(m.family for m in photos):
        own = [m for m in photos if m.family == family and len(m) >= FEWEST]
        own.sort(key=len, reverse=True)
        tried = dict.fromkeys(one for m in own[:TRIED] if (one := find_layout(m, own)) is not None)
        for layout in tried:
            count = sum(int(_fitting(layout, m).sum()) for m in own)
            if best is None or count > best[0]:
                best = count, layout
    if best is None:
        return None
    layout = best[1]
    return _with_size(layout, [m for m in photos if m.family == layout.family])


def find_layout(markers: Markers, others: Sequence[Markers] = ()) -> Layout | None:
    """The one layout that the markers of a photo have; None if there is none, or several.

    ``others``: markers of further photos, whose lowest number may be the board's first.
    """
    low = min(int(m.ids.min()) for m in (markers, *others))
    side = np.median(np.linalg.norm(np.diff(markers.quads, axis=1), axis=2))
    for first in dict.fromkeys((0, low)):
        scores = sorted(
            ((_misfit(one, markers) / side, k, one) for k, one in enumerate(_layouts(markers.family, first))),
            key=lambda scored: scored[:2],
        )
        if not scores or scores[0][0] >= OFF:
            continue
        limit = BETTER * max(scores[0][0], 0.02)
        near = [one for score, _, one in scores if score <= limit]
        # patterns of either age differ in the first marker of every other row: without it the usual one is meant
        plain = list(dict.fromkeys(replace(one, legacy=False) for one in near))
        if len(plain) == 1:
            return plain[0] if plain[0] in near else near[0]
    return None


def _layouts(family: Family, first: int) -> Iterator[Layout]:
    for columns in range(2, WIDEST + 1):
        yield Layout(family, "charuco", columns, first)
        yield Layout(family, "aruco-grid", columns, first)
        if columns > 2:  # of two columns both patterns put the markers alike, but for a half
            yield Layout(family, "charuco", columns, first, legacy=True)


def _misfit(layout: Layout, markers: Markers) -> float:
    """Pixels that the middles lie off their places, in the median, by the best view of a plane."""
    places = layout.places(markers.ids).astype(float)
    if (np.ptp(places, axis=0) < 1).any():
        return np.inf
    middle = markers.quads.mean(axis=1)
    matrix, _ = cv2.findHomography(places, middle)
    if matrix is None:
        return np.inf
    there = cv2.perspectiveTransform(places.reshape(-1, 1, 2), matrix).reshape(-1, 2)
    # all corners count: middles alone of few markers fit many grids
    corners = _cornered(layout, places, markers.quads, matrix)
    miss = np.linalg.norm(there - middle, axis=1)
    return float(max(np.median(miss), np.sqrt(np.mean(np.minimum(miss, np.median(miss) * 20) ** 2)), corners))


def _cornered(layout: Layout, places: np.ndarray, quads: np.ndarray, matrix: np.ndarray) -> float:
    """Pixels that the markers' own corners lie off where squares of one size would have them, in the median."""
    own = _unwarped(quads, matrix) - places[:, None]
    usual = np.median(own, axis=0)
    again = cv2.perspectiveTransform((places[:, None] + usual).reshape(-1, 1, 2), matrix).reshape(quads.shape)
    size = float(np.abs(usual[1, 0] - usual[0, 0]))
    if not 0.2 < size < 1.0 or np.abs(usual.mean(axis=0)).max() > 0.1:
        return np.inf
    return float(np.median(np.linalg.norm(again - quads, axis=2)))


def _unwarped(quads: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    try:
        inverse = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return np.full(quads.shape, np.nan)
    return cv2.perspectiveTransform(quads.reshape(-1, 1, 2), inverse).reshape(quads.shape)


def _fitting(layout: Layout, markers: Markers) -> np.ndarray:
    """(m,) which markers are where the layout has them; a false one is not."""
    places = layout.places(markers.ids).astype(float)
    matrix, inside = cv2.findHomography(
        places, markers.quads.mean(axis=1), cv2.RANSAC, 0.2 * _side(markers.quads)
    )
    none = np.zeros(len(markers), bool)
    if matrix is None:
        return none
    return inside.reshape(-1).astype(bool) & (places >= 0).all(axis=1)


def _side(quads: np.ndarray) -> float:
    return float(np.median(np.linalg.norm(np.diff(quads, axis=1), axis=2)))


def _with_size(layout: Layout, photos: Sequence[Markers]) -> FoundBoard:
    rows, shares, top = 0, [], layout.first_id
    for markers in photos:
        if len(markers) < FEWEST:
            continue
        good = _fitting(layout, markers)
        if good.sum() < FEWEST:
            continue
        places = layout.places(markers.ids[good]).astype(float)
        matrix, _ = cv2.findHomography(places, markers.quads[good].mean(axis=1))
        sides = np.linalg.norm(np.diff(_unwarped(markers.quads[good], matrix), axis=1), axis=2)
        shares.append(float(np.median(sides)))
        rows, top = max(rows, int(places[:, 1].max()) + 1), max(top, int(markers.ids[good].max()))
    rows += layout.legacy and rows % 2 == 1  # the pattern differs for even rows alone
    names = layout.family[1:] or layout.family
    name = next((n for n in names if top < len(dictionary(n).bytesList)), names[-1])
    share, side = float(np.median(shares)), float(np.median([_side(m.quads) for m in photos]))
    usual = round(share / MARKER_STEP) * MARKER_STEP
    # edges of small markers are found some tenth of a pixel inside
    share = usual if abs(share - usual) < UNSURE_SHARE + UNSURE_PIXELS * share / side else round(share, 2)
    return _sized(layout, name, max(rows, 2), share)


def _sized(layout: Layout, name: str, rows: int, share: float) -> FoundBoard:
    """The board with the lengths of a sheet of ours of this layout, else with a usual one's."""
    if name in DICTIONARIES and not layout.first_id and not layout.legacy:
        for paper, board in _sheets(layout.kind):
            size = board.squares if isinstance(board, CharucoBoard) else board.markers
            alike = abs(board.marker_length / board.pitch - share) < 0.5 * MARKER_STEP
            if board.dictionary == name and size == (layout.columns, rows) and alike:
                return FoundBoard(board, paper)
    return FoundBoard(board_of(layout, name, rows, share, UNKNOWN_SQUARE), None)


@lru_cache(maxsize=2)
def _sheets(kind: str) -> tuple[tuple[str, PrintedBoard], ...]:
    """Our sheets' boards, with their paper."""
    made: list[tuple[str, PrintedBoard]] = []
    for square in SHEETS:
        for paper in PAPERS:
            try:
                made.append((paper, make_target(paper=paper, kind=kind, square=square).board))
            except InputError:  # more markers than there are
                continue
    return tuple(made)


def board_of(layout: Layout, name: str, rows: int, share: float, pitch: float) -> PrintedBoard:
    """A board of this layout whose squares, or whose markers from one to the next, measure ``pitch``."""
    marker = round(share * pitch, 3)
    if layout.kind == "charuco":
        size = (layout.columns, rows)
        return CharucoBoard(name, size, pitch, marker, layout.first_id, layout.legacy)
    return GridBoard(name, (layout.columns, rows), marker, round(pitch - marker, 3), layout.first_id)
