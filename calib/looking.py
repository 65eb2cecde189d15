"""What one look at each photo yields: its corners. Photos are read through a small cache."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, replace

from calib.board import Corners, board_points, find_corners
from calib.camera import Camera
from calib.masks import things_mask
from calib.paper import draw_print
from calib.pose import fit_pose
from calib.register import refined_corners
from calib.tone import detection_image, fine_image, finite, gray, without_fireflies
from capture.errors import InputError
from capture.photoset import PhotoSet, View
from capture.radiance import RadianceImage

ReadRadiance = Callable[[PhotoSet, View], RadianceImage]
Progress = Callable[[str, int, int], None]

_CACHE_BYTES = 1_200_000_000
_GROW = 3  # pixels kept clear around whatever stands on the board


class Reader:
    """Reads views' radiance, keeping the latest while they fit in memory; remembers which could not be read."""

    def __init__(self, photoset: PhotoSet, read_radiance: ReadRadiance):
        self.photoset = photoset
        self.failed: dict[str, str] = {}
        self._read = read_radiance
        self._kept: OrderedDict[str, RadianceImage] = OrderedDict()
        self._bytes = 0

    def __call__(self, view: View) -> RadianceImage | None:
        """The view's radiance; None if it cannot be read, the reason then being in ``failed``."""
        if view.name in self.failed:
            return None
        if view.name in self._kept:
            self._kept.move_to_end(view.name)
            return self._kept[view.name]
        try:
            image = self._read(self.photoset, view)
        except InputError as error:
            self.failed[view.name] = str(error)
            return None
        self._kept[view.name] = image
        self._bytes += _size(image)
        while self._bytes > _CACHE_BYTES and len(self._kept) > 1:
            _, old = self._kept.popitem(last=False)
            self._bytes -= _size(old)
        return image


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
    for k, view in enumerate(views):
        image = reader(view)
        if image is not None:
            corners = None
            if reader.photoset.board is not None:
                level = without_fireflies(gray(image))
                corners = find_corners(reader.photoset.board, detection_image(level), fine_image(level))
            seen.append(Seen(view, corners, (image.value.shape[1], image.value.shape[0])))
        progress(label, k + 1, len(views))
    return seen


def look_closer(reader: Reader, camera: Camera, seen: list[Seen], progress: Progress) -> list[Seen]:
    """The corners of each view again, placed by the whole print around them, those that do not fit left out."""
    board = reader.photoset.board
    pattern = draw_print(board) if board is not None else None
    if pattern is None:
        return seen
    every = board_points(board) if board.kind == "charuco" else None
    closer = []
    for k, one in enumerate(seen):
        fit = fit_pose(camera, one.corners) if one.corners is not None else None
        image = reader(one.view)
        if fit is None or image is None or every is None:
            closer.append(one)
            continue
        usable = ~image.saturated & finite(image)
        if one.view.photos[0].role != "calibration":
            shape = usable.shape
            usable &= ~things_mask(reader.photoset, camera, fit.pose, shape, _GROW)
        level = gray(image)
        corners = refined_corners(
            pattern, camera, fit.pose, level, usable, every, float(board.square_length), one.corners
        )
        closer.append(replace(one, corners=corners))
        progress("placing the corners", k + 1, len(seen))
    return closer
