"""A tiny photo set that needs no rendering: a matte ball under given distant lights, a camera of given place."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

WIDTH, HEIGHT, FOCAL, DISTANCE, RADIUS, ALBEDO = 160, 120, 400.0, 200.0, 25.0, 0.6
LIGHTS = (
    (0.0, 0.0),
    (50.0, 0.0),
    (50.0, 90.0),
    (50.0, 180.0),
    (50.0, 270.0),
    (75.0, 45.0),
)  # theta, phi, degrees

CAMERA = f"""
[camera]
matrix = [[{FOCAL}, 0, {(WIDTH - 1) / 2}], [0, {FOCAL}, {(HEIGHT - 1) / 2}], [0, 0, 1]]
rotation = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]
translation = [0, 0, {DISTANCE}]
"""


def toward(theta: float, phi: float) -> np.ndarray:
    t, p = np.radians([theta, phi])
    return np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])


def ball_photo(light: np.ndarray) -> np.ndarray:
    """Radiance (h, w) of the ball seen from above, pinhole, for irradiance 1: exact at the pixels' middles."""
    x, y = np.meshgrid(np.arange(WIDTH) - (WIDTH - 1) / 2, np.arange(HEIGHT) - (HEIGHT - 1) / 2)
    ray = np.stack([x / FOCAL, -y / FOCAL, -np.ones_like(x)], -1)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    eye = np.array([0.0, 0.0, DISTANCE])
    along = ray @ eye
    root = along**2 - (eye @ eye - RADIUS**2)
    depth = -along - np.sqrt(np.maximum(root, 0))
    normal = (eye + depth[..., None] * ray) / RADIUS
    return np.where(root > 0, np.maximum(normal @ light, 0) * ALBEDO / np.pi, 0.0)


class TinySet:
    """The set's folder, and what a test may spoil in it."""

    def __init__(self, folder: Path):
        self.folder = folder
        (folder / "sample").mkdir(parents=True)
        self.photos = [f"sample/s{k}.png" for k in range(len(LIGHTS))]
        for name, light in zip(self.photos, LIGHTS, strict=True):
            self.write(name, ball_photo(toward(*light)) * 3.0)
        self.manifest = self.manifest_text()
        self.save()

    def manifest_text(self) -> str:
        parts = [
            'format = 1\nname = "tiny"\n',
            f"[sample]\nshape = 'sphere'\ncenter = [0, 0, 0]\nradius = {RADIUS}\n",
        ]
        parts += [CAMERA]
        for k, light in enumerate(LIGHTS):
            direction = toward(*light).tolist()
            parts.append(f'[[light]]\nid = "L{k}"\nkind = "directional"\ndirection = {direction}\n')
            parts.append(f'[[photo]]\nfile = "sample/s{k}.png"\nrole = "sample"\nlight = "L{k}"\n')
        return "\n".join(parts)

    def save(self) -> None:
        (self.folder / "photoset.toml").write_text(self.manifest)

    def replace(self, old: str, new: str) -> None:
        assert old in self.manifest
        self.manifest = self.manifest.replace(old, new)
        self.save()

    def write(self, name: str, radiance: np.ndarray) -> None:
        """A 16-bit photo of radiance in fractions of full scale, three equal channels."""
        rng = np.random.default_rng(len(name) + int(radiance.sum()))
        noisy = radiance + rng.normal(0, 2e-4, radiance.shape) + 0.001
        pixels = np.clip(np.round(noisy * 65535), 0, 65535).astype(np.uint16)
        cv2.imwrite(str(self.folder / name), np.repeat(pixels[..., None], 3, 2))
