"""Small worlds whose geometry is exact: a ball and a plane, one camera with a lens, one near lamp."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.setup import Light, Setup, ViewSetup
from photogonio.capture.photoset import MirrorBall, Plane, Sphere, WhitePatch
from photogonio.capture.radiance import RadianceImage
from photogonio.reconstruct.reduce.directions import ReduceOptions

LENS = np.array([-0.13, 0.09, 6e-4, -4e-4, 0.0])


@dataclass(frozen=True)
class World:
    setup: Setup
    options: ReduceOptions

    @property
    def view(self) -> ViewSetup:
        return self.setup.views[0]

    def photo(self, value: np.ndarray, sigma: float = 0.0) -> RadianceImage:
        """A photo of the given radiance, everywhere valid."""
        value = np.ascontiguousarray(value, np.float32)
        good = np.ones(value.shape[:2], bool)
        return RadianceImage(value, np.full(value.shape, sigma**2, np.float32), good, ~good)


def look_at(eye: np.ndarray, target: np.ndarray) -> Pose:
    z = (target - eye) / np.linalg.norm(target - eye)
    x = np.cross(z, [0.1, 0.2, 1.0])
    x /= np.linalg.norm(x)
    rotation = np.stack([x, np.cross(z, x), z])
    return Pose(rotation, -rotation @ eye)


def make_world(kind: str, *, channels: int = 3, light: str = "point", scale: float = 1.0) -> World:
    size = (int(240 * scale), int(180 * scale))
    focal = 560.0 * scale
    matrix = np.array([[focal, 0, size[0] / 2 - 3.3], [0, 1.002 * focal, size[1] / 2 + 2.1], [0, 0, 1]])
    if kind == "ball":
        sample, middle = Sphere(np.array([90.0, 70.0, 25.0]), 25.0), np.array([90.0, 70.0, 25.0])
    else:
        outline = np.array([[55.0, 42], [125, 42], [125, 98], [55, 98]])
        sample, middle = Plane(outline, 0.5), np.array([90.0, 70.0, 0.5])
    place = np.array([190.0, -60.0, 300.0])
    if light == "directional":
        place = place / np.linalg.norm(place)
    lamp = Light("L", light, place, np.zeros((3, 3)), "given", 7.0)
    strength = np.linspace(0.8, 1.2, channels) * (9e4 if light == "point" else 1.0)
    view = ViewSetup(
        "s0.png", lamp, look_at(np.array([60.0, -90.0, 230.0]), middle), strength, 0 * strength, "white patch"
    )
    names = tuple("RGB"[:channels]) if channels <= 3 else tuple(f"C{k}" for k in range(channels))
    balls = (MirrorBall(np.array([118.0, 44.0, 8.0]), 8.0), MirrorBall(np.array([10.0, 10.0, 8.0]), 8.0))
    patches = (WhitePatch(np.array([[50.0, 80], [70, 80], [70, 110], [50, 110]]), 2.0, (0.9,)),)
    setup = Setup(Camera(matrix, LENS, size), sample, (view,), "absolute", names)
    return World(setup, ReduceOptions(mirror_balls=balls, white_patches=patches))


@pytest.fixture
def world():
    return make_world
