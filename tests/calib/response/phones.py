"""Print under hand-held flash and torch as phones with tone curves of many shapes would code it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from photogonio.calib.geometry.camera import Pose
from photogonio.calib.response.paper_codes import PaperCodes
from photogonio.synthetic.render import tones

FLASH = np.array([13.0, -6.0, -3.0])  # in the camera's frame
INK = 0.05
Tone = Callable[[np.ndarray], np.ndarray]


def within_range(curve: Tone) -> Tone:
    """The curve of light that full scale cuts off."""
    return lambda light: curve(np.clip(light, 0.0, 1.0))


CURVES: dict[str, Tone] = {name: within_range(curve) for name, curve in tones.CURVES.items()}


def looking(eye: np.ndarray, at: np.ndarray, roll: float) -> Pose:
    """A camera at ``eye`` that looks at ``at``, x_cam = rotation x + translation."""
    forward = (at - eye) / np.linalg.norm(at - eye)
    right = np.cross(forward, [np.sin(roll), np.cos(roll), 0.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    return Pose(rotation, -rotation @ eye)


def photos(
    tone: Tone,
    *,
    seed: int = 0,
    count: int = 10,
    channels: int = 3,
    noise: float = 0.15,
    greys: tuple[float, ...] = (),
) -> list[PaperCodes]:
    """Every second one by flash, the others by a torch elsewhere each time; ``noise`` in steps of 8 bits is that of a
    square's mean. What is known of a lamp is some per cent off."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(9) * 20.0 + 10, np.arange(7) * 20.0 + 10)
    ground = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    inner = (np.abs(ground[:, 0] - 90) < 35) & (np.abs(ground[:, 1] - 70) < 28)
    ground = ground[~inner]
    strip = np.column_stack(
        [np.arange(len(greys)) * 30.0 + 15, np.full(len(greys), -8.0), np.zeros(len(greys))]
    )
    points = np.vstack([ground, ground, strip])
    white = np.concatenate([np.repeat([True, False], len(ground)), np.zeros(len(greys), bool)])
    square = np.concatenate([np.tile(np.arange(len(ground)), 2), 1000 + np.arange(len(greys))])
    tone_number = np.concatenate([np.zeros(2 * len(ground), int), 1 + np.arange(len(greys))])
    share = np.concatenate([np.ones(len(ground)), np.full(len(ground), INK), greys])
    middle, found = np.array([90.0, 70.0, 0.0]), []
    for k in range(count):
        pose = looking(middle + _place(rng, 25, 80, (480, 650)), middle, rng.uniform(-0.3, 0.3))
        flash = k % 2 == 0
        lamp = pose.inverse().apply(FLASH) if flash else middle + _place(rng, 22, 75, (380, 520))
        offset = lamp - points
        light = offset[:, 2] / np.linalg.norm(offset, axis=1) ** 3
        exposure = 2.0 ** (np.round(3 * np.log2(rng.uniform(0.45, 0.75) / light.max())) / 3)
        level = exposure * light * share
        code = np.column_stack([tone(level * gain) for gain in (1.0, 0.97, 0.9)[:channels]])
        code = code + rng.normal(0.0, noise / 255, code.shape)
        place = middle + (lamp - middle) * (1 + rng.uniform(-0.06, 0.06))
        found.append(
            PaperCodes(
                points,
                white,
                code,
                np.full(code.shape, noise / 255),
                square,
                tone_number,
                np.zeros(len(points)),
                pose,
                "flash" if flash else f"L{k}",
                place,
                flash,
                exposure,
            )
        )
    return found


def _place(rng: np.random.Generator, low: float, high: float, reach: tuple[float, float]) -> np.ndarray:
    elevation, azimuth = np.radians(rng.uniform(low, high)), rng.uniform(0, 2 * np.pi)
    across = np.cos(elevation)
    return rng.uniform(*reach) * np.array(
        [across * np.cos(azimuth), across * np.sin(azimuth), np.sin(elevation)]
    )
