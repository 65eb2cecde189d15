"""From radiance to the numbers in a file: lens, photons, electrons, mosaic, encoding."""

from __future__ import annotations

import cv2
import numpy as np

from photogonio.calib.geometry.camera import Camera
from photogonio.synthetic.render.picture import pixel_middles, plane_corners
from photogonio.synthetic.render.processing import finished, local_gain
from photogonio.synthetic.render.tones import linear_to_srgb, tone_curve
from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.phone import LensShading, NoiseFloor

HOT_SEED, FLOOR_SEED = 7919, 6700417  # hot pixels and columns stay as they are from photo to photo
EXPOSURE_SEED = 104729


def expose(
    scene: Scene, camera: Camera, radiance: np.ndarray, seconds: float, factor: float, seed: tuple[int, ...]
):
    """The photo (h, w, c), uint8 or uint16, of ``radiance`` (h, w, c).

    Full scale is radiance x seconds x ``factor`` = 1. ``seed`` names the photo: the same seed, the same noise.
    """
    random = np.random.default_rng((scene.seed, *seed))
    signal = through_lens(scene, camera, radiance) * seconds * factor
    signal = noisy(scene, signal, seconds, random)
    if (shading := scene.camera.shading) is not None and shading.corrected:
        signal = signal / shading_of(shading, signal.shape[:2])[..., None]
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
    if (shading := scene.camera.shading) is not None:
        image = image * shading_of(shading, image.shape[:2])[..., None]
    return image


def shading_of(shading: LensShading, shape: tuple[int, ...]) -> np.ndarray:
    """The part of the light (h, w) that a lens leaves at each pixel."""
    height, width = shape
    y, x = np.mgrid[:height, :width] - 0.5 * np.array([height - 1, width - 1])[:, None, None]
    strength = 1.0 / np.sqrt(shading.corner) - 1.0
    return 1.0 / (1.0 + strength * (x**2 + y**2) * 4.0 / (height**2 + width**2)) ** 2


def exposure_time_of(
    scene: Scene, camera: Camera, radiance: np.ndarray, stated: float, view: int, factor: float
) -> float:
    """Seconds that a photo of ``radiance`` (h, w, c) takes: ``stated``, or in its proportion what the camera chooses.

    ``factor``: full scale is radiance x seconds x factor = 1.
    """
    auto = scene.sensor.exposure
    if auto is None:
        return stated
    bright = np.quantile(through_lens(scene, camera, radiance).max(axis=-1), auto.bright) * factor
    if bright <= 0:
        return stated
    random = np.random.default_rng((scene.seed, EXPOSURE_SEED, view))
    stops = np.log2(random.uniform(auto.low, auto.high) / bright)
    if auto.steps:
        stops = np.floor(auto.steps * stops) / auto.steps
    return float(2.0**stops) * stated / scene.sensor.exposure_time


def cos4(camera: Camera) -> np.ndarray:
    """Fourth power of the cosine between each pixel's ray and the optical axis, (h, w)."""
    return 1.0 / (1.0 + np.sum(pixel_middles(plane_corners(camera)) ** 2, axis=-1)) ** 2


def noisy(scene: Scene, signal: np.ndarray, seconds: float, random: np.random.Generator) -> np.ndarray:
    """Signal with photon noise, read noise, dark current and hot pixels."""
    sensor = scene.sensor
    gain = sensor.gain_electrons or 0.0
    if sensor.dark_current or sensor.hot_pixels:
        signal = signal + dark_signal(scene, signal.shape, seconds, gain)
    if (floor := sensor.floor) is not None:
        fixed = np.random.default_rng((scene.seed, FLOOR_SEED))
        columns = floor.column_electrons * fixed.standard_normal((1, signal.shape[1], 1))
        signal = signal * (1.0 + floor.pixel_gain * fixed.standard_normal(signal.shape))
    if gain <= 0:
        return signal
    # a full well overflows: light far beyond full scale needs no photon count
    electrons = random.poisson(np.clip(signal, 0.0, 4.0) * gain)
    electrons = electrons + random.normal(0.0, sensor.read_noise_electrons, signal.shape)
    if floor is not None:
        electrons += row_offsets(floor, signal.shape[0], random)[:, None, None] + columns
    return electrons / gain


def row_offsets(floor: NoiseFloor, count: int, random: np.random.Generator) -> np.ndarray:
    """Electrons (count,) by which the rows are off: noise of power 1 / frequency^exponent, of mean 0."""
    frequency = np.arange(count // 2 + 1)
    power = np.where(frequency > 0, np.maximum(frequency, 1.0) ** -floor.exponent, 0.0)
    if count % 2 == 0:
        power[-1] *= 0.5  # the highest has no second half, and is real
    drawn = random.standard_normal((2, len(power)))
    spectrum = np.sqrt(power) * (drawn[0] + 1j * drawn[1])
    # variance of the sum: each frequency gives 4 power / count^2, as irfft counts
    whole = 4.0 * power.sum() / count**2
    return floor.row_electrons * np.fft.irfft(spectrum, count) / np.sqrt(max(whole, 1e-300))


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
    """Integers of the file from the linear signal: clipped, raised to the black level, encoded, finished, rounded."""
    sensor = scene.sensor
    if sensor.local_tone is not None:
        signal = signal * local_gain(sensor.local_tone, signal)[..., None]
    value = np.clip(sensor.black_level + (1.0 - sensor.black_level) * signal, 0.0, 1.0)
    if sensor.encoding == "srgb":
        value = linear_to_srgb(value)
    elif sensor.encoding == "gamma":
        value = value ** (1.0 / sensor.gamma)
    elif sensor.encoding == "tone":
        value = tone_curve(sensor.tone)(value)
    value = finished(value, sensor.denoise, sensor.sharpen)
    top = 2**sensor.bits - 1
    return np.round(value * top).astype(np.uint8 if sensor.bits == 8 else np.uint16)
