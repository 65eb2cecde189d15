"""The coefficient file as plain values: what a reader must check, and how a writer keeps what it does not
know.

JSON, one object (docs/modes.md). Standard errors that are not known are ``null`` in the file and NaN here.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from photogonio.capture.errors import InputError
from photogonio.reconstruct.lobes.schlick import MODELS

FORMAT, VERSION = "surface-scattering-modes", 1
_CHOICES = {
    "quantity": ("brdf", "brdf_cos", "brdf_cos_cos"),
    "symmetry": ("isotropic", "reciprocal", "general"),
    "scale": ("absolute", "relative"),
}
_KEYS = {
    "format",
    "version",
    "order",
    "channels",
    "modes",
    "coefficients",
    "standard_errors",
    "lobes",
    "valid",
    "fit",
    "source",
    *_CHOICES,
}
_LOBE_KEYS = {"model", "roughness", "f0", "weight"}


def document(brdf) -> dict:
    """What the file says of a :class:`reconstruct.brdf.brdf.Brdf`, in JSON's types. Inverse of :func:`parse`."""
    lobes = [
        {
            "model": lobe.model,
            "roughness": float(lobe.roughness),
            "f0": _floats(lobe.f0),
            "weight": _floats(lobe.weight),
            **lobe.extra,
        }
        for lobe in brdf.lobes
    ]
    return {
        "format": FORMAT,
        "version": VERSION,
        "quantity": brdf.quantity,
        "symmetry": brdf.symmetry,
        "order": int(brdf.order),
        "channels": list(brdf.channels),
        "modes": np.asarray(brdf.modes, int).tolist(),
        "coefficients": _floats(brdf.coefficients),
        "standard_errors": _plain(np.asarray(brdf.standard_errors, float)),
        "lobes": lobes,
        "scale": brdf.scale,
        "valid": _plain(brdf.valid),
        "fit": _plain(brdf.fit),
        "source": _plain(brdf.source),
        **_plain(brdf.extra),
    }


def _floats(values) -> list:
    return np.asarray(values, float).tolist()


def _plain(value):
    """The value in JSON's own types; what is not finite becomes null."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


def parse(path: Path | str, document: Any) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Arguments of a Brdf and of its lobes. InputError names the file and the key that cannot be used.

    ``path`` is for the message only. Inverse of :func:`document`.
    """
    _check_format(path, document)
    channels = document.get("channels")
    if not isinstance(channels, list) or not channels or not all(isinstance(c, str) for c in channels):
        raise InputError(f"{path}: channels", f"a list of names is needed, not {channels!r}")
    known: dict[str, Any] = {key: _choice(path, document, key) for key in _CHOICES}
    rows = _modes(path, document, known["symmetry"])
    size = (len(rows), len(channels))
    errors = _array(
        path, "standard_errors", document.get("standard_errors", np.full(size, np.nan)), size, True
    )
    known |= {
        "order": _order(path, document, known["symmetry"], rows),
        "channels": tuple(channels),
        "modes": rows,
        "coefficients": _array(path, "coefficients", document.get("coefficients"), size),
        "standard_errors": errors,
        "extra": {key: value for key, value in document.items() if key not in _KEYS},
    }
    for key in ("valid", "fit", "source"):
        known[key] = document.get(key, {})
        if not isinstance(known[key], dict):
            raise InputError(f"{path}: {key}", f"an object is needed, not {known[key]!r}")
    lobes = document.get("lobes", [])
    if not isinstance(lobes, list) or not all(isinstance(lobe, dict) for lobe in lobes):
        raise InputError(f"{path}: lobes", "a list of objects is needed")
    return known, [_lobe(path, k, lobe, len(channels)) for k, lobe in enumerate(lobes)]


def _check_format(path, document) -> None:
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise InputError(f"{path}: format", f"{FORMAT!r} is needed: this is no coefficient file")
    if document.get("version") != VERSION:
        raise InputError(f"{path}: version", f"{VERSION} is understood, not {document.get('version')!r}")


def _choice(path, document, key) -> str:
    value = document.get(key, _CHOICES[key][0])
    if value not in _CHOICES[key]:
        raise InputError(f"{path}: {key}", f"one of {', '.join(_CHOICES[key])} is needed, not {value!r}")
    return value


def _modes(path, document, symmetry) -> np.ndarray:
    width = 3 if symmetry == "isotropic" else 4
    given = document.get("modes")
    try:
        rows = np.array(given, float).reshape(-1, width)
    except (TypeError, ValueError):
        raise InputError(f"{path}: modes", f"rows of {width} whole numbers are needed") from None
    if not np.array_equal(rows, np.round(rows)) or len(rows) != len(given) or (abs(rows) > 10_000).any():
        raise InputError(f"{path}: modes", f"rows of {width} whole numbers are needed")
    whole = rows.astype(int)
    if symmetry == "isotropic":
        n, m, l = whole.T
        wrong = (m > n) | (l > m) | (l < 0) | ((n - l) % 2 != 0) | ((m - l) % 2 != 0)
    else:
        n, l, m, p = whole.T
        wrong = (abs(l) > n) | (abs(p) > m) | ((n - l) % 2 != 0) | ((m - p) % 2 != 0)
    if wrong.any():
        raise InputError(f"{path}: modes", f"there is no {symmetry} mode {whole[wrong][0].tolist()}")
    if len(np.unique(whole, axis=0)) != len(whole):
        raise InputError(f"{path}: modes", "a mode is listed twice")
    return whole


def _order(path, document, symmetry, rows) -> int:
    largest = int(rows[:, [0] if symmetry == "isotropic" else [0, 2]].max(initial=0))
    order = document.get("order", largest)
    if not isinstance(order, int) or order < largest:
        raise InputError(f"{path}: order", f"the modes reach order {largest}, not {order!r}")
    return order


def _array(path, key, given, shape, may_miss=False) -> np.ndarray:
    try:
        values = np.array(given, float)
    except (TypeError, ValueError):
        raise InputError(f"{path}: {key}", "numbers are needed") from None
    if values.size == 0 and 0 in shape:
        return np.zeros(shape)
    if values.shape != shape:
        raise InputError(
            f"{path}: {key}", f"{shape} numbers are needed (modes, channels), not {values.shape}"
        )
    if not (may_miss or np.isfinite(values).all()):
        raise InputError(f"{path}: {key}", "every number must be finite")
    return values


def _lobe(path, place, lobe, channels) -> dict:
    where = f"lobes[{place}]"
    model = lobe.get("model")
    if model not in MODELS:
        raise InputError(f"{path}: {where}.model", f"one of {', '.join(MODELS)} is needed, not {model!r}")
    roughness = lobe.get("roughness")
    if not isinstance(roughness, int | float) or not 0 < roughness <= 1:
        raise InputError(f"{path}: {where}.roughness", f"a number in (0, 1] is needed, not {roughness!r}")
    known = {"model": model, "roughness": float(roughness)}
    for key in ("f0", "weight"):
        known[key] = _array(path, f"{where}.{key}", lobe.get(key), (channels,))
    return known | {"extra": {key: value for key, value in lobe.items() if key not in _LOBE_KEYS}}
