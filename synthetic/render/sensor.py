"""From radiance to the numbers in a file: lens, photons, electrons, mosaic, encoding."""

from __future__ import annotations

import cv2
import numpy as np

from photogonio.calib.geometry.camera import Camera
from photogonio.synthetic.render.picture import pixel_middles, plane_corners
from photogonio.synthetic.scene.model import Scene

HOT_SEED = 7919  # hot pixels stay where they are from photo to photo


def expose(
    scene: Scene, camera: Camera, radiance: np.ndarray, seconds: float, factor: float, seed: tuple[int, ...]
):
    """The photo (h, w, c), uint8 or uint16, of ``radiance`` (h, w, c).

    Full scale is radiance x seconds x ``factor`` = 1. ``seed`` names the photo: the same seed, the same noise.
    """
    random = np.random.default_rng((scene.seed, *seed))
    signal = through_lens(scene, camera, radiance) * seconds * factor
    signal = noisy(scene, signal, seconds, random)
    if scene.sensor.bayer:
        signal = demosaic(np.clip(signal, 0.0, 1.0))
    if scene.sensor.fireflies > 0:
        struck = random.random(signal.shape[:2]) < scene.sensor.fireflies
        signal[struck] = random.uniform(0.3, 3.0, (int(struck.sum()), 1))
    return encode(scene, signal)


def through_lens(scene: Scene, camera: Camera, radiance: np.ndarray) -> np.ndarray:
    """Radiance (h, w, c) blurred by defocus and darkened toward the corners."""
    image = radiance
    if scene.camera.defocus > 0:
        image = cv2.GaussianBlur(image, (0, 0), scene.camera.defocus, borderType=cv2.BORDER_REFLECT_101)
        image = image.reshape(radiance.shape)
    if scene.camera.vignetting == "cos4":
        image = image * cos4(camera)[..., None]
    return image


def cos4(camera: Camera) -> np.ndarray:
    """Fourth power of the cosine between each pixel's ray and the optical axis, (h, w)."""
    return 1.0 / (1.0 + np.sum(pixel_middles(plane_corners(camera)) ** 2, axis=-1)) ** 2


def noisy(scene: Scene, signal: np.ndarray, seconds: float, random: np.random.Generator) -> np.ndarray:
    """Signal with photon noise, read noise, dark current and hot pixels."""
    sensor = scene.sensor
    gain = sensor.gain_electrons or 0.0
    if sensor.dark_current or sensor.hot_pixels:
        signal = signal + dark_signal(scene, signal.shape, seconds, gain)
    if gain <= 0:
        return signal
    # a full well overflows: light far beyond full scale needs no photon count
    electrons = random.poisson(np.clip(signal, 0.0, 4.0) * gain)
    return (electrons + random.normal(0.0, sensor.read_noise_electrons, signal.shape)) / gain


def dark_signal(scene: Scene, shape: tuple[int, ...], seconds: float, gain: float) -> np.ndarray:
    """What a pixel collects without light: everywhere the dark current, in hot pixels far more."""
    sensor, fixed = scene.sensor, np.random.default_rng((scene.seed, HOT_SEED))
    hot = fixed.random(shape[:2]) < sensor.hot_pixels
    rate = np.where(hot, fixed.uniform(0.05, 1.0, shape[:2]), 0.0) / sensor.exposure_time
    even = sensor.dark_current * seconds / gain if gain > 0 else 0.0
    return np.broadcast_to((rate * seconds + even)[..., None], shape)


def demosaic(signal: np.ndarray) -> np.ndarray:
    """One colour a pixel (RGGB) of ``signal`` (h, w, 3), the others from their neighbours, bilinear."""
    masks = np.zeros(signal.shape)
    masks[0::2, 0::2, 0] = masks[0::2, 1::2, 1] = masks[1::2, 0::2, 1] = masks[1::2, 1::2, 2] = 1.0
    kernel = np.array([[0.25, 0.5, 0.25], [0.5, 1.0, 0.5], [0.25, 0.5, 0.25]])
    total = cv2.filter2D(signal * masks, -1, kernel, borderType=cv2.BORDER_REFLECT_101)
    near = cv2.filter2D(masks, -1, kernel, borderType=cv2.BORDER_REFLECT_101)
    return np.where(masks > 0, signal, total / near)


def encode(scene: Scene, signal: np.ndarray) -> np.ndarray:
    """Integers of the file from the linear signal: clipped, raised to the black level, encoded, rounded."""
    sensor = scene.sensor
    value = np.clip(sensor.black_level + (1.0 - sensor.black_level) * signal, 0.0, 1.0)
    if sensor.encoding == "srgb":
        value = np.where(
            value <= 0.0031308, 12.92 * value, 1.055 * np.maximum(value, 1e-9) ** (1 / 2.4) - 0.055
        )
    elif sensor.encoding == "gamma":
        value = value ** (1.0 / sensor.gamma)
    top = 2**sensor.bits - 1
    return np.round(value * top).astype(np.uint8 if sensor.bits == 8 else np.uint16)
