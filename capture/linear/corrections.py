"""A set's own dark, ambient and flat frames, and what follows from them; unusable ones are left out and
named.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

import numpy as np

from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.errors import InputError
from photogonio.capture.linear.frames import Dark, Rays, cos4_gain, dark_of, flat_gain, is_lit, mean_signal
from photogonio.capture.linear.reader import RadianceReader
from photogonio.capture.linear.signal import Signal
from photogonio.capture.photoset import View
from photogonio.capture.radiance import RadianceImage

TOO_FULL = 0.01  # share of saturated pixels that spoils a dark or flat frame

Read = TypeVar("Read", Signal, RadianceImage)
Unread = tuple[Diagnosis, ...]  # frames that were left out


def dark_frame(reader: RadianceReader) -> tuple[Dark | None, Unread]:
    photos = [photo for photo in reader.photoset.photos if photo.role == "dark"]
    if not photos:
        return None, ()
    kept, unread = usable(
        reader,
        [View((photo,)) for photo in photos],
        lambda view: reader.signal(view.photos[0]),
        full="a dark frame, but much of it is saturated",
        wrong=lambda signal: (
            "a dark frame, but it shows a picture: take it with the lens capped, or give it its own role"
            if is_lit(signal.value)
            else ""
        ),
    )
    black_known = reader.photoset.radiometry.black_level is not None or reader.sensor.encoding.black > 0
    exposures = [reader.exposures[view.name] for view, _ in kept]
    return dark_of([signal for _, signal in kept], exposures, black_known=black_known), unread


def ambient_light(reader: RadianceReader) -> tuple[dict[str | None, RadianceImage], Unread]:
    """Mean radiance of the ambient photos by the light that they name; None: for all other views."""
    kept, unread = usable(reader, reader.photoset.views("ambient"), reader.exposed)
    by_light: dict[str | None, list[RadianceImage]] = {}
    for view, image in kept:
        by_light.setdefault(view.light, []).append(image)
    return {light: mean_image(images) for light, images in by_light.items()}, unread


def mean_image(images: Sequence[RadianceImage]) -> RadianceImage:
    value, variance = mean_signal(images)
    full = np.logical_or.reduce([image.saturated for image in images])
    return RadianceImage(value, variance, ~full, full)


def flat_field(reader: RadianceReader) -> tuple[np.ndarray | None, Unread]:
    """What radiance is multiplied by, (h, w, c), where the manifest asks for a flat field."""
    photoset = reader.photoset
    if photoset.radiometry.vignetting != "flat":
        return None, ()
    kept, unread = usable(
        reader,
        photoset.views("flat"),
        reader.exposed,
        full="a flat field, but much of it is saturated",
    )
    try:
        return flat_gain(*mean_signal([image for _, image in kept])), unread
    except ValueError as error:
        raise InputError(photoset.folder / kept[0][0].name, str(error)) from error


def vignetting(reader: RadianceReader, camera: Rays | None) -> np.ndarray | None:
    """What radiance is multiplied by, (h, w, 1), where the manifest asks for cos^4; None without the
    camera.
    """
    asked = reader.photoset.radiometry.vignetting == "cos4"
    return cos4_gain(camera) if asked and camera is not None else None


def usable(
    reader: RadianceReader,
    views: Iterable[View],
    read: Callable[[View], Read],
    *,
    full: str | None = None,
    wrong: Callable[[Read], str] = lambda image: "",
) -> tuple[list[tuple[View, Read]], Unread]:
    """What can be read of some views, and why others cannot.

    ``full`` is what is said of a saturated one, if that matters, and ``wrong`` what else is wrong with one. Raises the
    first view's InputError if none is left.
    """
    kept: list[tuple[View, Read]] = []
    faults: list[InputError] = []
    for view in views:
        try:
            image = read(view)
            if full is not None and image.saturated.mean() > TOO_FULL:
                raise InputError(reader.photoset.folder / view.name, full)
            if what := wrong(image):
                raise InputError(reader.photoset.folder / view.name, what)
            kept.append((view, image))
        except InputError as error:
            faults.append(error)
    if faults and not kept:
        raise faults[0]
    return kept, tuple(Diagnosis("unreadable-frame", f"left out: {fault}") for fault in faults)
