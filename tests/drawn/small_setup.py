"""A setup of three photos of a ball, with marks, and small pictures of them."""

from __future__ import annotations

import numpy as np

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.remarks import LeftOut
from photogonio.calib.setup import BoardSetup, Light, Marks, Setup, ViewSetup
from photogonio.capture.photoset import MirrorBall, Sphere

CAMERA = Camera(np.array([[900.0, 0, 319.5], [0, 900.0, 239.5], [0, 0, 1]]), np.zeros(0), (640, 480))
CORNERS = np.array([[x, y, 0.0] for x in (0.0, 60.0, 120.0, 180.0) for y in (0.0, 70.0, 140.0)])
SAMPLE = Sphere(np.array([90.0, 70.0, 25.0]), 25.0)


def looking_down(height: float = 600.0) -> Pose:
    """The camera above the sample, its picture's y down the board's."""
    turn = np.diag([1.0, -1.0, -1.0])
    return Pose(turn, -turn @ np.array([90.0, 70.0, height]))


def marks(pose: Pose) -> Marks:
    none = np.zeros((0, 2))
    corners = CAMERA.project(pose, CORNERS)
    return Marks(corners, np.full_like(corners, 0.02), corners[:1] + 9.0, none, none, none)


def small_setup(**more) -> Setup:
    pose = looking_down()
    lamps = [
        Light("near", "point", np.array([300.0, 100.0, 400.0]), np.eye(3), "mirror balls", residual=0.3),
        Light("sun", "directional", np.array([0.0, 0.6, 0.8]), 1e-6 * np.eye(3), "mirror balls"),
    ]
    one = np.ones(3)
    views = [
        ViewSetup(f"sample/{k}.png", lamp, pose, 1e5 * one, 1e3 * one, "white patch", 0.1, None, marks(pose))
        for k, lamp in enumerate(lamps)
    ]
    board = BoardSetup("bare/0.png", looking_down(800.0), 0.1, None, marks(looking_down(800.0)))
    given = {
        "camera": CAMERA,
        "sample": SAMPLE,
        "views": tuple(views),
        "scale": "absolute",
        "channels": ("R", "G", "B"),
        "left_out": (LeftOut("sample/9.png", "no highlight of light sun in any mirror ball"),),
        "mirror_balls": (MirrorBall(np.array([10.0, 10.0, 8.0]), 8.0),),
        "boards": (board,),
        "source": {"command": "photogonio calibrate small", "inputs": {"2 photos": "abc"}},
    }
    return Setup(**given | more)
