"""What one look at each photo yields: its corners. Photos are read through a small cache."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from threading import Lock
from typing import Protocol, TypedDict, Unpack

import numpy as np

from photogonio.calib.detect.corners import corners_of_half, expected_places, find_corners, placed_corners
from photogonio.calib.detect.gray import (
    detection_image,
    fine_about,
    fine_image,
    finite,
    gray,
    halved,
    without_fireflies,
)
from photogonio.calib.detect.masks import things_mask
from photogonio.calib.detect.observation import Keep, in_memory
from photogonio.calib.detect.subpixel import KEPT_BYTES, Around, Template, refined_corners
from photogonio.calib.geometry.board import Corners, board_points
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.geometry.pose import fit_pose
from photogonio.calib.geometry.print_map import Print, draw_print
from photogonio.calib.parallel import Found, Item, abreast
from photogonio.capture.errors import InputError
from photogonio.capture.linear.encoding import Coded
from photogonio.capture.linear.signal import Region, Windows, cut
from photogonio.capture.photoset import Board, CharucoBoard, PhotoSet, View
from photogonio.capture.radiance import RadianceImage

ReadRadiance = Callable[[PhotoSet, View], RadianceImage]
# gray (h, w) float32 and not saturated (h, w) bool, of a region or everywhere
ReadLevel = Callable[[View, Region | None], tuple[np.ndarray, np.ndarray]]
ReadPart = Callable[[View, Region | Windows], RadianceImage]
ReadCodes = Callable[[View], Coded | None]
Progress = Callable[[str, int, int], None]
BothWays = tuple[Corners | None, Corners | None]  # one photo's, placed with the board's markers, and without

_CACHE_BYTES = 250_000_000  # a few small photos; large ones are read again
_GROW = 3  # pixels kept clear around whatever stands on the board
_LARGE = 6_000_000  # pixels of a photo whose markers are large enough in one of half the size, mostly
# photos of a role of which the pixels about the corners are kept for the second look, and bytes of all of them
_KEPT, _MOST_BYTES = 40, 40_000_000
JUDGING, _JUDGES = 12, 4  # corners of a photo that tells of the print, and photos that are asked
_ABOUT = 16  # pixels around a corner that placing it takes: its window, and two for what moves it


class Asked(TypedDict, total=False):
    """How photos are read, if not plainly."""

    read_part: ReadPart | None  # reads a region of a view at less cost
    read_level: ReadLevel | None  # likewise its gray levels
    workers: int  # that many photos are looked at side by side, and in memory at once
    keep: Keep  # sets aside what was read of a view's paper, some megabytes
    looks: Looks | None  # keeps what a first look at each view found
    codes: ReadCodes | None  # how a view's codes became its radiance


class Reader:
    """Reads views' radiance, keeping the latest while they are small; remembers which could not be read.

    Several threads may use it.
    """

    def __init__(self, photoset: PhotoSet, read_radiance: ReadRadiance, **asked: Unpack[Asked]):
        self.photoset = photoset
        self.keep, self.looks = asked.get("keep", in_memory), asked.get("looks")
        self.codes = asked.get("codes")
        self.failed: dict[str, str] = {}
        self.workers = asked.get("workers", 1)
        self._read = read_radiance
        self._read_part, self._read_level = asked.get("read_part"), asked.get("read_level")
        self._kept: OrderedDict[View, RadianceImage] = OrderedDict()
        self._bytes = 0
        self._lock = Lock()

    def __call__(self, view: View) -> RadianceImage | None:
        """The view's radiance; None if it cannot be read, the reason then being in ``failed``."""
        if view.name in self.failed:
            return None
        with self._lock:
            if view in self._kept:
                self._kept.move_to_end(view)
                return self._kept[view]
        try:
            image = self._read(self.photoset, view)
        except InputError as error:
            self.failed[view.name] = str(error)
            return None
        self._keep(view, image)
        return image

    def level(self, view: View, region: Region | None = None) -> tuple[np.ndarray, np.ndarray] | None:
        """Gray radiance (h, w) and the pixels that may be used (h, w) bool, of a region or everywhere; None if the view
        cannot be read."""
        if self._read_level is None or view.name in self.failed or view in self._kept:
            image = self(view)
            if image is None:
                return None
            return cut(gray(image), region), cut(~image.saturated & finite(image), region)
        try:
            return self._read_level(view, region)
        except InputError as error:
            self.failed[view.name] = str(error)
            return None

    def part(self, view: View, region: Region | Windows) -> RadianceImage | None:
        """The radiance of a region ``[x0, x1) x [y0, y1)``; None if the view cannot be read."""
        if self._read_part is None or view.name in self.failed or view in self._kept:
            return self(view)
        try:
            return self._read_part(view, region)
        except InputError as error:
            self.failed[view.name] = str(error)
            return None

    def near(self, view: View, pixels: np.ndarray) -> RadianceImage | None:
        """The four pixels to the right of and below each of ``pixels`` (n, 2), as a picture (2 n, 2) in which they lie
        under one another; None if the view cannot be read. Only the whole picture tells which of them are valid."""
        windows = Windows(pixels, 0, 1)
        if self._read_part is not None and view not in self._kept:
            return self.part(view, windows)
        image = self(view)
        if image is None:
            return None
        value, variance = windows.of(image.value), windows.of(image.variance)
        return RadianceImage(value, variance, windows.of(image.valid), windows.of(image.saturated))

    def abreast(self, task: Callable[[Item], Found], items: Sequence[Item]) -> Iterator[Found]:
        """:func:`calib.detect.parallel.abreast` with this reader's workers."""
        return abreast(task, items, self.workers)

    def _keep(self, view: View, image: RadianceImage) -> None:
        with self._lock:
            if view in self._kept or _size(image) > _CACHE_BYTES:
                return
            self._kept[view] = image
            self._bytes += _size(image)
            while self._bytes > _CACHE_BYTES:
                _, old = self._kept.popitem(last=False)
                self._bytes -= _size(old)


