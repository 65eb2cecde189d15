"""Reads views as linear radiance, with all that the set's own frames and a first look at its photos tell."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.errors import InputError
from photogonio.capture.files.exposure import FIELDS, Exposure
from photogonio.capture.files.images import RAW_TONE, Image, read_header, read_image
from photogonio.capture.linear import kernel as pointwise
from photogonio.capture.linear.brackets import merge, trimmed
from photogonio.capture.linear.encoding import Coded
from photogonio.capture.linear.frames import Dark
from photogonio.capture.linear.outliers import isolated_spots
from photogonio.capture.linear.signal import (
    MIDDLE,
    WINDOW,
    Region,
    Sensor,
    Signal,
    Windows,
    cut,
    grown,
    mean_level,
    part_of,
    signal_of,
)
from photogonio.capture.photoset import Photo, PhotoSet, View
from photogonio.capture.radiance import RadianceImage

STEP_PIXELS = 1_000_000  # about, that the exposure steps of a bracket are measured on
BAND = 128  # rows whose light is worked out together: they stay in the cache
SHOWN_BY_LAMP = ("sample", "probe")  # roles whose photos show the ambient photo's view, with the lamp on
BELOW_BLACK = 4.0  # standard deviations below black that a pixel may read

_COMPARED = (
    "sample",
    "ambient",
)  # roles whose radiance is compared between photos; of others only the picture matters


@dataclass(frozen=True, slots=True)
class RadianceReader:
    """Reads any view of a set; made by :func:`capture.linear.prepare.prepare`. Worker processes can share one (it
    pickles).
    """

    photoset: PhotoSet
    channels: tuple[str, ...]
    size: tuple[int, int]  # width, height
    sensor: Sensor
    exposures: Mapping[str, Exposure]  # by file
    fields: frozenset[str]  # the exposure's quantities that count
    dark: Dark | None = None
    gain: np.ndarray | None = None  # (h, w, c or 1) float32 against vignetting
    veil: Mapping[str, np.ndarray] = field(default_factory=dict)  # (c,) radiance over whole photos, by view
    ambient: Mapping[str | None, RadianceImage] = field(default_factory=dict)  # by light
    notes: tuple[str, ...] = ()  # what was found of the sensor, in words
    diagnoses: tuple[Diagnosis, ...] = ()  # what a person should look at
    decode: Callable[..., Image] = read_image  # or one of the same arguments that keeps what it decoded

    @property
    def warnings(self) -> tuple[str, ...]:
        """The diagnoses in words."""
        return tuple(one.message for one in self.diagnoses)

    def read(self, view: View, roi: Region | Windows | None = None) -> RadianceImage:
        """Radiance of a view, or of its region ``[x0, x1) x [y0, y1)``, or of windows.

        Raises InputError, naming the photo, if it cannot be read, differs in size or channels from the
        others, or lacks an exposure quantity that others have.
        """
        image = self._lit(view, roi)
        valid = image.valid & ~grown(image.saturated)
        valid &= ~isolated_spots(image.value, image.variance, crowded=not isinstance(roi, Windows))
        return replace(image, valid=valid)

    def bands(self, view: View) -> Iterator[RadianceImage]:
        """The radiance of a whole view from above, as :meth:`read` has it, in bands of rows where the photo stands
        alone: that of a large photo takes some twenty times the memory of its file.
        """
        (width, height), reader, rows = self.size, self, self.size[1]
        if len(view.photos) == 1:  # of a bracket, the exposures' steps take the whole photos
            image = self.image(view.photos[0])
            rows, reader = BAND, replace(self, decode=lambda path, demosaic: image)
        for top in range(0, height, rows):
            yield reader.read(view, (0, top, width, min(top + rows, height)))

    def _lit(self, view: View, roi: Region | Windows | None) -> RadianceImage:
        """Radiance by the lamp alone, before pixels are judged by their neighbours."""
        image = self.exposed(view, roi)
        lamp_off = None
        if view.photos[0].role in SHOWN_BY_LAMP:  # others are taken from elsewhere, or by the room's light
            lamp_off = self.ambient.get(view.light, self.ambient.get(None))
        value, variance, saturated = image.value, image.variance, image.saturated
        if lamp_off is not None:
            value -= cut(lamp_off.value, roi)
            variance += cut(lamp_off.variance, roi)
            saturated = saturated | cut(lamp_off.saturated, roi)
        veil = self.veil.get(view.name)
        if veil is not None:
            value -= veil.astype(value.dtype)
        if self.gain is not None:
            gain = cut(self.gain, roi)
            value *= gain
            variance *= gain**2
        return RadianceImage(value, variance, image.valid, saturated, image.origin, image.ghost)

    def read_at(self, view: View, pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Radiance (n, c) and validity (n,) at single pixels (n, 2), at least MIDDLE from the photo's edge.

        As :meth:`read` has them, but that many spots close together are rejected too.
        """
        read = self.read(view, Windows(pixels))
        return read.value[MIDDLE::WINDOW, MIDDLE], read.valid[MIDDLE::WINDOW, MIDDLE]

    def read_level(self, view: View, region: Region | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Mean over channels (h, w) float32 of the radiance of a view or its region, and where it is not saturated
        (h, w) bool.

        What it takes to find things in a photo, at a fraction of the cost of :meth:`read`: in one pass where the
        photo stands alone, else a band of rows at a time.
        """
        left, top, right, bottom = region or (0, 0, *self.size)
        rows, reader = bottom - top, self
        if len(view.photos) == 1:  # of a bracket, the exposures' steps take the whole photos
            photo = view.photos[0]
            image, factor = self.image(photo), self.factor(photo)
            alone = self.dark is None and self.gain is None and not self.ambient and not self.veil
            found = mean_level(image, self.sensor, factor, region) if alone else None
            if found is not None:
                return found
            rows, reader = BAND, replace(self, decode=lambda path, demosaic: image)
        level, usable = (
            np.empty((bottom - top, right - left), np.float32),
            np.empty((bottom - top, right - left), bool),
        )
        for first in range(top, bottom, rows):
            part = reader._lit(view, (left, first, right, min(first + rows, bottom)))
            pointwise.mean_level(np.ascontiguousarray(part.value), level[first - top : first - top + rows])
            usable[first - top : first - top + rows] = ~part.saturated
        return level, usable

    def exposed(self, view: View, roi: Region | Windows | None = None) -> RadianceImage:
        """Exposures joined and divided out; ambient light and vignetting still in it."""
        factors = [self.factor(photo) for photo in view.photos]
        ghost = None
        if len(view.photos) > 1:
            signals = [self.signal(photo) for photo in view.photos]
            factors = self.bracket_factors(view, signals, factors)
            signals = [part_of(signal, roi) for signal in signals]
        else:
            signals = [self.signal(view.photos[0], roi)]
        if len(signals) == 1:
            value, variance, saturated = signals[0].value, signals[0].variance, signals[0].saturated
            value *= np.float32(1 / factors[0])
            variance *= np.float32(1 / factors[0] ** 2)
        else:
            merged = merge(signals, factors, self.sensor.noise)
            value, variance, saturated, ghost = merged.value, merged.variance, merged.saturated, merged.ghost
        valid = ~saturated if ghost is None else ~(saturated | ghost)
        low = np.flatnonzero(value < 0)  # few: the test itself is costly
        too_low = low[value.ravel()[low] < -BELOW_BLACK * np.sqrt(variance.ravel()[low])]
        valid.ravel()[too_low // value.shape[2]] = False
        if self.dark is not None:
            valid &= ~cut(self.dark.hot, roi)
        origin = roi[:2] if isinstance(roi, tuple) else (0, 0)
        return RadianceImage(value, variance, valid, saturated, origin, ghost)

    def factor(self, photo: Photo) -> float:
        """Exposure of a photo: signal over radiance."""
        exposure = self.exposures.get(photo.file, Exposure())
        missing = [name for name in FIELDS if name in self.fields and getattr(exposure, name) is None]
        if missing and photo.role in _COMPARED:
            what = f"no {missing[0]}, neither in the manifest nor in EXIF, while other photos have it"
            raise InputError(self.photoset.folder / photo.file, what)
        return exposure.only(self.fields).factor

    def coded(self, view: View) -> Coded | None:
        """How a view's codes became its radiance; None of brackets, whose photos were
        joined, of RAW and float files, which have no curve, and of a curve that photos told."""
        photo, encoding = view.photos[0], self.sensor.encoding
        if len(view.photos) > 1 or self.sensor.full_scale <= 1.0 or encoding.kind == "table":
            return None
        tone = read_header(self.photoset.folder / photo.file, demosaic=self.photoset.radiometry.demosaic).tone
        if tone is RAW_TONE:
            return None
        return Coded(self.factor(photo), encoding.own_of(tone), self.sensor.full_scale)

    def bracket_factors(self, view: View, signals: Sequence[Signal], factors: Sequence[float]) -> list[float]:
        """Exposures of a bracket, the stated ones corrected by what the whole photos show."""
        path = self.photoset.folder / view.name
        if not self.fields:
            raise InputError(path, "a photo of a bracket needs its exposure_time, from the manifest or EXIF")
        step = max(1, self.size[0] * self.size[1] // STEP_PIXELS)
        try:
            return trimmed([part_of(signal, None, step) for signal in signals], factors)
        except ValueError as error:
            raise InputError(path, str(error)) from error

    def signal(self, photo: Photo, roi: Region | Windows | None = None) -> Signal:
        """Linear signal of a photo without its dark signal."""
        signal = signal_of(self.image(photo), self.sensor, roi)
        if self.dark is not None:
            time = self.exposures.get(photo.file, Exposure()).exposure_time
            np.subtract(signal.value, self.dark.at(time, roi), out=signal.value)
            np.add(signal.variance, cut(self.dark.variance, roi), out=signal.variance)
        return signal

    def image(self, photo: Photo) -> Image:
        """The decoded photo, of the set's size and channels."""
        path = self.photoset.folder / photo.file
        image = self.decode(path, demosaic=self.photoset.radiometry.demosaic)
        height, width = image.pixels.shape[:2]
        if (width, height) != self.size:
            expected = f"{self.size[0]} x {self.size[1]}"
            raise InputError(path, f"is {width} x {height} pixels, the other photos are {expected}")
        if len(image.channels) != len(self.channels):
            what = f"has {len(image.channels)} channels, the other photos have {len(self.channels)}"
            raise InputError(path, what)
        return half_turned(image) if photo.turned else image


def half_turned(image: Image) -> Image:
    """The picture turned by half a turn; its own inverse."""
    full = None if image.saturated is None else np.ascontiguousarray(image.saturated[::-1, ::-1])
    return replace(image, pixels=np.ascontiguousarray(image.pixels[::-1, ::-1]), saturated=full)
