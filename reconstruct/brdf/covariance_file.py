"""The covariance of many parameters, which is in a file beside the coefficients (docs/modes.md)."""

from __future__ import annotations

import errno
import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.capture.files.arrays import read_arrays
from photogonio.capture.files.documents import read_json
from photogonio.reconstruct.brdf.errors import Uncertain

MOST_INSIDE = 150  # parameters whose covariance is in the file itself
BESIDE = "covariance.npz"
COEFFICIENTS = "coefficients.json"  # of a result, whose covariance has the name of the page
LONGEST = 200  # characters of a file's name
FULL = {
    errno.ENOSPC,
    errno.EFBIG,
    getattr(errno, "EDQUOT", errno.ENOSPC),
    errno.EIO,
}  # of the place, not of its name
DIAGONAL = 0.02  # relative: standard errors are written with few digits


def is_beside(known: Uncertain | None) -> bool:
    """Whether the covariance is in a file beside the coefficients."""
    return known is not None and known.covariance is not None and len(known.parameters) > MOST_INSIDE


def triangles_of(covariance: np.ndarray) -> np.ndarray:
    """(c, p (p + 1) / 2) lower triangles by rows."""
    rows, columns = np.tril_indices(covariance.shape[1])
    return np.ascontiguousarray(covariance[:, rows, columns])


def hash_of(triangles: np.ndarray) -> str:
    return hashlib.sha256(np.ascontiguousarray(triangles, float).tobytes()).hexdigest()


def name_beside(path: Path) -> str:
    """What the file beside the coefficients ``path`` is to be called: as the page has it, or by its name where that is
    another's."""
    there = path.parent / BESIDE
    if not there.exists() or _named_in(path) == BESIDE:
        return BESIDE
    others = (one for one in path.parent.glob("*.json") if one.name != path.name)
    if path.name == COEFFICIENTS and all(_named_in(one) != BESIDE for one in others):
        return BESIDE
    return f"{path.stem}.{BESIDE}"


def _named_in(path: Path) -> str | None:
    """The file that coefficients which are there already name."""
    try:
        given = read_json(path)["covariance"]["file"] if path.is_file() else None
    except (InputError, KeyError, TypeError):
        return None
    return given if isinstance(given, str) else None


def write_beside(known: Uncertain, path: Path) -> None:
    """Write the lower triangles, by rows, one a channel, as the array ``channels`` of an .npz, whole or not at all."""
    if known.covariance is None:
        return
    triangles = triangles_of(known.covariance)
    write_whole(path, lambda file: np.savez_compressed(file, channels=triangles))


def write_whole(path: Path, write: Callable[[IO[bytes]], object]) -> None:
    """A file that ``write`` fills through a binary handle, whole or not at all.

    Raises:
        InputError: its folder is not there, or it cannot be written there.
        OSError: there is no room for it, which is nobody's input.
    """
    if not path.parent.is_dir():
        raise InputError(path, f"there is no folder {path.parent}")
    temporary = None
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.name, suffix=".part")
        with os.fdopen(handle, "wb") as file:
            write(file)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except OSError as error:
        if error.errno in FULL:
            raise
        raise InputError(path, f"cannot be written: {error.strerror or error}") from None
    finally:  # there only if the writing was cut short
        if temporary is not None:
            Path(temporary).unlink(missing_ok=True)


def read_beside(
    path: Path, given: dict[str, Any], shape: tuple[int, int], errors: np.ndarray
) -> np.ndarray | None:
    """(c, p (p + 1) / 2) what lies beside the coefficients ``path``, as ``given`` names it; None where it is missing.

    Raises:
        InputError: the name is none, or what lies there is no covariance of these coefficients.
    """
    where, name = f"{path}: covariance", given.get("file", BESIDE)
    if not isinstance(name, str) or not 0 < len(name) <= LONGEST or Path(name).name != name:
        raise InputError(f"{where}.file", f"the name of a file beside this one is needed, not {name!r:.60}")
    beside = path.parent / name
    if not beside.is_file():
        return None
    found = read_arrays(beside, f"the covariance of {path.name}").get("channels")
    if found is None or found.dtype.kind not in "iuf":
        raise InputError(beside, f"holds no numbers called channels, as the covariance of {path.name} does")
    triangles = np.asarray(found, float)
    p, c = shape
    if triangles.shape != (c, p * (p + 1) // 2):
        raise InputError(where, f"{name} beside it is of other coefficients")
    known = given.get("sha256")
    if known is not None and hash_of(triangles) != known:
        raise InputError(where, f"{name} beside it is of other coefficients")
    diagonal = np.sqrt(np.maximum(triangles[:, np.cumsum(np.arange(1, p + 1)) - 1], 0.0)).T
    if known is None and not np.allclose(diagonal, errors, rtol=DIAGONAL, equal_nan=True):
        raise InputError(where, f"{name} beside it is of other standard errors")
    return triangles
