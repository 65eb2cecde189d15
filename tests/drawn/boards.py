"""A board as a camera sees it, drawn by following every pixel's rays to the paper; nothing of the detector's."""

from functools import cache
from pathlib import Path

import cv2
import numpy as np

from photogonio.calib.detect.photo_reader import Reader
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.capture.photoset import Board, CharucoBoard, Photo, PhotoSet, Sphere, View
from photogonio.capture.radiance import RadianceImage

BOARD = CharucoBoard("DICT_4X4_50", squares=(8, 6), square_length=12.0, marker_length=9.0)
SIZE = (480, 360)
CAMERA = Camera(
    np.array([[700.0, 0, 243.2], [0, 703.0, 176.7], [0, 0, 1]]),
    np.array([-0.1, 0.06, 4e-4, -3e-4, 0.0]),
    SIZE,
)
_SCALE = 80  # pixels of the pattern a square: markers, their cells and gaps are whole numbers of them
_RAYS = 4  # a side of each pixel
BLACK, WHITE = 0.04, 0.8


@cache
def pattern(scale: int = _SCALE) -> np.ndarray:
    """The print seen from the front, upright, (h, w) float32."""
    marks = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    made = cv2.aruco.CharucoBoard(BOARD.squares, BOARD.square_length, BOARD.marker_length, marks)
    size = tuple(scale * n for n in BOARD.squares)
    return np.where(made.generateImage(size, marginSize=0) > 127, WHITE, BLACK).astype(np.float32)


def looking_at(eye: np.ndarray, target: np.ndarray, roll: float = 0.0) -> Pose:
    """The pose of a camera at ``eye`` that has ``target`` on its axis and world y up, then rolled."""
    axis = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(axis, [0, 1.0, 0])
    right /= np.linalg.norm(right)
    turn = np.stack([right, np.cross(axis, right), axis])
    spin = Pose.from_rodrigues(np.array([0, 0, roll]), np.zeros(3)).rotation
    return Pose(spin @ turn, -spin @ turn @ eye)


def plane_points(camera: Camera, pose: Pose, height: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Where rays of every pixel's parts meet the plane z = height, two (rays, h, w) arrays of world x and y."""
    width, rows = camera.size
    x, y = np.meshgrid(np.arange(float(width)), np.arange(float(rows)))
    rays = camera.rays(np.column_stack([x.ravel(), y.ravel()]))
    flat = (rays[:, :2] / rays[:, 2:]).reshape(rows, width, 2)
    down, across = np.gradient(flat, axis=(0, 1))
    toward, aside, below = (
        np.ascontiguousarray(np.moveaxis(part @ pose.rotation[:2], 2, 0)) for part in (flat, across, down)
    )
    toward += pose.rotation[2][:, None, None]
    eye, line = pose.center, (np.arange(_RAYS) + 0.5) / _RAYS - 0.5
    found = np.empty((2, _RAYS, _RAYS, rows, width))
    for i, dy in enumerate(line):
        for j, dx in enumerate(line):
            world = toward + dx * aside + dy * below
            reach = (height - eye[2]) / world[2]
            for k in range(2):
                found[k, i, j] = eye[k] + reach * world[k]
    return found[0].reshape(-1, rows, width), found[1].reshape(-1, rows, width)


def draw(
    camera: Camera, pose: Pose, noise: float, seed: int, *, scale: int = _SCALE, stretch: float = 1.0
) -> np.ndarray:
    """Linear radiance (h, w) of the board on a mid-gray table, each pixel the mean over its square.

    ``scale`` are pixels of the print a square, ``stretch`` how much taller it is than it should be.
    """
    x, y = plane_points(camera, pose)
    print_ = pattern(scale)
    column = (x * scale / BOARD.square_length - 0.5).astype(np.float32)
    row = (print_.shape[0] - y / stretch * scale / BOARD.square_length - 0.5).astype(np.float32)
    parts = [
        cv2.remap(print_, c, r, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=WHITE)
        for c, r in zip(column, row, strict=True)
    ]
    image = np.mean(parts, axis=0)
    return image + noise * np.random.default_rng(seed).normal(size=image.shape)


def radiance(level: np.ndarray, noise: float, channels: int = 1) -> RadianceImage:
    """A picture without blemish."""
    value = np.repeat(level[..., None], channels, axis=2).astype(np.float32)
    clear = np.ones(level.shape, bool)
    return RadianceImage(value, np.full_like(value, max(noise, 1e-5) ** 2), clear, ~clear)


def reader_of(board: Board, images: dict[str, RadianceImage]) -> Reader:
    """Photos held in memory, all of role "calibration"."""
    photos = tuple(Photo(name, "calibration") for name in images)
    sample = Sphere(np.array([0, 0, 1.0]), 1.0)
    photoset = PhotoSet(Path("."), "drawn", "mm", sample, "auto", photos, board)
    return Reader(photoset, lambda _, view: images[view.name])


def views_of(reader: Reader) -> tuple[View, ...]:
    return reader.photoset.views("calibration")


def quiet(label: str, done: int, total: int) -> None:
    """Nobody is told of progress."""
