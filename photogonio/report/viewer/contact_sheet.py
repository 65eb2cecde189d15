"""Small prints of all photos, with what was found in them drawn on, and what became of each."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import replace

import cv2
import numpy as np

from photogonio.calib.geometry.camera import Camera
from photogonio.calib.remarks import LeftOut
from photogonio.calib.report.overlay import draw_marks, mark_view
from photogonio.calib.setup import Marks, Setup
from photogonio.report.sections import ContactPrint
from photogonio.report.viewer.small_prints import WIDTH

QUALITY = 80
MOST_BYTES = 1_500_000  # of all prints together: more photos are made smaller
EMPTY = 0.16  # of white: a photo that is not at hand


def contact_sheet(
    setup: Setup, left_out: Sequence[LeftOut], prints: Mapping[str, np.ndarray]
) -> tuple[ContactPrint, ...]:
    """The sample's photos in their order, those of the bare board, and those that were left out."""
    out = {one.name: one.reason for one in left_out}
    names = [view.name for view in setup.views if view.name not in out]
    names += [board.name for board in setup.boards if board.name not in names and board.name not in out]
    quality = QUALITY if len(names) <= 40 else 50
    drawn = [_print(setup, name, prints.get(name), quality) for name in names]
    drawn += [_left_out(setup, name, reason, prints.get(name), quality) for name, reason in out.items()]
    size, sheet = 0, []
    for one in drawn:
        size += len(one.jpeg)
        sheet.append(one if size <= MOST_BYTES else replace(one, jpeg=""))
    return tuple(sheet)


def _print(setup: Setup, name: str, small: np.ndarray | None, quality: int) -> ContactPrint:
    camera = _small_camera(setup.camera)
    picture = _fitted(small, camera)
    view = next((view for view in setup.views if view.name == name), None)
    if view is None:
        board = next(board for board in setup.boards if board.name == name)
        draw_marks(picture, _small_marks(board.marks, setup.camera))
        said = f"{len(board.marks.corners)} corners, {board.pose_rms:.2f} px"
        return ContactPrint(name, _jpeg(picture, quality), "board", said)
    marks = None if view.marks is None else _small_marks(view.marks, setup.camera)
    mark_view(picture, replace(setup, camera=camera), replace(view, marks=marks))
    found = [] if view.marks is None else [f"{len(view.marks.corners)} corners"]
    found += [f"{view.pose_rms:.2f} px"] if np.isfinite(view.pose_rms) else []
    return ContactPrint(name, _jpeg(picture, quality), "used", ", ".join([*found, f"light {view.light.id}"]))


def _left_out(setup: Setup, name: str, reason: str, small: np.ndarray | None, quality: int) -> ContactPrint:
    if small is None:
        return ContactPrint(name, "", "left out", reason)
    return ContactPrint(name, _jpeg(_fitted(small, _small_camera(setup.camera)), quality), "left out", reason)


def _small(width: int, height: int) -> tuple[int, int]:
    """Size of a print."""
    return WIDTH, max(1, round(WIDTH * height / width))


def _small_camera(camera: Camera) -> Camera:
    """The camera as if its pictures were prints; the first pixel's centre is (0, 0)."""
    width, height = camera.size
    scale = WIDTH / width
    change = np.array([[scale, 0.0, 0.5 * scale - 0.5], [0.0, scale, 0.5 * scale - 0.5], [0.0, 0.0, 1.0]])
    return Camera(change @ camera.matrix, camera.distortion, _small(width, height))


def _small_marks(marks: Marks, camera: Camera) -> Marks:
    scale = WIDTH / camera.size[0]
    places = ("corners", "rejected_corners", "limb", "highlights", "expected_highlights")
    moved = {name: (getattr(marks, name) + 0.5) * scale - 0.5 for name in places}
    return replace(marks, corner_misses=marks.corner_misses * scale, **moved)


def _fitted(small: np.ndarray | None, camera: Camera) -> np.ndarray:
    """A picture to draw on; of a photo that is not at hand an empty one."""
    width, height = camera.size
    if small is None or small.shape[:2] != (height, width):
        return np.full((height, width, 3), round(255 * EMPTY), np.uint8)
    return small.copy()


def _jpeg(picture: np.ndarray, quality: int) -> str:
    found = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return base64.b64encode(found.tobytes()).decode("ascii")
