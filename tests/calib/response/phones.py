"""Print under hand-held flash and torch as phones with tone curves of many shapes would code it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from photogonio.calib.geometry.camera import Pose
from photogonio.calib.response.paper_codes import PaperCodes
from photogonio.capture.linear.encoding import linear_to_srgb

FLASH = np.array([13.0, -6.0, -3.0])  # in the camera's frame
INK = 0.05
Tone = Callable[[np.ndarray], np.ndarray]


def s_curve(strength: float, pivot: float = 0.5) -> Tone:
    """Steeper about the pivot, an odd cubic of the sRGB code."""

    def coded(light: np.ndarray) -> np.ndarray:
        code = linear_to_srgb(np.clip(light, 0.0, 1.0))
        return code + strength * code * (1 - code) * (code - pivot) * 4

    return coded


def lifted(base: Tone, toe: float) -> Tone:
    return lambda light: toe + (1 - toe) * base(light)


def shoulder(amount: float) -> Tone:
    """Light rolled off before full scale."""
    return lambda light: linear_to_srgb(light * (1 + amount) / (1 + amount * light))


def filmic(light: np.ndarray) -> np.ndarray:
    """Hable's curve, which many programs take, coded as sRGB."""

    def hable(x: np.ndarray) -> np.ndarray:
        return (x * (0.22 * x + 0.03) + 0.002) / (x * (0.22 * x + 0.3) + 0.06) - 0.1 / 3

    return linear_to_srgb(
        np.clip((hable(4 * light) - hable(0.0 * light)) / (hable(4.0) - hable(0.0)), 0.0, 1.0)
    )


CURVES: dict[str, Tone] = {
    "srgb": linear_to_srgb,
    "gentle": s_curve(0.15),
    "contrasty": s_curve(0.35),
    "dark pivot": s_curve(0.3, 0.35),
    "flat": s_curve(-0.2),
    "lifted": lifted(s_curve(0.15), 0.02),
    "shoulder": shoulder(0.6),
    "strong shoulder": lambda light: s_curve(0.2)(light * 1.8 / (1 + 0.8 * light)),
    "filmic": filmic,
    "gamma 2.2": lambda light: np.clip(light, 0.0, 1.0) ** (1 / 2.2),
}


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
