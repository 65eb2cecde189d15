"""Which column of a table is what."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.goniometer.text import TextTable
from photogonio.reconstruct.goniometer.told import Told

ANGLE_NAMES = ("theta_i", "phi_i", "theta_r", "phi_r")
NAMES = (*ANGLE_NAMES, "value", "sigma")
NONE = "none"  # told of standard errors: no column is
# words of headers that name no BRDF, however they are written
WAVELENGTHS = {
    "lambda",
    "λ",
    "wavelength",
    "wavelengths",
    "wellenlänge",
    "wellenlaenge",
    "wl",
    "wvl",
    "(nm)",
    "(um)",
}
ERRORS = {
    *("sigma", "σ", "sd", "std", "stdev", "stddev", "stderr", "se", "sem", "err", "error", "errors"),
    *("unc", "uncert", "uncertainty", "u", "du", "noise", "variance", "var", "rms", "deviation", "rsd", "k"),
    *("unsicherheit", "fehler", "incertitude", "erreur", "streuung", "tolerance", "confidence", "ci", "ci95"),
}
CIRCUMSTANCES = {
    *("temperature", "temp", "humidity", "pressure", "time", "date", "timestamp", "datetime", "seconds"),
    *("index", "idx", "row", "line", "no", "nr", "num", "number", "id", "n", "count", "counts", "sample"),
    *("samples", "run", "scan", "repeat", "rep", "file", "flag", "flags", "quality", "valid", "mask", "snr"),
    *("polarization", "polarisation", "pol", "filter", "detector", "gain", "exposure", "integration", "dark"),
    *("distance", "power", "current", "voltage", "theta", "phi", "angle", "azimuth", "elevation", "dphi"),
    *("sza", "vza", "saa", "vaa", "raa", "aoi", "zenith", "incidence", "az", "el", "altitude"),
    *("theta_h", "theta_d", "phi_d", "thetai", "thetar", "phii", "phir", "weight", "comment", "remark"),
    *("solid", "aperture", "spot", "position", "x_mm", "y_mm", "z_mm", "operator", "instrument"),
}
# likewise, where another column may be a BRDF
BESIDE = {
    *("raw", "signal", "background", "bg", "bias", "adc", "dn", "reference", "ref", "int", "ms", "tint"),
    *("min", "max", "minimum", "maximum", "lower", "upper", "low", "high"),
    *("irradiance", "volts", "amps", "lux", "focus", "height", "batch", "order", "step"),
}
# headers of angles as other programs write them, in small letters without units, blanks, dots and underscores
_INCIDENT = ("i", "in", "inc", "incident", "incidence", "source", "illumination", "solar", "sun")
_EXIT = ("r", "o", "out", "exit", "reflected", "view", "viewing", "observer", "sensor", "emission")


def _with(sides: tuple[str, ...], *angles: str) -> set[str]:
    """Words of a side and of an angle joined, either way around, with or without ``angle`` behind."""
    both = {one for angle in angles for side in sides for one in (angle + side, side + angle)}
    return both | {one + "angle" for one in both}


ANGLES = {
    "theta_i": _with(_INCIDENT, "theta", "zenith", "zen", "polar")
    | {"sza", "aoi", "angleofincidence", "incidenceangle", "incidentangle", "incidence"},
    "phi_i": _with(_INCIDENT, "phi", "azimuth", "azim", "az") | {"saa"},
    "theta_r": _with(_EXIT, "theta", "zenith", "zen", "polar")
    | {
        "vza",
        "exitangle",
        "viewangle",
        "viewingangle",
        "emissionangle",
        "angleofemission",
        "reflectionangle",
    },
    "phi_r": _with(_EXIT, "phi", "azimuth", "azim", "az") | {"vaa"},
}
# of an exit azimuth less the incident one, as headers name it
RELATIVE = {
    "raa",
    "relativeazimuth",
    "relativeazimuthangle",
    "relaz",
    "dphi",
    "deltaphi",
    "relativephi",
    "phirel",
}
# of angles above the surface, 90 degrees less those from the normal
ELEVATIONS = {
    name: _with(sides, "elevation", "elev", "el", "altitude")
    for name, sides in (("theta_i", _INCIDENT), ("theta_r", _EXIT))
}
DEGREES, RADIANS = {"", "deg", "degs", "degree", "degrees", "°"}, {"rad", "rads", "radian", "radians"}
GRADIANS = {"gon", "gons", "gradian", "gradians"}  # not grad, which is a degree in German
UNITS = {word: name for name, words in (("degrees", DEGREES), ("radians", RADIANS), ("gradians", GRADIANS))
         for word in words}  # fmt: skip
_UNIT = re.compile(r"\s*[\[(]\s*([^\])]*?)\s*[\])]\s*$")
_SUFFIX = re.compile(
    rf"[\s._-]+({'|'.join(sorted(set(UNITS) - {'', '°'}, key=len, reverse=True))})$", re.IGNORECASE
)
# what a header says that its values are, by words of it
QUANTITIES = {
    "percent": {"percent", "pct", "percentage", "%"},
    "reflectance-factor": {"brf", "hdrf", "reff"},
    "brdf-cos": {"ccbrdf", "ars", "cos", "cosine"},
}
REFLECTANCES = {
    "value",
    "values",
    "brdf",
    "bsdf",
    "f",
    "fr",
    "r",
    "g",
    "b",
    "x",
    "y",
    "z",
    "luminance",
    "reflectance",
}
CERTAIN = {"value", "values", "brdf", "bsdf", "f", "fr"}  # of which the others of a table are beside it
COLOURS = ({"r", "g", "b"}, {"x", "y", "z"}, {"red", "green", "blue"})  # which are channels together
FEWEST = 20  # rows, in which no channel is the same number
TRANSMISSIONS = {"btdf", "transmission", "transmittance", "ttdf"}
LOGARITHMS = {"log", "log10", "ln", "db", "decibel", "logarithm"}


@dataclass(frozen=True, slots=True)
class Matched:
    """Headers by the reader's names."""

    angles: dict[str, str]  # of theta_i, phi_i, theta_r, phi_r; without those that are missing
    values: tuple[str, ...]
    sigmas: tuple[str, ...]  # none, one, or one a value
    unused: tuple[str, ...]  # in no part of what was asked


