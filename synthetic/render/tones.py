"""Curves from linear light to code, as telephones bend them: each from 0 (or a lifted black) to 1, ever rising."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from photogonio.synthetic.scene.phone import ToneCurve

Curve = Callable[[np.ndarray], np.ndarray]


def linear_to_srgb(value: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1, of values from 0."""
    return np.where(value <= 0.0031308, 12.92 * value, 1.055 * np.maximum(value, 1e-9) ** (1 / 2.4) - 0.055)


def bent(strength: float, pivot: float = 0.5) -> Curve:
    """sRGB's code, steeper about a pivot: an odd cubic."""

    def coded(light: np.ndarray) -> np.ndarray:
        code = linear_to_srgb(light)
        return code + 4.0 * strength * code * (1.0 - code) * (code - pivot)

    return coded


def lifted(light: np.ndarray) -> np.ndarray:
    """A black that is none."""
    return 0.02 + 0.98 * bent(0.15)(light)


def rolled(amount: float) -> Curve:
    """Light rolled off before full scale, a rational shoulder."""
    return lambda light: linear_to_srgb(light * (1.0 + amount) / (1.0 + amount * light))


def filmic(light: np.ndarray) -> np.ndarray:
    """Hable's curve (Uncharted 2, 2010), full scale at four times its middle, coded as sRGB."""

    def hable(x: np.ndarray | float) -> np.ndarray | float:
        return (x * (0.22 * x + 0.03) + 0.002) / (x * (0.22 * x + 0.3) + 0.06) - 0.1 / 3.0

    return linear_to_srgb(np.clip((hable(4.0 * light) - hable(0.0)) / (hable(4.0) - hable(0.0)), 0.0, 1.0))


CURVES: dict[str, Curve] = {
    "srgb": linear_to_srgb,
    "gentle": bent(0.15),
    "contrasty": bent(0.35),
    "dark-pivot": bent(0.3, 0.35),
    "flat": bent(-0.2),
    "lifted": lifted,
    "shoulder": rolled(0.6),
    "strong-shoulder": lambda light: bent(0.2)(light * 1.8 / (1.0 + 0.8 * light)),
    "filmic": filmic,
    "power": lambda light: light ** (1.0 / 2.2),
}


def tone_curve(tone: ToneCurve) -> Curve:
    """The curve of a scene, for light from 0 to 1."""
    shape = CURVES[tone.shape]
    return lambda light: (1.0 - tone.strength) * linear_to_srgb(light) + tone.strength * shape(light)
