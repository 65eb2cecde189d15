"""Exposure time, f-number and ISO: from the manifest, else from EXIF."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import median

from photogonio.capture.photoset import Photo


@dataclass(frozen=True, slots=True)
class Exposure:
    """How much light a pixel gathered; None: not known."""

    exposure_time: float | None = None  # seconds
    f_number: float | None = None
    iso: float | None = None

    def known(self) -> frozenset[str]:
        return frozenset(name for name in FIELDS if getattr(self, name) is not None)

    def only(self, fields: frozenset[str]) -> Exposure:
        """Without the quantities that are not in ``fields``."""
        return Exposure(**{name: getattr(self, name) if name in fields else None for name in FIELDS})

    @property
    def factor(self) -> float:
        """Relative to one second at ISO 100 and f/1; what is not known counts as those."""
        time = self.exposure_time or 1.0
        return time * (self.iso or 100.0) / 100.0 / (self.f_number or 1.0) ** 2


FIELDS = ("exposure_time", "f_number", "iso")
TAGS = {  # EXIF names as OpenImageIO gives them, the first that is there
    "exposure_time": ("ExposureTime", "Exif:ExposureTime"),
    "f_number": ("FNumber", "Exif:FNumber"),
    "iso": ("Exif:PhotographicSensitivity", "Exif:ISOSpeedRatings", "Exif:ISOSpeed"),
}


def from_attributes(attributes: Mapping[str, object]) -> Exposure:
    """From a file's EXIF attributes; zeros and unreadable values count as absent."""
    return Exposure(**{field: first_positive(attributes, names) for field, names in TAGS.items()})


def first_positive(attributes: Mapping[str, object], names: tuple[str, ...]) -> float | None:
    for name in names:
        value = attributes.get(name)
        value = value[0] if isinstance(value, tuple) and value else value
        if isinstance(value, (int, float)) and math.isfinite(value) and value > 0:
            return float(value)
    return None


def combine(photo: Photo, header: Exposure) -> Exposure:
    """The manifest's values, and the file's where the manifest is silent."""
    stated = {field: getattr(photo, field) for field in FIELDS}
    return Exposure(**{k: getattr(header, k) if value is None else value for k, value in stated.items()})


def filled(
    exposures: Mapping[str, Exposure], photos: Sequence[Photo]
) -> tuple[dict[str, Exposure], dict[str, list[str]]]:
    """Exposures (by file) with what some of ``photos`` lack taken as the others' middle value, and the files that
    lacked each quantity.

    For photos in which the lamp's strength is read: whatever stands for their exposure divides both alike. Those of a
    bracket are compared with one another, and stay as they are.
    """
    found, lacking = dict(exposures), {}
    for field in FIELDS:
        known = [value for photo in photos if (value := getattr(exposures[photo.file], field)) is not None]
        without = [p.file for p in photos if p.bracket is None and getattr(exposures[p.file], field) is None]
        if known and without:
            lacking[field] = without
            for file in without:
                found[file] = replace(found[file], **{field: median(known)})
    return found, lacking