def words_of(header: str) -> set[str]:
    """The header and its words in small letters: ``Wavelength [nm]`` has wavelength and nm."""
    low = header.lower().strip()
    whole = {f"({low})"} if low in ("nm", "um") else {low}  # a header alone; of 550nm it is a part
    return whole | {*re.findall(r"[^\W_\d]+", low), *re.findall(r"[^\W_]+", low)}


def is_value(header: str) -> bool:
    """Whether a header that nobody mapped may be a channel."""
    return not words_of(header) & (WAVELENGTHS | ERRORS | CIRCUMSTANCES)


def match_columns(table: TextTable, told: Told) -> Matched:
    """Headers of what the reader knows. Without ``value`` mapped, every other column is a channel, but for words and
    for what a header names that is no BRDF (wavelength, sigma, temperature ...).

    Raises:
        InputError: a column is missing, or there twice, or there is no value.
    """
    for name in told.columns:
        if name not in NAMES:
            raise InputError(f"--columns {name}", f"expected one of {', '.join(NAMES)}")
    header = table.header
    angles = {name: told.columns.get(name) or _likely(header, name) for name in ANGLE_NAMES}
    absent = [name for name in ("phi_i", "phi_r") if name not in told.columns and angles[name] not in header]
    for name in absent if absent != ["phi_r"] else ():
        del angles[name]
    if "phi_i" in angles and "phi_r" not in told.columns and _bare(angles["phi_r"])[0] in RELATIVE:
        del angles["phi_i"]  # is in it
    sigma = told.columns.get("sigma", "sigma" if "sigma" in header else "")
    unwanted = sigma == NONE and NONE not in header
    sigma = "" if unwanted else sigma
    chosen = [name for name, _ in told.where] + ([told.channel_by] if told.channel_by else [])
    taken = {*angles.values(), *sigma.split("+"), *chosen}
    others = [name for name in header if name not in taken]
    values = _values(table, told, others)
    own = [f"sigma_{name}" for name in channel_names(values)]
    if not (sigma or unwanted) and set(own) <= set(header):  # one a channel, as exported tables have
        sigma, others = "+".join(own), [name for name in others if name not in own]
    for name in [*angles.values(), *values, *filter(None, sigma.split("+")), *chosen]:
        if header.count(name) != 1:
            found = "more than once" if name in header else f"not among {', '.join(header)}"
            raise InputError(table.path, f"column {name!r} is {found}; map headers with --columns")
    sigmas = tuple(filter(None, sigma.split("+")))
    if len(sigmas) not in (0, 1, len(values)):
        raise InputError(f"--columns sigma={sigma}", f"expected one, or one for each of {len(values)} values")
    unused = tuple(name for name in others if name not in values)
    return Matched(angles, values, sigmas, unused)


def _likely(header: tuple[str, ...], name: str) -> str:
    """The header of an angle, as it is or as others write it."""
    if name in header:
        return name
    for known in (ANGLES[name], ELEVATIONS.get(name, set()), RELATIVE if name == "phi_r" else set()):
        found = [one for one in header if _bare(one)[0] in known and _bare(one)[1] in UNITS]
        if found:
            return found[0] if len(found) == 1 else name
    return name


def _bare(header: str) -> tuple[str, str]:
    """A header in small letters without its unit, and the unit."""
    unit = _UNIT.search(header) or _SUFFIX.search(header)
    name = header[: unit.start()] if unit else header
    for letter, word in (
        ("θ", "theta"),
        ("ϑ", "theta"),
        ("φ", "phi"),
        ("ϕ", "phi"),
        ("Δ", "delta"),
        ("∆", "delta"),
    ):
        name = name.replace(letter, word)
    return re.sub(r"[\s._-]", "", name.lower()), unit.group(1).lower() if unit else ""


