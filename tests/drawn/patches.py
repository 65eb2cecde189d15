"""A white patch and paper under a lamp, drawn from the definition of irradiance; readings of several photos."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from photogonio.calib.detect.paper import PaperSamples
from photogonio.calib.detect.paper_reading import PaperReading as Paper
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.radiometry.patch import Stray, Strength, read_patch
from photogonio.calib.radiometry.readings import StrengthReadings
from photogonio.calib.radiometry.scale import tie
from photogonio.calib.remarks import Remarks
from photogonio.calib.setup import Light
from photogonio.capture.photoset import PhotoSet, Sphere, WhitePatch
from photogonio.capture.radiance import RadianceImage
from tests.drawn.boards import looking_at, plane_points, radiance

SIZE = (320, 240)
CAMERA = Camera(
    np.array([[500.0, 0, 158.0], [0, 505.0, 121.0], [0, 0, 1]]),
    np.array([-0.1, 0.05, 3e-4, -2e-4, 0.0]),
    SIZE,
)


HEIGHT = 1.5
PATCH = WhitePatch(np.array([[-30.0, -25], [30, -25], [30, 25], [-30, 25]]), HEIGHT, (0.9, 0.8, 0.7))
POSE = looking_at(np.array([40.0, -120, 150]), np.array([0.0, 0, HEIGHT]))
STRENGTH = np.array([3e4, 2e4, 1e4])
NEAR = Light("near", "point", np.array([60.0, 35, 90]), np.zeros((3, 3)), "given")
FAR = Light("far", "directional", np.array([0.48, 0.36, 0.8]), np.zeros((3, 3)), "given")
NOISE = 0.002


def lit_by(light: Light, height: float = HEIGHT) -> np.ndarray:
    """Irradiance (h, w) for unit strength where each pixel meets the plane, from the definition."""
    x, y = plane_points(CAMERA, POSE, height)
    if light.kind == "directional":
        return np.full(x.shape[1:], light.place[2])
    offset = light.place - np.stack([x, y, np.full_like(x, height)], axis=-1)
    return (offset[..., 2] / np.linalg.norm(offset, axis=-1) ** 3).mean(0)


def photo(light: Light) -> RadianceImage:
    """The patch's plane, Lambert, filling the picture, with one part in 500 of noise."""
    shape = lit_by(light)[..., None] * STRENGTH * np.array(PATCH.reflectance) / np.pi
    noise = NOISE * shape.mean(axis=(0, 1))
    value = shape + noise * np.random.default_rng(3).normal(size=shape.shape)
    blank = radiance(shape[..., 0], 0.0, 3)
    variance = np.broadcast_to(noise**2, shape.shape).astype(np.float32)
    return replace(blank, value=value.astype(np.float32), variance=variance)


def read(image: RadianceImage, light: Light, stray: Stray | None = None) -> Strength:
    return read_patch(image, CAMERA, POSE, light, PATCH, stray)


def paper(light: Light, white: float, black: float) -> Paper:
    """Paper on the board's plane with the light's own irradiance."""
    x, y = np.meshgrid(np.linspace(-60, 60, 40), np.linspace(-60, 60, 40))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    toward, falloff = light.toward(points)
    square = (points[:, 0] // 12 + 11 * (points[:, 1] // 12)).astype(int)
    pale = square % 2 == 0
    value = (toward[:, 2] * falloff * np.where(pale, white, black))[:, None] * STRENGTH / np.pi
    return Paper(PaperSamples(points, pale, value, (0.01 * value) ** 2, square), value.mean(1), value[:, 0])


PAPER = np.array([0.85, 0.84, 0.8]) / np.pi
SET = PhotoSet(
    Path("."), "drawn", "mm", Sphere(np.array([0, 0, 20.0]), 20.0), "auto", (), white_patches=(PATCH,)
)


def strength(value: np.ndarray) -> Strength:
    return Strength(value, 0.003 * value, np.zeros(3))


def told(strengths: dict[str, np.ndarray]) -> dict[str, StrengthReadings]:
    return {
        n: StrengthReadings(strength(s), strength(s * PAPER), strength(0.05 * s * PAPER))
        for n, s in strengths.items()
    }


def tied(readings: dict[str, StrengthReadings], photoset: PhotoSet = SET):
    remarks = Remarks()
    lights = dict.fromkeys(readings, FAR)
    given = dict.fromkeys(readings, np.ones(3))
    values, scale = tie(photoset, readings, lights, given, remarks)
    return values, scale, remarks


STRENGTHS = {f"{k}.png": STRENGTH * (1 + 0.4 * k) for k in range(6)}
