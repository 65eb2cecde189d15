"""Are the board's markers where its numbers put them? A drawing of low resolution rounds their edges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from photogonio.calib.detect.first_look import FirstLook
from photogonio.calib.detect.photo_reader import JUDGING
from photogonio.calib.diagnose.base import LookDeparture, Stage
from photogonio.calib.geometry.board import Corners, board_size
from photogonio.capture import robust
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.photoset import CharucoBoard

_SURE = 5.0  # standard errors
_MATTERS = 0.0007  # of a square, by which markers may pull the corners
# pixels by which edges along a row of pixels may all be drawn off, where a pixel is the mean of four samples a side;
# photos from one place share it
_ROW_OF_PIXELS = 0.125
_SAME_PLACE = 0.5  # pixels, mostly, between corners of photos from one place
_FAR = 2.5  # deviations from which on a corner counts for no more
_ROUNDS = 8


class MisplacedMarkers(LookDeparture):
    """Markers that are printed beside where the board's numbers put them."""

    stage = Stage.PLACED
    entries = (
        Entry(
            "markers-misplaced",
            "The markers lie beside where the board's numbers put them, by the same in several photos: corners are "
            "placed by the squares alone.",
            "Print the board anew with its markers in the middle of their squares, or correct `marker_length`.",
            least=_MATTERS,
            sigmas=_SURE,
            source="of a square",
        ),
    )

    def evidence(self, look: FirstLook) -> Sequence[Diagnosis]:
        board = look.photoset.board
        pairs = [(a, b) for a, b in look.both_ways.values() if a is not None and b is not None]
        off = misplaced_markers(board, pairs) if isinstance(board, CharucoBoard) else None
        if off is None:
            return []
        message = (
            f"the board's markers are printed {off:.2g} of a square off their places: corners are placed by the "
            "squares alone; check marker_length, or print the board from a drawing of higher resolution"
        )
        return [Diagnosis("markers-misplaced", message, off, least=_MATTERS, allowed=True)]

    def remedy(self, look: FirstLook, found: Sequence[Diagnosis]) -> FirstLook:
        return replace(look, bare=True)


def misplaced_markers(board: CharucoBoard, pairs: list[tuple[Corners, Corners]]) -> float | None:
    """By how much of a square the markers pull the corners, if surely; None if they do not.

    ``pairs`` hold one photo's corners placed with the markers and without. A marker that is printed beside its place
    pulls all corners around it; over the board that is a shift, a stretch or a turn. How edges fall on pixels pulls
    them too, by a share of a pixel, and alike in all photos of a camera that stands still, which are one.
    """
    pulls = [one for one in (_pull(board, *pair) for pair in pairs) if one is not None]
    if not pulls:
        return None
    places = _by_place(pulls)
    flat, shift = (np.concatenate([place[k] for place in places]) for k in (0, 1))
    middle = board_size(board) / 2
    rows = np.column_stack([np.ones(len(flat)), (flat - middle) / middle])
    pulled, scatter = _robust_plane(rows, shift)
    size = float(np.sqrt(np.mean(pulled**2) * 2))
    sure = scatter * np.sqrt(2 * rows.shape[1] / len(rows))
    drawn = _ROW_OF_PIXELS / (
        board.square_length * float(np.median([one.scale for one in pulls])) * len(places)
    )
    return size if size > max(_SURE * sure, _MATTERS, drawn) else None


@dataclass(frozen=True, slots=True)
class _Pull:
    """What the markers do to the corners of one photo."""

    ids: np.ndarray  # (n,)
    flat: np.ndarray  # (n, 2) on the board
    pixels: np.ndarray  # (n, 2)
    shift: np.ndarray  # (n, 2) of a square
    scale: float  # pixels per length


def _pull(board: CharucoBoard, whole: Corners, bare: Corners) -> _Pull | None:
    """None of a photo with few corners, or whose corners were not placed anew."""
    ids, here, there = np.intersect1d(whole.ids, bare.ids, return_indices=True)
    if len(here) < JUDGING or np.array_equal(whole.pixels[here], bare.pixels[there]):
        return None
    flat, pixels = whole.points[here, :2], bare.pixels[there]
    back, _ = cv2.findHomography(pixels, flat)
    moved, still = (cv2.perspectiveTransform(p[None], back)[0] for p in (whole.pixels[here], pixels))
    spread = [float(np.linalg.norm(p - p.mean(0))) for p in (pixels, flat)]
    return _Pull(ids, flat, pixels, (moved - still) / board.square_length, spread[0] / spread[1])


def _by_place(pulls: Sequence[_Pull]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Corners on the board (n, 2) and their mean shift (n, 2) over the photos from one place, a place at a time."""
    places: list[list[_Pull]] = []
    for one in pulls:
        same = next((place for place in places if _apart(place[0], one) < _SAME_PLACE), None)
        if same is None:
            places.append([one])
        else:
            same.append(one)
    means = []
    for place in places:
        ids = np.concatenate([one.ids for one in place])
        _, first, corner, count = np.unique(ids, return_index=True, return_inverse=True, return_counts=True)
        total = np.zeros((len(first), 2))
        np.add.at(total, corner, np.concatenate([one.shift for one in place]))
        means.append((np.concatenate([one.flat for one in place])[first], total / count[:, None]))
    return means


def _apart(one: _Pull, other: _Pull) -> float:
    """Pixels between the corners of two photos, mostly; infinite if they share none."""
    _, here, there = np.intersect1d(one.ids, other.ids, return_indices=True)
    if not len(here):
        return np.inf
    return float(np.median(np.linalg.norm(one.pixels[here] - other.pixels[there], axis=1)))


def _robust_plane(rows: np.ndarray, shift: np.ndarray) -> tuple[np.ndarray, float]:
    """Fitted shifts (n, 2), corners that are far off counting as if they were at the limit, and the scatter."""
    fitted = rows @ np.linalg.lstsq(rows, shift, rcond=None)[0]
    for _ in range(_ROUNDS):
        limit = _FAR * robust.deviation(shift - fitted)
        fitted = fitted + rows @ np.linalg.lstsq(rows, np.clip(shift - fitted, -limit, limit), rcond=None)[0]
    return fitted, float(robust.deviation(shift - fitted))
