"""A ball of a material under a distant light, and linear radiance made ready for a screen."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from photogonio.capture.linear.encoding import linear_to_srgb

Evaluate = Callable[[np.ndarray, np.ndarray], np.ndarray]  # incident, exit (n, 3) -> f (n, c)


def _toward(x: float, y: float, z: float) -> np.ndarray:
    return np.array([x, y, z]) / np.sqrt(x * x + y * y + z * z)


# x right, y up, z toward the viewer
BALL_LIGHTS = {
    "over the shoulder": _toward(-0.5, 0.6, 1.0),
    "from the side": _toward(-1.0, 0.3, 0.15),
    "from behind": _toward(0.35, 0.6, -0.7),
}


def shaded_sphere(evaluate: Evaluate, light: np.ndarray, *, size: int = 256) -> np.ndarray:
    """Radiance (size, size, c) of a ball seen from afar under a distant light of irradiance pi, else NaN.

    ``light`` is the unit vector toward the light, x right, y up, z toward the viewer.
    """
    step = (np.arange(size) + 0.5) / size * 2.0 - 1.0
    x, y = np.meshgrid(step, -step)
    inside = x**2 + y**2 < 1.0
    normal = np.column_stack([x[inside], y[inside], np.sqrt(1.0 - x[inside] ** 2 - y[inside] ** 2)])
    cosine = normal @ light
    lit = cosine > 0
    incident, exit = _tangent(normal[lit], light)
    f = evaluate(incident, exit)
    ball = np.zeros((len(normal), f.shape[1]))
    ball[lit] = np.pi * np.maximum(f, 0.0) * cosine[lit, None]
    image = np.full((size, size, f.shape[1]), np.nan)
    image[inside] = ball
    return image


def _tangent(normal: np.ndarray, light: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The light and the viewer (0, 0, 1) in each normal's frame, whose x axis lies along the world's x."""
    x = np.array([1.0, 0.0, 0.0]) - normal[:, :1] * normal
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(normal, x)
    toward, viewer = (
        np.column_stack([x @ v, y @ v, normal @ v]) for v in (np.asarray(light), np.array([0.0, 0.0, 1.0]))
    )
    return toward, viewer


def to_display(radiance: np.ndarray, *, white: float | None = None, background: float = 0.97) -> np.ndarray:
    """sRGB (h, w, 3), 0 to 1, of linear radiance (h, w, c); ``white`` maps to 1 (default: 99.5 % quantile).

    One channel is shown grey; of more than three the first three are shown.
    """
    c = radiance.shape[2]
    rgb = radiance[..., [0, 1, 2]] if c >= 3 else np.repeat(radiance.mean(2, keepdims=True), 3, 2)
    outside = ~np.isfinite(rgb).all(2)
    if white is None:
        white = max(float(np.nanquantile(rgb, 0.995)), 1e-12)
    linear = np.clip(np.nan_to_num(rgb) / white, 0.0, 1.0)
    display = linear_to_srgb(linear)
    display[outside] = background
    return display
