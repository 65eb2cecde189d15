"""Lobes as the coefficient file's plain values, in both its versions (docs/modes.md)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.lobes.lobe import DISTRIBUTIONS, FRESNELS, MASKINGS, MODELS, PEAKS, Lobe

FIRST = {  # what the lobes of version 1 are in version 2
    "ggx": {"model": "mirror"},
    "retro-ggx": {"model": "retro", "distribution": "ggx"},
    "retro-beckmann": {"model": "retro", "distribution": "beckmann"},
}
DECIMALS = 11  # of an azimuth in degrees: more are those of its being turned into radians and back
MOST_OF_TWO = 12.0  # roughness of one of two axes: what a search of their mean up to 1 may reach
OVER = 1e-6  # of a base reflectance of 1: rounding
MIXED = "mixed"  # key of a file: channels are sums of others', and may lie beyond what a surface reflects
_FIRST_KEYS = {"model", "roughness", "f0", "weight"}
_KEYS = _FIRST_KEYS | {"distribution", "masking", "fresnel", "azimuth", "ground"}
_CHOICES = {"distribution": DISTRIBUTIONS, "masking": MASKINGS, "fresnel": FRESNELS}


def lobe_document(lobe: Lobe) -> dict[str, object]:
    """A lobe of version 2. Inverse of :func:`parse_lobe`."""
    said: dict[str, object] = {"model": lobe.model, "distribution": lobe.distribution}
    if not lobe.peak:
        said |= {"masking": lobe.masking, "fresnel": lobe.fresnel}
    said["roughness"] = list(lobe.axes) if lobe.turning else lobe.axes[0]
    if lobe.turning:
        said["azimuth"] = round(float(np.degrees(lobe.azimuth)), DECIMALS)
    if not lobe.peak:
        said["f0"] = float(lobe.f0[0]) if lobe.fresnel == "dielectric" else _floats(lobe.f0)
    said["weight"] = _floats(lobe.weight)
    if lobe.ground is not None:
        said["ground"] = _floats(lobe.ground)
    return said | lobe.extra


def is_of_first_version(lobe: Lobe) -> bool:
    """Whether version 1 has such a lobe."""
    if lobe.turning or lobe.model in ("coat", "round"):
        return False
    own = (lobe.distribution, lobe.masking, lobe.fresnel)
    return lobe.model == "retro" or own == ("ggx", "correlated", "schlick")


def first_document(lobe: Lobe) -> dict[str, object]:
    """The same of version 1."""
    model = f"retro-{lobe.distribution}" if lobe.model == "retro" else "ggx"
    said = {"model": model, "roughness": lobe.axes[0], "f0": _floats(lobe.f0)}
    return said | {"weight": _floats(lobe.weight)} | lobe.extra


def is_bounded(lobe: Lobe) -> bool:
    """Whether it reflects no less than nothing, and at most all, in every channel."""
    mirror = (
        lobe.peak or lobe.fresnel == "dielectric" or bool(((lobe.f0 >= 0.0) & (lobe.f0 <= 1.0 + OVER)).all())
    )
    ground = lobe.ground is None or bool((lobe.ground >= 0.0).all())
    return mirror and ground and bool((lobe.weight >= 0.0).all())


def parse_lobe(
    path: Path | str, place: int, given: dict[str, Any], channels: int, version: int, bounded: bool
) -> Lobe:
    """A lobe from the file; ``bounded``: one that reflects less than nothing or more than all is refused. InputError
    names the key that cannot be used."""
    where = f"{path}: lobes[{place}]"
    names = list(FIRST) if version == 1 else [*MODELS, "ggx"]
    model = given.get("model")
    if not isinstance(model, str) or model not in names:
        raise InputError(f"{where}.model", f"one of {', '.join(names)} is needed, not {model!r}")
    known: dict[str, Any] = dict(FIRST.get(model, {"model": model}))
    if version > 1:
        known |= _choices(where, given, model)
    known["roughness"] = _roughness(f"{where}.roughness", given.get("roughness"), known["model"], version)
    known["azimuth"] = float(np.radians(_number(f"{where}.azimuth", given.get("azimuth", 0.0))))
    least = 0.0 if bounded else -np.inf
    known["weight"] = _channels(f"{where}.weight", given.get("weight"), channels, least)
    known["f0"] = _f0(f"{where}.f0", given.get("f0"), known, channels, version)
    if (bounded and not known["f0"].max(initial=0.0) <= 1.0 + OVER) or known["f0"].min(initial=0.0) < least:
        raise InputError(f"{where}.f0", f"numbers from 0 to 1 are needed, not {given.get('f0')!r:.60}")
    if known["model"] == "coat":
        known["ground"] = _channels(f"{where}.ground", given.get("ground"), channels, least)
    keys = _FIRST_KEYS if version == 1 else _KEYS
    return Lobe(**known, extra={key: value for key, value in given.items() if key not in keys})


def _choices(where: str, given: dict[str, Any], model: str) -> dict[str, str]:
    chosen = {}
    for key, values in _CHOICES.items():
        default = "dielectric" if (key, model) == ("fresnel", "coat") else values[0]
        chosen[key] = given.get(key, default)
        if chosen[key] not in values:
            raise InputError(f"{where}.{key}", f"one of {', '.join(values)} is needed, not {chosen[key]!r}")
    if model == "coat" and chosen["fresnel"] != "dielectric":
        raise InputError(f"{where}.fresnel", "a coat is a dielectric")
    return chosen


def _roughness(where: str, given: Any, model: str, version: int) -> float | tuple[float, float]:
    what, most = "a number in (0, 1]", 1.0
    several = version > 1 and model not in PEAKS
    if several:
        what += f", or two up to {MOST_OF_TWO:g}, along and across,"
    both = [given]
    if several and isinstance(given, list) and len(given) == 2:
        both, most = given, MOST_OF_TWO
    if not all(
        isinstance(one, int | float) and not isinstance(one, bool) and 0 < one <= most for one in both
    ):
        raise InputError(where, f"{what} is needed, not {given!r}")
    return (float(both[0]), float(both[1])) if len(both) == 2 else float(given)


def _f0(where: str, given: Any, known: dict[str, Any], channels: int, version: int) -> np.ndarray:
    if version > 1 and known["model"] in PEAKS:
        return np.ones(channels)
    if known.get("fresnel") != "dielectric":
        return _channels(where, given, channels)
    f0 = _number(where, given)
    if not 0.0 < f0 < 1.0:
        raise InputError(where, f"one number between 0 and 1 is needed, not {given!r}")
    return np.full(channels, f0)


def _number(where: str, given: Any) -> float:
    if isinstance(given, bool) or not isinstance(given, int | float) or not np.isfinite(given):
        raise InputError(where, f"a number is needed, not {given!r}")
    return float(given)


def _channels(where: str, given: Any, channels: int, least: float = -np.inf) -> np.ndarray:
    try:
        values = np.array(given, float)
    except (TypeError, ValueError):
        raise InputError(where, "numbers are needed") from None
    if values.shape != (channels,):
        raise InputError(where, f"{(channels,)} numbers are needed, one a channel, not {values.shape}")
    if not np.isfinite(values).all():
        raise InputError(where, "every number must be finite")
    if (values < least).any():
        raise InputError(where, f"numbers of {least:g} or more are needed, not {given!r:.60}")
    return values


def _floats(values) -> list[float]:
    return np.asarray(values, float).tolist()
