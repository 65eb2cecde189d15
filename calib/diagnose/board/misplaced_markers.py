"""Are the board's markers where its numbers put them? A drawing of low resolution rounds their edges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

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
    pulls all corners around it; over the board that is a shift, a stretch or a turn.
    """
    design, off = [], []
    middle = board_size(board) / 2
    for whole, bare in pairs:
        _, here, there = np.intersect1d(whole.ids, bare.ids, return_indices=True)
        if len(here) < JUDGING or np.array_equal(whole.pixels[here], bare.pixels[there]):
            continue
        flat = whole.points[here, :2]
        back, _ = cv2.findHomography(bare.pixels[there], flat)
        moved = cv2.perspectiveTransform(whole.pixels[here][None], back)[0]
        off.append(
            (moved - cv2.perspectiveTransform(bare.pixels[there][None], back)[0]) / board.square_length
        )
        design.append(np.column_stack([np.ones(len(here)), (flat - middle) / middle]))
    if not off:
        return None
    rows, shift = np.concatenate(design), np.concatenate(off)
    values = np.linalg.lstsq(rows, shift, rcond=None)[0]
    scatter = robust.deviation(shift - rows @ values)
    sure = scatter * np.sqrt(values.size / len(rows))
    size = float(np.sqrt(np.mean((rows @ values) ** 2) * 2))
    return size if size > max(_SURE * sure, _MATTERS) else None
