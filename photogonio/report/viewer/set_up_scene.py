"""The set-up as a browser draws it: board, sample, mirror balls, cameras and lamps."""

from __future__ import annotations

import numpy as np

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.setup import Setup
from photogonio.capture.photoset import Sphere

DIGITS = 3  # of places, relative to the scene's size


def set_up_scene(setup: Setup) -> dict[str, object]:
    """Places in the board's frame, divided by the ``unit`` so that what lies near the sample is about 1 in size."""
    middle = _middle(setup)
    board = _board(setup)
    corners = board if len(board) else middle[None] + [[-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]]
    unit = max(float(np.ptp(corners[:, :2], axis=0).max()), 1e-9)

    def placed(points: np.ndarray) -> list:
        return np.round((np.asarray(points, float) - middle) / unit, DIGITS + 1).tolist()

    lamps = {view.light.id: view.light for view in setup.views}
    return {
        "board": placed(board),
        "sample": _sample(setup, placed, unit),
        "balls": [[*placed(ball.center), round(ball.radius / unit, 5)] for ball in setup.mirror_balls],
        "cameras": [_camera(setup.camera, view.pose, placed) for view in setup.views],
        "boards": [_camera(setup.camera, view.pose, placed) for view in setup.boards],
        "lamps": [
            {"far": True, "at": np.round(light.place, DIGITS).tolist()}
            if light.kind == "directional"
            else {"far": False, "at": placed(light.place)}
            for light in lamps.values()
        ],
    }


def _middle(setup: Setup) -> np.ndarray:
    sample = setup.sample
    if isinstance(sample, Sphere):
        return np.asarray(sample.center, float)
    return np.append(np.mean(np.asarray(sample.outline, float), axis=0), sample.height)


def _sample(setup: Setup, placed, unit: float) -> dict[str, object]:
    sample = setup.sample
    if isinstance(sample, Sphere):
        return {"ball": [*placed(sample.center), round(sample.radius / unit, 5)]}
    outline = np.asarray(sample.outline, float)
    return {"outline": placed(np.column_stack([outline, np.full(len(outline), sample.height)]))}


def _board(setup: Setup) -> np.ndarray:
    """(4, 3) corners of the smallest upright rectangle that holds all corners of the print that photos show."""
    found = [
        _on_ground(setup.camera, view.pose, view.marks.corners)
        for some in (setup.views, setup.boards)
        for view in some
        if view.marks is not None and len(view.marks.corners)
    ]
    if not found:
        return np.zeros((0, 3))
    points = np.vstack(found)
    (x0, y0), (x1, y1) = np.percentile(points, 1.0, axis=0), np.percentile(points, 99.0, axis=0)
    return np.array([[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]])


def _on_ground(camera: Camera, pose: Pose, pixels: np.ndarray) -> np.ndarray:
    """(n, 2) where the board's plane is seen at pixels (n, 2), but for the lens's distortion."""
    rays = np.column_stack([pixels, np.ones(len(pixels))]) @ np.linalg.inv(camera.matrix).T @ pose.rotation
    centre = pose.center
    return (centre - rays * (centre[2] / rays[:, 2:]))[:, :2]


def _camera(camera: Camera, pose: Pose, placed) -> dict[str, object]:
    """Where it stands, and the four corners of its view, as directions."""
    width, height = camera.size
    corners = np.array([[0, 0, 1], [width, 0, 1], [width, height, 1], [0, height, 1]], float)
    rays = corners @ np.linalg.inv(camera.matrix).T @ pose.rotation
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return {"at": placed(pose.center), "view": np.round(rays, DIGITS).tolist()}
