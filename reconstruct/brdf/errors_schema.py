"""Uncertainty in the coefficient file's plain values (docs/modes.md)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.covariance_file import BESIDE, hash_of, is_beside, read_beside, triangles_of
from photogonio.reconstruct.brdf.errors import RelativeTable, Uncertain
from photogonio.reconstruct.brdf.parameters import lobe_parameter, mode_names
from photogonio.reconstruct.lobes.lobe import Lobe

OVER = 1e-3  # of a correlation of 1: rounding
NEGATIVE = 0.01  # of a variance of 1, of parameters in units of their errors: numbers written with few digits
ROUGHLY = 0.1  # relative: standard errors may be written with a digit or two
_COVARIANCE = {"channels", "file", "sha256"}
_BEYOND = {"scale", "misfit", "unseen"}
_AXES = {"theta_i": 90.0, "theta_r": 90.0, "dphi": 180.0}  # and their ends, degrees


def errors_document(known: Uncertain, beside: str = BESIDE) -> dict[str, object]:
    """Plain values of the keys ``parameters``, ``standard_errors``, ``covariance``, ``beyond``; the covariance of many
    parameters is named as the file ``beside``, which :func:`reconstruct.brdf.covariance_file.write_beside` writes."""
    said: dict[str, object] = {
        "parameters": list(known.parameters),
        "standard_errors": known.standard_errors.tolist(),
    }
    if known.missing is not None:
        said["covariance"] = known.missing
    elif known.covariance is not None:
        triangles = triangles_of(known.covariance)
        own = (
            {"file": beside, "sha256": hash_of(triangles)}
            if is_beside(known)
            else {"channels": triangles.tolist()}
        )
        said["covariance"] = own | known.beside
    tables = {"misfit": known.misfit, "unseen": known.unseen}
    said["beyond"] = {
        "scale": float(known.scale),
        **{key: _table_document(table) for key, table in tables.items()},
        **known.extra,
    }
    return said


def parse_errors(
    path: Path | str,
    document: dict[str, Any],
    symmetry: str,
    modes: np.ndarray,
    channels: int,
    lobes: tuple[Lobe, ...],
) -> Uncertain:
    """Inverse of :func:`errors_document`."""
    names = _names(path, document, mode_names(symmetry, modes), lobes)
    shape = (len(names), channels)
    errors = parse_standard_errors(path, document, shape)
    beyond = document.get("beyond", {})
    if not isinstance(beyond, dict):
        raise InputError(f"{path}: beyond", f"an object is needed, not {beyond!r:.60}")
    scale = beyond.get("scale", 0.0)
    if isinstance(scale, bool) or not isinstance(scale, int | float) or not 0.0 <= scale < np.inf:
        raise InputError(f"{path}: beyond.scale", f"a number of 0 or more is needed, not {scale!r:.60}")
    given = document.get("covariance")
    covariance, missing = _covariance(Path(path), given, shape, errors)
    return Uncertain(
        parameters=names,
        standard_errors=errors,
        covariance=covariance,
        scale=float(scale),
        misfit=_table(f"{path}: beyond.misfit", beyond.get("misfit")),
        unseen=_table(f"{path}: beyond.unseen", beyond.get("unseen")),
        extra={key: value for key, value in beyond.items() if key not in _BEYOND},
        beside={key: value for key, value in (given or {}).items() if key not in _COVARIANCE},
        missing=missing,
    )


def parse_standard_errors(path: Path | str, document: dict[str, Any], shape: tuple[int, int]) -> np.ndarray:
    """(p, c) of 0 or more; NaN where the file says ``null``, since they are not known."""
    where = f"{path}: standard_errors"
    given = document.get("standard_errors", np.full(shape, np.nan))
    values = _numbers(where, given, shape)
    if (values < 0.0).any() or np.isinf(values).any() or _has_nan(given):
        raise InputError(where, "numbers of 0 or more are needed, or null where one is not known")
    return values


def is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


_NUMBERS = {int, float}


def numbers_only(given: Any, *, or_null: bool = False) -> bool:
    """Whether lists, in one another, hold nothing else: no text and no truth values that pass for numbers."""
    if isinstance(given, list):
        return set(map(type, given)) <= _NUMBERS or all(numbers_only(one, or_null=or_null) for one in given)
    return isinstance(given, np.ndarray) or is_number(given) or (or_null and given is None)


def _has_nan(given: Any) -> bool:
    """Whether a list holds NaN itself, which is no JSON."""
    if isinstance(given, list):
        return any(map(_has_nan, given))
    return isinstance(given, float) and given != given


def _names(path, document, modes: list[str], lobes: tuple[Lobe, ...]) -> tuple[str, ...]:
    names = document.get("parameters")
    if names is None:
        return tuple(modes)
    where = f"{path}: parameters"
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise InputError(where, "a list of names is needed")
    if len(names) < len(modes):
        raise InputError(where, f"the {len(modes)} modes come first, and only {len(names)} are named")
    for said, own in zip(names, modes, strict=False):
        if said.split() != own.split():
            raise InputError(where, f"{own!r} is needed where it says {said!r:.60}, in the order of modes")
    for name in names[len(modes) :]:
        if lobe_parameter(name, lobes) is None:
            raise InputError(where, f"there is no {name!r:.60} in this file")
    twice = sorted({name for name in names if names.count(name) > 1}) if len(set(names)) < len(names) else []
    if twice:
        raise InputError(where, f"{twice[0]!r:.60} is named twice")
    return tuple(names)


def _covariance(
    path: Path, given: Any, shape: tuple[int, int], errors: np.ndarray
) -> tuple[np.ndarray | None, dict[str, Any] | None]:
    """(c, p, p), and what the file names where that is not beside it."""
    if given is None:
        return None, None
    where = f"{path}: covariance"
    if not isinstance(given, dict) or not ("channels" in given or isinstance(given.get("file"), str)):
        raise InputError(where, f'an object with "channels" or "file" is needed, not {given!r:.60}')
    p, c = shape
    triangles = given.get("channels")
    if triangles is None:
        triangles = read_beside(path, given, shape, errors)
        if triangles is None:
            return None, given
    values = _numbers(f"{where}.channels", triangles, (c, p * (p + 1) // 2))
    if not np.isfinite(values).all():
        raise InputError(f"{where}.channels", "every number must be finite")
    rows, columns = np.tril_indices(p)
    whole = np.zeros((c, p, p))
    whole[:, rows, columns] = whole[:, columns, rows] = values
    _check_spread(where, whole)
    if "channels" in given:
        _check_beside_errors(where, whole, errors)
    return whole, None


def _check_beside_errors(where: str, whole: np.ndarray, errors: np.ndarray) -> None:
    """Of a covariance in the file itself: that it is of its standard errors, and can be one at all."""
    size = np.sqrt(np.diagonal(whole, axis1=1, axis2=2))
    known = np.isfinite(errors.T)
    if not np.allclose(size[known], errors.T[known], rtol=ROUGHLY, atol=0.0):
        raise InputError(where, "its variances are not the squares of standard_errors")
    per = np.where(size > 0.0, size, 1.0)
    if np.linalg.eigvalsh(whole / (per[:, :, None] * per[:, None, :])).min(initial=0.0) < -NEGATIVE:
        raise InputError(where, "some sum of parameters has a negative variance")


def _check_spread(where: str, whole: np.ndarray) -> None:
    variance = np.diagonal(whole, axis1=1, axis2=2)
    if (variance < 0.0).any():
        raise InputError(where, "a variance is negative")
    size = np.sqrt(variance)
    most = (1.0 + OVER) * size[:, :, None] * size[:, None, :]
    if (np.abs(whole) > most + np.finfo(float).tiny).any():
        raise InputError(where, "two parameters go together by more than 1")


def _table_document(table: RelativeTable | None) -> dict[str, object]:
    if table is None:
        return {"relative": []}
    axes = {name: [_short(angle) for angle in getattr(table, name).tolist()] for name in _AXES}
    return axes | {"relative": table.relative.tolist()} | table.extra


def _short(angle: float) -> float | int:
    return int(angle) if angle == int(angle) else angle


def _table(where: str, given: Any) -> RelativeTable | None:
    if given is None:
        return None
    if not isinstance(given, dict):
        raise InputError(where, f"an object is needed, not {given!r:.60}")
    if not given.get("relative"):
        return None
    axes = [_axis(f"{where}.{name}", given.get(name), end) for name, end in _AXES.items()]
    shape = tuple(len(axis) for axis in axes)
    values = _as_numbers(f"{where}.relative", given["relative"], "numbers are needed")
    if values.size != np.prod(shape):
        raise InputError(f"{where}.relative", f"{shape} numbers are needed, not {values.shape}")
    if not (np.isfinite(values) & (values >= 0.0)).all():
        raise InputError(f"{where}.relative", "every number must be finite, and 0 or more")
    theta_i, theta_r, dphi = axes
    extra = {key: value for key, value in given.items() if key not in {*_AXES, "relative"}}
    return RelativeTable(theta_i, theta_r, dphi, values.reshape(shape), extra)


def _axis(where: str, given: Any, end: float) -> np.ndarray:
    nodes = _as_numbers(where, given, "angles in degrees are needed")
    inside = nodes.ndim == 1 and len(nodes) > 0 and bool(((nodes >= 0.0) & (nodes <= end)).all())
    if not inside or (np.diff(nodes) <= 0.0).any():
        raise InputError(where, f"ascending angles from 0 to {end:g} degrees are needed")
    return nodes


def _as_numbers(where: str, given: Any, needed: str) -> np.ndarray:
    """Of lists of numbers and ``null``, and nothing that only passes for one."""
    try:
        values = np.array(given, float)
    except (TypeError, ValueError):
        raise InputError(where, needed) from None
    if not numbers_only(given, or_null=True):
        raise InputError(where, needed)
    return values


def _numbers(where: str, given: Any, shape: tuple[int, int]) -> np.ndarray:
    values = _as_numbers(where, given, "numbers are needed")
    if values.size == 0 and 0 in shape:
        return np.zeros(shape)
    if values.shape != shape:
        raise InputError(where, f"{shape} numbers are needed, not {values.shape}")
    return values
