"""Has the board as many rows as the manifest says? Else its origin, and with it all places, lie elsewhere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogonio.calib.adjust.state import State
from photogonio.calib.detect.observation import Posed
from photogonio.calib.diagnose.base import Departure, Stage
from photogonio.calib.geometry.board import marker_middles
from photogonio.calib.geometry.camera import Camera
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.photoset import Board, CharucoBoard, LooseMarkers

_PHOTOS = 3  # in which markers are missing, or seen, that tell of rows
_INSIDE = 0.75  # of a marker's side around its middle, that must be in the picture


class BoardRows(Departure):
    """A board of more or fewer rows than the manifest says."""

    stage = Stage.CAMERA
    entries = (
        Entry(
            "board-rows",
            "Markers are missing in all photos, or seen, as of a board of fewer or more rows than the manifest's: its "
            "origin lies elsewhere then, and all places are off by as much.",
            "Correct `board.squares`, or `board.markers`.",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        board = state.photoset.board
        if board is None:
            return []
        lamps = {number for entry in state.photoset.lights for number in entry.marker_ids}
        said = board_doubts(board, state.camera, state.boards, lamps)
        return [Diagnosis("board-rows", words) for words in said]


def board_doubts(board: Board, camera: Camera, boards: Sequence[Posed], others: set[int]) -> list[str]:
    """A board of more or fewer rows than the manifest says, which puts its origin elsewhere: markers that no photo
    shows where it should, or that it has not; ``others`` are on lamps."""
    if isinstance(board, LooseMarkers) or not boards:
        return []
    ids, places = marker_middles(board)
    every = np.concatenate([corners.marker_ids for _, corners, _ in boards])
    if not np.isin(every, ids).any():
        return []
    size = "squares" if isinstance(board, CharucoBoard) else "markers"
    unseen = ids > every[np.isin(every, ids)].max(initial=-1)
    said = []
    if unseen.any():
        around = _INSIDE * board.marker_length * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
        reach = (places[unseen][:, None] + around).reshape(-1, 3)
        shown = [camera.project(pose, reach) for _, _, pose in boards]
        inside = [bool(((p > 0) & (p < np.array(camera.size) - 1)).all()) for p in shown]
        if sum(inside) >= _PHOTOS:
            said.append(
                f"markers {ids[unseen].min()} to {ids.max()} of the board are seen in none of {sum(inside)} photos "
                f"that reach so far: if it has fewer rows than board.{size} says, all places are off by as much"
            )
    more = [
        k for k in np.unique(every[every > ids.max()]) if k not in others and (every == k).sum() >= _PHOTOS
    ]
    if more:
        said.append(
            f"markers {more[0]} to {more[-1]} are seen, which the board has not: if it has more rows than board.{size} "
            "says, all places are off by as much"
        )
    return said
