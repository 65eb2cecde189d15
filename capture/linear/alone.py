"""A photo by itself, in gray: for a quick look, without frames, noise and exposures of a set."""

from __future__ import annotations

import numpy as np

from photogonio.capture.files.images import Image
from photogonio.capture.linear.clipping import clip_code
from photogonio.capture.linear.encoding import Encoding
from photogonio.capture.linear.noise import NoiseModel
from photogonio.capture.linear.signal import Sensor, linear_signal, mean_level, saturated
from photogonio.capture.photoset import Radiometry

ROWS = 8  # one of so many tells where codes end
PLAIN = ("linear", "srgb", "gamma")  # encodings that need nothing but the manifest


def encoding_alone(radiometry: Radiometry) -> Encoding:
    """How a photo's codes stand for light, as the manifest says or else its own file; black and white levels are the
    manifest's."""
    black, white = radiometry.black_level or 0.0, radiometry.white_level or 1.0
    kind = radiometry.encoding if radiometry.encoding in PLAIN else "file"
    return Encoding(kind, radiometry.gamma or 1.0, black, white)


def gray_alone(image: Image, encoding: Encoding) -> tuple[np.ndarray, np.ndarray]:
    """Mean of the channels (h, w) float32, 1 at white level, and which pixels are not saturated (h, w) bool."""
    clip = clip_code([image.pixels[::ROWS]], image.full_scale, lossy=image.lossy)
    channels = image.pixels.shape[2]
    noise = NoiseModel(np.zeros(channels), np.zeros(channels), "none")
    kind = Encoding("linear", 1.0, encoding.black, encoding.white) if image.raw else encoding
    sensor = Sensor(kind, noise, clip, full_scale=image.full_scale)
    found = mean_level(image, sensor, 1.0)
    if found is not None:
        return found
    value, _ = linear_signal(image, image.pixels, sensor)
    return value.mean(axis=2, dtype=np.float32), ~saturated(image.pixels, clip, image.saturated)
