"""What one look at each photo yields: its corners. Photos are read through a small cache."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from threading import Lock

import numpy as np

from calib.abreast import Found, Item, abreast
from calib.board import Corners, board_points, find_corners
from calib.camera import Camera
from calib.masks import things_mask
from calib.misprint import judging_photos, misplaced_markers, misprint_warning
from calib.pattern import Print, draw_print
from calib.pose import fit_pose
from calib.register import refined_corners
from calib.tone import detection_image, fine_image, finite, gray, without_fireflies
from capture.errors import InputError
from capture.photoset import PhotoSet, View
from capture.radiance import RadianceImage
from capture.signal import Region, Windows

ReadRadiance = Callable[[PhotoSet, View], RadianceImage]
ReadLevel = Callable[[View], tuple[np.ndarray, np.ndarray]]  # gray (h, w) float32, not saturated (h, w) bool
ReadPart = Callable[[View, Region | Windows], RadianceImage]
Progress = Callable[[str, int, int], None]

_CACHE_BYTES = 250_000_000  # a few small photos; large ones are read again
_GROW = 3  # pixels kept clear around whatever stands on the board


class Reader:
    """Reads views' radiance, keeping the latest while they are small; remembers which could not be read.

    Several threads may use it.
    """

    def __init__(
        self,
        photoset: PhotoSet,
        read_radiance: ReadRadiance,
        read_part: ReadPart | None = None,
        read_level: ReadLevel | None = None,
        workers: int = 1,
    ):
        """``read_part`` and ``read_level`` read less of a view at less cost; ``workers`` are looked at side by side."""
        self.photoset = photoset
        self.failed: dict[str, str] = {}
        self.workers = workers
        self._read, self._read_part, self._read_level = read_radiance, read_part, read_level
        self._kept: OrderedDict[str, RadianceImage] = OrderedDict()
        self._bytes = 0
        self._lock = Lock()

    def __call__(self, view: View) -> RadianceImage | None:
        """The view's radiance; None if it cannot be read, the reason then being in ``failed``."""
        if view.name in self.failed:
            return None
        with self._lock:
            if view.name in self._kept:
                self._kept.move_to_end(view.name)
                return self._kept[view.name]
        try:
            image = self._read(self.photoset, view)
        except InputError as error:
            self.failed[view.name] = str(error)
            return None
        self._keep(view.name, image)
        return image

    def level(self, view: View) -> tuple[np.ndarray, np.ndarray] | None:
        """Gray radiance (h, w) and the pixels that may be used (h, w) bool; None if the view cannot be read."""
        if self._read_level is None or view.name in self.failed or view.name in self._kept:
            image = self(view)
            return None if image is None else (gray(image), ~image.saturated & finite(image))
        try:
            return self._read_level(view)
        except InputError as error:
            self.failed[view.name] = str(error)
            return None

    def part(self, view: View, region: Region | Windows) -> RadianceImage | None:
        """The radiance of a region ``[x0, x1) x [y0, y1)``; None if the view cannot be read."""
        if self._read_part is None or view.name in self.failed or view.name in self._kept:
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
        if self._read_part is not None and view.name not in self._kept:
            return self.part(view, windows)
        image = self(view)
        if image is None:
            return None
        planes = (image.value, image.variance, image.valid, image.saturated)
        return RadianceImage(*(windows.of(plane) for plane in planes))

    def abreast(self, task: Callable[[Item], Found], items: Sequence[Item]) -> Iterator[Found]:
        """:func:`calib.abreast.abreast` with this reader's workers."""
        return abreast(task, items, self.workers)

    def _keep(self, name: str, image: RadianceImage) -> None:
        with self._lock:
            if name in self._kept or _size(image) > _CACHE_BYTES:
                return
            self._kept[name] = image
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


def look(reader: Reader, views: tuple[View, ...], progress: Progress, label: str) -> list[Seen]:
    """Find the board in each view that can be read."""
    seen = []
    for k, one in enumerate(reader.abreast(lambda view: _look_at(reader, view), views)):
        if one is not None:
            seen.append(one)
        progress(label, k + 1, len(views))
    return seen


def _look_at(reader: Reader, view: View) -> Seen | None:
    shown = reader.level(view)
    if shown is None:
        return None
    height, width = shown[0].shape
    corners = None
    if reader.photoset.board is not None:
        level = without_fireflies(shown[0])
        corners = find_corners(reader.photoset.board, detection_image(level), fine_image(level))
    return Seen(view, corners, (width, height))


def look_closer(
    reader: Reader,
    camera: Camera,
    seen: list[Seen],
    progress: Progress,
    warn: Callable[[str], None] | None = None,
) -> list[Seen]:
    """The corners of each view again, placed by the whole print around them, those that do not fit left out.

    Where a few photos show that the markers are not where the board's numbers put them, they take no part, and
    ``warn`` is told.
    """
    board = reader.photoset.board
    pattern = draw_print(board) if board is not None and board.kind == "charuco" else None
    if board is None or pattern is None:
        return seen
    judges = judging_photos([0 if one.corners is None else len(one.corners) for one in seen])
    both = [(False, True) if k in judges else (False,) for k in range(len(seen))]
    tasks = list(zip(seen, both, strict=True))
    found = []
    for k, one in enumerate(reader.abreast(lambda t: _closer(reader, pattern, camera, *t), tasks)):
        found.append(one)
        progress("placing the corners", k + 1, len(seen))
    pairs = [(found[k][0], found[k][-1]) for k in judges]
    off = misplaced_markers(board, [(a, b) for a, b in pairs if a is not None and b is not None])
    if off is None:
        return [replace(one, corners=placed[0]) for one, placed in zip(seen, found, strict=True)]
    if warn is not None:
        warn(misprint_warning(off))
    again = reader.abreast(lambda one: _closer(reader, pattern, camera, one, (True,)), seen)
    return [replace(one, corners=placed[0]) for one, placed in zip(seen, again, strict=True)]


def _closer(
    reader: Reader, pattern: Print, camera: Camera, one: Seen, ways: tuple[bool, ...]
) -> list[Corners | None]:
    """One view's corners placed by the print, with the markers or, where a way is True, without; as they are where
    that cannot be done."""
    unchanged = [one.corners] * len(ways)
    fit = fit_pose(camera, one.corners) if one.corners is not None else None
    if fit is None or one.corners is None:
        return unchanged
    shown = reader.level(one.view)
    if shown is None:
        return unchanged
    level, usable = shown
    if one.view.photos[0].role != "calibration":
        usable = usable & ~things_mask(reader.photoset, camera, fit.pose, usable.shape, _GROW)
    board = reader.photoset.board
    every, square = board_points(board), float(board.square_length)
    return [
        refined_corners(pattern, camera, fit.pose, level, usable, every, square, one.corners, bare=bare)
        for bare in ways
    ]