def is_elevation(header: str) -> bool:
    """Whether a header of a polar angle says that it counts from the surface."""
    return any(_bare(header)[0] in names for names in ELEVATIONS.values()) or "elevation" in words_of(header)


def units_of(table: TextTable, angles: Mapping[str, str]) -> dict[str, str]:
    """The unit of each angle where headers, or the line below, say another than degrees of some; nothing where they say
    degrees of all, or of some and nothing of others.

    Raises:
        InputError: they say radians or gradians of some, and nothing of others.
    """
    said = {name: _bare(header)[1] or unit_below(table, header) for name, header in angles.items()}
    units = {name: UNITS.get(word) for name, word in said.items()}
    if not {"radians", "gradians"} & set(units.values()):
        return {}
    untold = [angles[name] for name, word in said.items() if not word or word not in UNITS]
    if untold:
        raise InputError(
            table.path, f"angles are in more than one unit, and {untold[0]} names none: say --angles"
        )
    return {name: unit for name, unit in units.items() if unit is not None}


def unit_below(table: TextTable, header: str) -> str:
    """What the line of units below the header says of a column, in small letters; nothing where there is none."""
    if not table.units or table.header.count(header) != 1:
        return ""
    return table.units[table.header.index(header)].strip().strip("[]()").strip().lower()


def quantity_said(path: Path, headers: tuple[str, ...], units: Sequence[str] = ()) -> tuple[str, str] | None:
    """A header of values that says, or whose line of ``units`` does, that they are no BRDF but another of the
    quantities, and which.

    Raises:
        InputError: it says that they are logarithms, or of transmission.
    """
    for header, unit in zip_longest(headers, units, fillvalue=""):
        words = words_of(header) | words_of(unit) | ({"%"} if "%" in header + unit else set())
        if words & LOGARITHMS:
            raise InputError(path, f"column {header!r} holds logarithms: bring them to plain numbers")
        if words & TRANSMISSIONS:
            raise InputError(
                path, f"column {header!r} is of transmission; only reflection is fitted (--columns value=...)"
            )
        told = next((name for name, known in QUANTITIES.items() if words & known), None)
        if told is None and "factor" in words and words & {"reflectance", "radiance"}:
            told = "reflectance-factor"
        if told is not None:
            return header, told
    return None


def _values(table: TextTable, told: Told, others: list[str]) -> tuple[str, ...]:
    if "value" in told.columns:
        return tuple(told.columns["value"].split("+"))
    likely = tuple(name for name in others if is_value(name))
    values = tuple(name for name in likely if not _all_words(table, name)) or likely
    values = _varying(table, values)
    values = tuple(name for name in values if not words_of(name) & BESIDE) or values
    values = _named(values)
    if not values:
        raise InputError(
            table.path,
            f"no column of values; found {', '.join(table.header)}; say which with --columns value=...",
        )
    return values


def _varying(table: TextTable, names: tuple[str, ...]) -> tuple[str, ...]:
    """Those of which a BRDF may be told: without what is the same number in every row, a circumstance, where others are
    not."""
    told = [name for name in names if table.header.count(name) == 1]
    rows = {name: table.numbers[table.header.index(name)] for name in told}
    good = {name: column[np.isfinite(column)] for name, column in rows.items()}
    same = {
        name
        for name, one in good.items()
        if len(one) >= FEWEST and np.ptp(one) == 0.0 and not words_of(name) & REFLECTANCES
    }
    return tuple(name for name in names if name not in same) or names


def _named(names: tuple[str, ...]) -> tuple[str, ...]:
    """Those that are called a BRDF, and colours beside them; all, where none is: a name that nobody knows, as of a
    voltage in another language, is no channel of a table that has values."""
    certain = {name for name in names if words_of(name) & CERTAIN}
    if not certain:
        return names
    letters = [set(), *(some for some in COLOURS if some <= {name.lower() for name in names})]
    colours = set().union(*letters)
    return tuple(name for name in names if name in certain or name.lower() in colours)


def _all_words(table: TextTable, name: str) -> bool:
    """Whether not one cell is a number; of a name that is there twice, whatever."""
    if table.header.count(name) != 1 or not table.is_text(name):
        return False
    return bool(np.isnan(table.numbers[table.header.index(name)]).all())


def unused_note(matched: Matched) -> str | None:
    """What is said of columns that are not read; None where there are none."""
    if not matched.unused:
        return None
    text = f"not read: {', '.join(matched.unused[:8])}" + (", ..." if len(matched.unused) > 8 else "")
    errors = [name for name in matched.unused if words_of(name) & ERRORS]
    if errors and not matched.sigmas:
        text += f" (standard errors? --columns sigma={'+'.join(errors[: len(matched.values)])})"
    return text


def channel_names(headers: tuple[str, ...]) -> tuple[str, ...]:
    """``value_R`` and the like lose their prefix."""
    return tuple(name.removeprefix("value_") or name for name in headers)