def _size(image: RadianceImage) -> int:
    return image.value.nbytes + image.variance.nbytes + image.valid.nbytes + image.saturated.nbytes


@dataclass(frozen=True, slots=True)
class Seen:
    """One view and the board's corners in it."""

    view: View
    corners: Corners | None  # None: no board in this set
    size: tuple[int, int]
    around: Around | None = None  # the photo about all corners, until they are placed for good


class Looks(Protocol):
    """First looks that were kept; see :func:`look`."""

    def get(self, view: View, *, around: bool) -> Seen | None:
        """What was found in a view, with pixels about the corners or without; None if it is not at hand."""

    def put(self, seen: Seen, *, around: bool) -> None:
        """Keep what was found."""


def look(reader: Reader, views: tuple[View, ...], progress: Progress, label: str) -> list[Seen]:
    """Find the board in each view that can be read."""
    seen = []
    board = reader.photoset.board
    most = 0 if board is None else min(_KEPT, _MOST_BYTES // (KEPT_BYTES * len(board_points(board))))
    tasks = [(view, k < most) for k, view in enumerate(views)]
    for k, one in enumerate(reader.abreast(lambda task: _once_looked_at(reader, *task), tasks)):
        if one is not None:
            seen.append(one)
        progress(label, k + 1, len(views))
    return seen


def _once_looked_at(reader: Reader, view: View, keep: bool) -> Seen | None:
    looks = reader.looks
    if looks is None:
        return _look_at(reader, view, keep)
    seen = looks.get(view, around=keep)
    if seen is None:
        seen = _look_at(reader, view, keep)
        if seen is not None:
            looks.put(seen, around=keep)
    return seen


def _look_at(reader: Reader, view: View, keep: bool) -> Seen | None:
    shown = reader.level(view)
    if shown is None:
        return None
    height, width = shown[0].shape
    board = reader.photoset.board
    if board is None:
        return Seen(view, None, (width, height))
    corners = _corners(board, shown[0])
    if not keep or not _has_print(board):
        return Seen(view, corners, (width, height))
    around = Around.of(*shown, expected_places(board_points(board), corners))
    return Seen(view, corners, (width, height), around)


def _corners(board: Board, level: np.ndarray) -> Corners:
    """The corners in a photo (h, w); those of a large one are looked for in one of half the size, if it shows them."""
    if level.size > _LARGE:
        small = without_fireflies(halved(level))
        found = corners_of_half(board, detection_image(small))
        if found is not None:
            return placed_corners(board, found, *fine_about(level, found.pixels, _ABOUT))
    calm = without_fireflies(level)
    return find_corners(board, detection_image(calm), fine_image(calm))


def _has_print(board: Board) -> bool:
    return isinstance(board, CharucoBoard) and draw_print(board) is not None


def placed_both_ways(reader: Reader, camera: Camera, seen: Sequence[Seen]) -> dict[int, BothWays]:
    """A few photos, by number, with their corners placed with the board's markers and without: they tell whether the
    markers are where its numbers put them."""
    pattern = _pattern(reader)
    if pattern is None:
        return {}
    many = [k for k, one in enumerate(seen) if one.corners is not None and len(one.corners) >= JUDGING]
    judges = [many[k] for k in np.unique(np.linspace(0, len(many) - 1, _JUDGES).astype(int))] if many else []
    found = reader.abreast(
        lambda k: _closer(reader, pattern, camera, seen[k], (False, True)), [int(k) for k in judges]
    )
    return {k: (one[0], one[1]) for k, one in zip(judges, found, strict=True)}


def look_closer(
    reader: Reader,
    camera: Camera,
    seen: Sequence[Seen],
    progress: Progress,
    both_ways: Mapping[int, BothWays] | None = None,
    *,
    bare: bool = False,
) -> list[Seen]:
    """The corners of each view again, placed by the whole print around them, those that do not fit left out.

    ``bare``: the markers take no part. What is known ``both_ways`` is not worked out again.
    """
    pattern = _pattern(reader)
    if pattern is None:
        return list(seen)
    placed = {k: known[bare] for k, known in (both_ways or {}).items()}
    left = [k for k in range(len(seen)) if k not in placed]
    for k, one in zip(
        left, reader.abreast(lambda k: _closer(reader, pattern, camera, seen[k], (bare,)), left), strict=True
    ):
        placed[k] = one[0]
        progress("placing the corners", len(placed), len(seen))
    return [replace(one, corners=placed[k], around=None) for k, one in enumerate(seen)]


def _pattern(reader: Reader) -> Print | None:
    """What the set's board looks like, where it is one whose print tells corners."""
    board = reader.photoset.board
    return draw_print(board) if isinstance(board, CharucoBoard) else None


def _closer(
    reader: Reader, pattern: Print, camera: Camera, one: Seen, ways: tuple[bool, ...]
) -> list[Corners | None]:
    """One view's corners placed by the print, with the markers or, where a way is True, without; as they are where
    that cannot be done."""
    unchanged = [one.corners] * len(ways)
    fit = fit_pose(camera, one.corners) if one.corners is not None else None
    board = reader.photoset.board
    if fit is None or one.corners is None or not isinstance(board, CharucoBoard):
        return unchanged
    every, square = board_points(board), float(board.square_length)
    around = _around(reader, one, camera.project(fit.pose, every))
    if around is None:
        return unchanged
    if one.view.photos[0].role != "calibration":
        width, height = one.size
        around = around.without(things_mask(reader.photoset, camera, fit.pose, (height, width), _GROW))
    return [
        refined_corners(Template(pattern, square, bare), camera, fit.pose, around, every, one.corners)
        for bare in ways
    ]


def _around(reader: Reader, one: Seen, places: np.ndarray) -> Around | None:
    """The photo about ``places`` (n, 2), from the first look if it was close enough, else read again."""
    if one.around is not None and one.around.holds(places):
        return one.around
    shown = reader.level(one.view)
    return None if shown is None else Around.of(*shown, places)
