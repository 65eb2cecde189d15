"""Uncertainty in the coefficient file's plain values (docs/modes.md)."""

from __future__ import annotations

import hashlib
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.errors import RelativeTable, Uncertain
from photogonio.reconstruct.brdf.parameters import lobe_parameter
from photogonio.reconstruct.lobes.lobe import Lobe

MOST_INSIDE = 150  # parameters whose covariance is in the file itself
BESIDE = "covariance.npz"
_BEYOND = {"scale", "misfit", "unseen"}
_AXES = ("theta_i", "theta_r", "dphi")


def errors_document(known: Uncertain) -> dict[str, object]:
    """Plain values of the keys ``parameters``, ``standard_errors``, ``covariance``, ``beyond``; the covariance
    of many parameters is named, and is written by :func:`write_beside`."""
    said: dict[str, object] = {
        "parameters": list(known.parameters),
        "standard_errors": known.standard_errors.tolist(),
    }
    if known.covariance is not None:
        triangles = _triangles(known.covariance)
        inside = len(known.parameters) <= MOST_INSIDE
        said["covariance"] = (
            {"channels": triangles.tolist()}
            if inside
            else {"file": BESIDE, "sha256": hashlib.sha256(triangles.tobytes()).hexdigest()}
        )
    tables = {"misfit": known.misfit, "unseen": known.unseen}
    said["beyond"] = {
        "scale": float(known.scale),
        **{key: _table_document(table) for key, table in tables.items()},
        **known.extra,
    }
    return said


def is_beside(known: Uncertain | None) -> bool:
    """Whether the covariance is in a file beside the coefficients."""
    return known is not None and known.covariance is not None and len(known.parameters) > MOST_INSIDE


def write_beside(known: Uncertain | None, folder: Path) -> None:
    """Write the lower triangles, by rows, one a channel, as the array ``channels`` of an .npz; nothing where they are
    not to stand beside the coefficients."""
    if known is not None and known.covariance is not None and is_beside(known):
        np.savez_compressed(folder / BESIDE, channels=_triangles(known.covariance))


def parse_errors(
    path: Path | str, document: dict[str, Any], size: tuple[int, int], lobes: tuple[Lobe, ...]
) -> Uncertain:
    """Inverse of :func:`errors_document`; ``size`` is that of the modes' coefficients."""
    names = _names(path, document, size[0], lobes)
    shape = (len(names), size[1])
    errors = _numbers(
        f"{path}: standard_errors", document.get("standard_errors", np.full(shape, np.nan)), shape
    )
    beyond = document.get("beyond", {})
    if not isinstance(beyond, dict):
        raise InputError(f"{path}: beyond", f"an object is needed, not {beyond!r}")
    scale = beyond.get("scale", 0.0)
    if isinstance(scale, bool) or not isinstance(scale, int | float) or not 0.0 <= scale < np.inf:
        raise InputError(f"{path}: beyond.scale", f"a number of 0 or more is needed, not {scale!r}")
    return Uncertain(
        parameters=names,
        standard_errors=errors,
        covariance=_covariance(path, document.get("covariance"), shape),
        scale=float(scale),
        misfit=_table(f"{path}: beyond.misfit", beyond.get("misfit")),
        unseen=_table(f"{path}: beyond.unseen", beyond.get("unseen")),
        extra={key: value for key, value in beyond.items() if key not in _BEYOND},
    )


def _names(path, document, modes: int, lobes: tuple[Lobe, ...]) -> tuple[str, ...]:
    names = document.get("parameters")
    if names is None:
        return tuple(f"mode {k}" for k in range(modes))
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise InputError(f"{path}: parameters", "a list of names is needed")
    if len(names) < modes:
        raise InputError(
            f"{path}: parameters", f"the {modes} modes come first, and only {len(names)} are named"
        )
    for name in names[modes:]:
        if lobe_parameter(name, lobes) is None:
            raise InputError(f"{path}: parameters", f"there is no {name!r} in this file")
    return tuple(names)


def _covariance(path, given: Any, shape: tuple[int, int]) -> np.ndarray | None:
    if given is None:
        return None
    where = f"{path}: covariance"
    if not isinstance(given, dict):
        raise InputError(where, f"an object is needed, not {given!r}")
    p, c = shape
    triangles = given.get("channels")
    if triangles is None:
        triangles = _beside(where, Path(path).parent / BESIDE, given)
        if triangles is None:
            return None
    values = _numbers(f"{where}.channels", triangles, (c, p * (p + 1) // 2))
    if not np.isfinite(values).all():
        raise InputError(f"{where}.channels", "every number must be finite")
    rows, columns = np.tril_indices(p)
    whole = np.zeros((c, p, p))
    whole[:, rows, columns] = whole[:, columns, rows] = values
    return whole


def _beside(where: str, path: Path, given: dict[str, Any]) -> np.ndarray | None:
    """What lies beside the file, or None: a file of coefficients may travel alone."""
    if not path.is_file():
        return None
    try:
        with np.load(path, allow_pickle=False) as file:
            triangles = np.asarray(file["channels"], float)
    except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise InputError(path, f"cannot be read as the covariance of the file beside it: {error}") from None
    known = given.get("sha256")
    if known is not None and hashlib.sha256(triangles.tobytes()).hexdigest() != known:
        raise InputError(where, f"{path.name} beside it is of other coefficients")
    return triangles


def _triangles(covariance: np.ndarray) -> np.ndarray:
    """(c, p (p + 1) / 2) lower triangles by rows."""
    rows, columns = np.tril_indices(covariance.shape[1])
    return np.ascontiguousarray(covariance[:, rows, columns])


def _table_document(table: RelativeTable | None) -> dict[str, object]:
    if table is None:
        return {"relative": []}
    axes = {name: [_short(angle) for angle in getattr(table, name).tolist()] for name in _AXES}
    return axes | {"relative": table.relative.tolist()}


def _short(angle: float) -> float | int:
    return int(angle) if angle == int(angle) else angle


def _table(where: str, given: Any) -> RelativeTable | None:
    if given is None:
        return None
    if not isinstance(given, dict):
        raise InputError(where, f"an object is needed, not {given!r}")
    if not given.get("relative"):
        return None
    axes = [_axis(f"{where}.{name}", given.get(name)) for name in _AXES]
    shape = tuple(len(axis) for axis in axes)
    try:
        values = np.array(given["relative"], float)
    except (TypeError, ValueError):
        raise InputError(f"{where}.relative", "numbers are needed") from None
    if values.size != np.prod(shape) or not np.isfinite(values).all() or (values < 0.0).any():
        raise InputError(f"{where}.relative", f"{shape} numbers of 0 or more are needed, not {values.shape}")
    theta_i, theta_r, dphi = axes
    return RelativeTable(theta_i, theta_r, dphi, values.reshape(shape))


def _axis(where: str, given: Any) -> np.ndarray:
    try:
        nodes = np.array(given, float)
    except (TypeError, ValueError):
        raise InputError(where, "angles in degrees are needed") from None
    if nodes.ndim != 1 or not len(nodes) or not np.isfinite(nodes).all() or (np.diff(nodes) <= 0.0).any():
        raise InputError(where, "ascending angles in degrees are needed")
    return nodes


def _numbers(where: str, given: Any, shape: tuple[int, int]) -> np.ndarray:
    try:
        values = np.array(given, float)
    except (TypeError, ValueError):
        raise InputError(where, "numbers are needed") from None
    if values.size == 0 and 0 in shape:
        return np.zeros(shape)
    if values.shape != shape:
        raise InputError(where, f"{shape} numbers are needed, not {values.shape}")
    return values
