"""Exposure time, f-number and ISO: from the manifest, else from EXIF."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import median
from typing import Any

from photogonio.capture.files import stops
from photogonio.capture.photoset import Photo


@dataclass(frozen=True, slots=True)
class Exposure:
    """How much light a pixel gathered; None: not known."""

    exposure_time: float | None = None  # seconds
    f_number: float | None = None
    iso: float | None = None
    # of them, those that are no camera's rounded names
    exact: frozenset[str] = dataclasses.field(default=frozenset(), compare=False)

    def known(self) -> frozenset[str]:
        return frozenset(name for name in FIELDS if getattr(self, name) is not None)

    def only(self, fields: frozenset[str]) -> Exposure:
        """Without the quantities that are not in ``fields``."""
        kept = {name: getattr(self, name) if name in fields else None for name in FIELDS}
        return Exposure(**kept, exact=self.exact & fields)

    @property
    def factor(self) -> float:
        """Relative to one second at ISO 100 and f/1; what is not known counts as those."""
        time = self.exposure_time or 1.0
        return time * (self.iso or 100.0) / 100.0 / (self.f_number or 1.0) ** 2


FIELDS = ("exposure_time", "f_number", "iso")
TAGS = {  # EXIF names as OpenImageIO gives them, the first that is there
    "exposure_time": ("ExposureTime", "Exif:ExposureTime"),
    "f_number": ("FNumber", "Exif:FNumber"),
    "iso": ("Exif:PhotographicSensitivity", "Exif:ISOSpeedRatings"),
}
OPTICS = {
    "serial number": "Exif:BodySerialNumber",
    "lens": "Exif:LensModel",
    "focal length": "Exif:FocalLength",
    "aperture": "FNumber",
    "zoom": "Exif:DigitalZoomRatio",
}
LONGER = ("Exif:RecommendedExposureIndex", "Exif:StandardOutputSensitivity", "Exif:ISOSpeed")
FULL = 65535  # of the short number that EXIF has for the sensitivity: the true one stands elsewhere
APEX = {"exposure_time": ("Exif:ShutterSpeedValue", -1.0), "f_number": ("Exif:ApertureValue", 0.5)}
LEAST_MOVE = 1e-3  # of a logarithm, by which names mislead
_WORDS = (
    "the photos' {} are a camera's rounded names of thirds or halves of a stop: its true steps are taken "
    "({{}} is {{}})"
)
_DOUBT = "; if it means its names, give {} of each photo in the manifest"
STEPPED = {
    "exposure_time": _WORDS.format("exposure times") + _DOUBT.format("exposure_time"),
    "f_number": _WORDS.format("f-numbers") + _DOUBT.format("f_number"),
}
NEAR = 0.105  # stops by which a name lies beside its step: 1/60 s is 1/64, f/11 is f/11.3
COARSE = 0.1  # stops that some APEX values are rounded to, which then tell nothing new


def from_attributes(attributes: Mapping[str, object]) -> Exposure:
    """From a file's EXIF attributes; zeros and unreadable values count as absent.

    APEX values stand in where time or aperture are absent, and for their rounded names where they agree with them.
    """
    found = {field: first_positive(attributes, names) for field, names in TAGS.items()}
    if found["iso"] is None or found["iso"] >= FULL:
        found["iso"] = first_positive(attributes, LONGER) or found["iso"]
    exact = set()
    for field in APEX:
        found[field], told = by_apex(attributes, field, found[field])
        exact |= {field} if told else set()
    return Exposure(**found, exact=frozenset(exact))


def flash_fired(attributes: Mapping[str, object]) -> bool | None:
    """Whether the photo was lit by a flash, as EXIF's Flash tag has it (bit 0); None where there is none."""
    value = attributes.get("Exif:Flash")
    value = value[0] if isinstance(value, tuple) and value else value
    return bool(value & 1) if isinstance(value, int) else None


def camera_name(attributes: Mapping[str, object]) -> str:
    """Maker and model; empty where EXIF tells neither."""
    said = (str(attributes.get(name, "")) for name in ("Make", "Model"))
    parts = ["".join(one if one.isprintable() else " " for one in text).strip() for text in said]
    if parts[1].lower().startswith(parts[0].lower()):
        parts[0] = ""
    return " ".join(part for part in parts if part)


def optics(attributes: Mapping[str, object]) -> dict[str, str]:
    """What EXIF says of camera and lens, and how the lens was set, in words."""
    found = {"camera": camera_name(attributes)}
    for name, tag in OPTICS.items():
        value = attributes.get(tag)
        value = value[0] if isinstance(value, tuple) and value else value
        found[name] = (
            f"{value:.6g}" if isinstance(value, float) else str("" if value is None else value).strip()
        )
    return {name: text for name, text in found.items() if text}


def by_apex(attributes: Mapping[str, object], field: str, stated: float | None) -> tuple[float | None, bool]:
    """A quantity by its APEX value (EXIF 2.32, annex C) and as it is stated, and whether APEX tells it."""
    name, power = APEX[field]
    apex = attributes.get(name)
    apex = apex[0] if isinstance(apex, tuple) and apex else apex
    if not isinstance(apex, (int, float)) or not -30 < apex < 30:
        return stated, False
    exact = float(2.0 ** (power * apex))
    if stated is None:
        return exact, True
    if not stops.is_name(field, stated) or is_coarse(apex) or abs(math.log2(exact / stated)) > NEAR:
        return stated, False
    return exact, True


def is_coarse(apex: float) -> bool:
    """Whether it is rounded to tenths, and is neither a whole nor half a stop."""
    tenths, halves = apex / COARSE, 2 * apex
    return abs(tenths - round(tenths)) < 1e-6 and abs(halves - round(halves)) > 1e-6


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
    known = frozenset(field for field, value in stated.items() if value is not None)
    found = {k: getattr(header, k) if value is None else value for k, value in stated.items()}
    return Exposure(**found, exact=header.exact | known)


def stepped(exposures: Mapping[str, Exposure]) -> tuple[dict[str, Exposure], tuple[str, ...]]:
    """Exposures (by file) with the true steps of a camera that names its times or apertures in thirds of a stop, and
    what is to be said of it: how far the names would have misled, one photo against another."""
    found, lines = dict(exposures), []
    for field in APEX:
        named = {file: value for file, one in exposures.items() if (value := inexact(one, field)) is not None}
        steps = stops.true_steps(field, named.values())
        moved = {value: math.log(step / value) for value, step in steps.items()}
        for file, value in named.items():
            change: dict[str, Any] = {field: steps.get(value, value)}
            found[file] = replace(found[file], **change)
        if moved and max(moved.values()) - min(moved.values()) > LEAST_MOVE:
            value = max(moved, key=lambda one: abs(moved[one]))
            lines.append(STEPPED[field].format(shown(field, value), shown(field, steps[value])))
    return found, tuple(lines)


def inexact(exposure: Exposure, field: str) -> float | None:
    """A quantity that may be a rounded name; None if it is not known or is exact."""
    return None if field in exposure.exact else getattr(exposure, field)


def shown(field: str, value: float) -> str:
    if field == "f_number":
        return f"f/{value:.3g}"
    return f"1/{1 / value:.3g} s" if value < 0.3 else f"{value:.3g} s"


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
