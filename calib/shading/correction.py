"""What lies between the light that a lens was shown and what a photo says: an offset, and what the lens let through."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.shading.kernel import lens
from photogonio.capture.radiance import RadianceImage

NO_FALLOFF = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class PhotometricCorrection:
    """Of one photo: light is (value - offset) gain, the gain a function of the place in the picture."""

    offset: np.ndarray | None = None  # (c,) radiance that lies over the whole photo; None: none is known of
    offset_error: np.ndarray | None = None  # (c,) standard error
    falloff: tuple[float, float] = NO_FALLOFF  # terms of :class:`calib.setup.Falloff`

    def gain(self, aside: np.ndarray) -> np.ndarray:
        """What to multiply by (n,) at ``aside`` (n,) of :meth:`calib.geometry.camera.Camera.aside`."""
        return 1 / lens(aside, np.array(self.falloff))

    def of_image(self, image: RadianceImage, camera: Camera) -> RadianceImage:
        """A photo, or a part of one."""
        if self.offset is not None:
            image = replace(image, value=(image.value - self.offset).astype(image.value.dtype))
        if not any(self.falloff):
            return image
        height, width = image.valid.shape
        pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2)
        gain = self.gain(camera.aside(pixels + np.array(image.origin))).reshape(height, width, 1)
        return replace(
            image,
            value=(image.value * gain).astype(image.value.dtype),
            variance=(image.variance * gain**2).astype(image.variance.dtype),
        )

    def of_reading(self, reading: PaperReading) -> PaperReading:
        """What was read of a photo's paper."""
        samples, level, noise, close = reading.samples, reading.level, reading.noise, reading.close
        patches = reading.patches
        if self.offset is not None:
            gray = float(self.offset.mean())
            samples, level = replace(samples, value=samples.value - self.offset), level - gray
            close = None if close is None else replace(close, level=close.level - gray)
            patches = None if patches is None else replace(patches, level=patches.level - gray)
        if any(self.falloff) and samples.aside is not None:
            gain = self.gain(samples.aside)
            many = gain[:, None]
            samples = replace(samples, value=samples.value * many, variance=samples.variance * many**2)
            level, noise = level * gain, noise * gain**2
            if close is not None and close.aside is not None:
                own = self.gain(close.aside)
                close = replace(close, level=close.level * own, noise=close.noise * own**2)
            if patches is not None:
                own = self.gain(patches.aside)
                patches = replace(patches, level=patches.level * own, noise=patches.noise * own**2)
        return replace(reading, samples=samples, level=level, noise=noise, close=close, patches=patches)


NO_CORRECTION = PhotometricCorrection()
Corrections = Mapping[str, PhotometricCorrection]  # by view; those that are not named have none
