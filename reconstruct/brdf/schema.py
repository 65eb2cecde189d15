"""The coefficient file as plain values: what a reader must check, and how a writer keeps what it does not
know.

JSON, one object (docs/modes.md). Standard errors that are not known are ``null`` in the file and NaN here. Version 1,
with GGX lobes alone and no covariance, is read for good, and written back as such.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.covariance_file import BESIDE
from photogonio.reconstruct.brdf.errors_schema import (
    errors_document,
    is_number,
    numbers_only,
    parse_errors,
    parse_standard_errors,
)
from photogonio.reconstruct.brdf.fresh import KEY as FRESH
from photogonio.reconstruct.brdf.fresh import fresh_fault
from photogonio.reconstruct.brdf.lobe_schema import (
    MIXED,
    first_document,
    is_of_first_version,
    lobe_document,
    parse_lobe,
)

FORMAT, VERSIONS = "surface-scattering-modes", (1, 2)
HIGHEST = 100  # order of modes: a value of one of them takes so many steps, and no fit is a third as fine
LARGEST = 1e12  # of any number: squares and sums of them stay numbers
MOST_CHANNELS = 4096
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
_ERROR_KEYS = {"parameters", "covariance", "beyond"}  # of version 2


def document(brdf, beside: str = BESIDE) -> dict:
    """What the file says of a :class:`reconstruct.brdf.brdf.Brdf`, in JSON's types, the covariance of many parameters
    being in the file ``beside``. Inverse of :func:`parse`."""
    version = 1 if brdf.version == 1 and is_first_version(brdf) else 2
    lobes = [(first_document if version == 1 else lobe_document)(lobe) for lobe in brdf.lobes]
    errors = {"standard_errors": _plain(np.asarray(brdf.standard_errors, float))}
    if brdf.uncertainty is not None:
        errors = _plain(errors_document(brdf.uncertainty, beside))
    return {
        "format": FORMAT,
        "version": version,
        "quantity": brdf.quantity,
        "symmetry": brdf.symmetry,
        "order": int(brdf.order),
        "channels": list(brdf.channels),
        "modes": np.asarray(brdf.modes, int).tolist(),
        "coefficients": _floats(brdf.coefficients),
        "lobes": _plain(lobes),
        **errors,
        "scale": brdf.scale,
        "valid": _plain(brdf.valid),
        "fit": _plain(brdf.fit),
        "source": _plain(brdf.source),
        **_plain(brdf.extra),
    }


def is_first_version(brdf) -> bool:
    """Whether version 1 says all of a BRDF."""
    return brdf.uncertainty is None and all(is_of_first_version(lobe) for lobe in brdf.lobes)


def _floats(values) -> list:
    return np.asarray(values, float).tolist()


def _plain(value):
    """The value in JSON's own types; what is not finite becomes null."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray) and value.dtype.kind == "f":
        told = np.isfinite(value)
        return value.tolist() if told.all() else np.where(told, value, None).tolist()
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


def parse(path: Path | str, document: Any) -> dict[str, Any]:
    """Arguments of a Brdf. InputError names the file and the key that cannot be used.

    ``path`` is for the message, and for what lies beside the file. Inverse of :func:`document`.
    """
    version = _check_format(path, document)
    channels = document.get("channels")
    if not isinstance(channels, list) or not channels or not all(isinstance(c, str) for c in channels):
        raise InputError(f"{path}: channels", f"a list of names is needed, not {channels!r:.60}")
    if len(set(channels)) < len(channels) or len(channels) > MOST_CHANNELS:
        raise InputError(f"{path}: channels", f"at most {MOST_CHANNELS} different names are needed")
    known: dict[str, Any] = {key: _choice(path, document, key) for key in _CHOICES}
    rows = _modes(path, document, known["symmetry"])
    size = (len(rows), len(channels))
    lobes = document.get("lobes", [])
    if not isinstance(lobes, list) or not all(isinstance(lobe, dict) for lobe in lobes):
        raise InputError(f"{path}: lobes", "a list of objects is needed")
    bounded = version > 1 and document.get(MIXED) is not True
    known["lobes"] = tuple(
        parse_lobe(path, k, lobe, len(channels), version, bounded) for k, lobe in enumerate(lobes)
    )
    known["uncertainty"] = None
    if version > 1 and _ERROR_KEYS & set(document):
        known["uncertainty"] = parse_errors(
            path, document, known["symmetry"], rows, len(channels), known["lobes"]
        )
        errors = known["uncertainty"].standard_errors[: len(rows)]
    else:
        errors = parse_standard_errors(path, document, size)
    keys = _KEYS if version == 1 else _KEYS | _ERROR_KEYS
    known |= {
        "version": version,
        "order": _order(path, document, known["symmetry"], rows),
        "channels": tuple(channels),
        "modes": rows,
        "coefficients": _array(path, "coefficients", document.get("coefficients"), size),
        "standard_errors": errors,
        "extra": {key: value for key, value in document.items() if key not in keys},
    }
    for key in ("valid", "fit", "source"):
        known[key] = document.get(key, {})
        if not isinstance(known[key], dict):
            raise InputError(f"{path}: {key}", f"an object is needed, not {known[key]!r:.60}")
    wrong = fresh_fault(known["fit"], len(channels))
    if wrong is not None:
        raise InputError(f"{path}: fit.{FRESH}", wrong)
    for name, angle in known["valid"].items():
        if name.startswith("theta") and not (is_number(angle) and 0.0 <= angle <= 90.0):
            raise InputError(
                f"{path}: valid.{name}"[:200], f"an angle in degrees is needed, not {angle!r:.60}"
            )
    return known


def _check_format(path, document) -> int:
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise InputError(f"{path}: format", f"{FORMAT!r} is needed: this is no coefficient file")
    version = document.get("version")
    if isinstance(version, bool) or version not in VERSIONS:
        raise InputError(f"{path}: version", f"1 and 2 are understood, not {version!r}")
    return version


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
    if not np.array_equal(rows, np.round(rows)) or len(rows) != len(given) or not numbers_only(given):
        raise InputError(f"{path}: modes", f"rows of {width} whole numbers are needed")
    if (abs(rows) > HIGHEST).any():
        raise InputError(f"{path}: modes", f"modes to order {HIGHEST} are understood")
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
    if not isinstance(order, int) or isinstance(order, bool):
        raise InputError(f"{path}: order", f"a whole number is needed, not {order!r:.60}")
    if not largest <= order <= HIGHEST:
        raise InputError(f"{path}: order", f"the modes reach order {largest}, not {order!r:.60}")
    return order


def _array(path, key, given, shape) -> np.ndarray:
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
    if not np.isfinite(values).all() or (np.abs(values) > LARGEST).any():
        raise InputError(f"{path}: {key}", f"every number must be finite, and at most {LARGEST:g}")
    if not numbers_only(given):
        raise InputError(f"{path}: {key}", "numbers are needed")
    return values
