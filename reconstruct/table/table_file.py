"""The file of a facet table, ``.npz``: the same bytes for the same table, and all that is read is checked."""

from __future__ import annotations

import json
import math
import os
import threading
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.capture.files.arrays import DAMAGED, KINDS, read_arrays
from photogonio.reconstruct.table.facet_table import LEFT_OUT, SUMS, FacetTable
from photogonio.reconstruct.table.facets import facet_count

FORMAT = 1
FINEST = 8  # level of facets that a cell's number of 64 bits holds beside 10^6 groups
LARGEST = 1e30  # of any sum: its square is a number
MOST_CHANNELS = 4096
UNIT = 1.0 + 1e-6  # length of a mean of unit vectors, at most
LOOKED_AT = 1 << 16  # bytes of an array, that tell whether it packs
WORTH_PACKING = (
    0.75  # of its size, at most, that is left: half a second of a run goes into a tenth of the file else
)
PHOTOS = "photos"  # the array that says of a table of photos what is known of them
_WHAT = "a facet table"
_WIDTHS = {
    "count": 0,
    "weight": 0,
    "incident": 3,
    "exit": 3,
    "place": 3,
}  # of the sums; else a column a channel


def save_table(
    table: FacetTable,
    path: Path,
    *,
    source: str = "",
    beside: Mapping[str, np.ndarray] | None = None,
) -> None:
    """Write the table as ``.npz``: whole or not at all, the same bytes for the same table.

    ``source`` says where it came from, ``beside`` what else belongs to it; the file keeps both beside the table.
    """
    path = Path(path)
    partial = path.with_name(f"{path.name}.{os.getpid()}-{threading.get_ident()}.part")

    arrays = _arrays(table) | {"source": np.array(source)} | dict(beside or {})
    try:
        with zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            for name, array in arrays.items():
                # a fixed date, since a zip entry holds one
                entry = zipfile.ZipInfo(name + ".npy", date_time=(1980, 1, 1, 0, 0, 0))
                entry.compress_type = zipfile.ZIP_DEFLATED if _packs(array) else zipfile.ZIP_STORED
                with archive.open(entry, "w", force_zip64=True) as file:
                    np.lib.format.write_array(file, array, allow_pickle=False)
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


def _packs(array: np.ndarray) -> bool:
    """Whether an array is worth packing, as its first bytes tell: sums over pixels are mostly noise."""
    start = array.ravel()[: max(1, LOOKED_AT // max(1, array.itemsize))].tobytes()
    return len(zlib.compress(start, 1)) <= WORTH_PACKING * len(start)


def _arrays(table: FacetTable) -> dict[str, np.ndarray]:
    arrays = {"format": np.array(FORMAT)}
    for f in fields(table):
        arrays[f.name] = np.asarray(getattr(table, f.name), order="C")
    return arrays


def load_table(path: Path) -> FacetTable:
    """Read a table. Inverse of :func:`save_table`. Raises ``InputError`` if the file is not one."""
    return load_with(path)[0]


def load_with(path: Path) -> tuple[FacetTable, dict[str, np.ndarray]]:
    """The table, and the arrays that the file has beside it. Raises ``InputError`` if it holds no table."""
    return _with(read_arrays(Path(path), _WHAT), path)


def packed_table(table: FacetTable) -> list[bytes]:
    """The table as pieces of one string of bytes, for whoever keeps many for a while: a line of what follows, then the
    arrays as they lie in memory. A fifth of the time that ``.npz`` takes."""
    # doubles first: so all lie as their kind must
    arrays = sorted(
        _arrays(table).items(), key=lambda item: (item[1].dtype.kind != "f", -item[1].dtype.alignment)
    )
    told = json.dumps([[name, one.dtype.str, one.shape] for name, one in arrays]).encode()
    return [told + b" " * (-(len(told) + 1) % 16) + b"\n", *(one.tobytes() for _, one in arrays)]


def unpacked_table(content: bytes, where: object) -> FacetTable:
    """Inverse of :func:`packed_table`. Raises ``InputError`` naming ``where`` if it is none."""
    arrays, start = dict[str, np.ndarray](), content.find(b"\n") + 1
    whole = bytearray(content)  # arrays of it can be written to, as of any table
    try:
        for name, kind, shape in json.loads(content[:start]):
            dtype, count = np.dtype(kind), math.prod(shape)
            if dtype.kind not in KINDS or min(shape, default=0) < 0:
                raise ValueError(f"an array of {shape} {dtype}")
            arrays[name] = np.frombuffer(whole, dtype, count, start).reshape(shape)
            start += count * dtype.itemsize
        if start != len(content):
            raise ValueError(f"{len(content)} bytes, not {start}")
    except DAMAGED as error:
        raise InputError(
            where, f"cannot be read as {_WHAT} ({str(error) or type(error).__name__})"
        ) from error
    return _with(arrays, where)[0]


def _with(arrays: dict[str, np.ndarray], path: object) -> tuple[FacetTable, dict[str, np.ndarray]]:
    arrays = {"finer": np.array(0)} | arrays  # older files have one level of facets
    names = [f.name for f in fields(FacetTable)]
    missing = [name for name in ("format", *names) if name not in arrays]
    if missing:
        raise InputError(path, f"is not {_WHAT}: lacks {missing[0]}")
    if _whole(path, arrays, "format") != FORMAT:
        raise InputError(path, f"is not {_WHAT} of format {FORMAT}")
    table = _table(path, arrays)
    return table, {name: array for name, array in arrays.items() if name not in ("format", *names)}


def _table(path: object, arrays: Mapping[str, np.ndarray]) -> FacetTable:
    level, isotropic = _whole(path, arrays, "level"), bool(_whole(path, arrays, "isotropic"))
    channels, groups = _names(path, arrays, "channels"), _names(path, arrays, "groups")
    finer = _whole(path, arrays, "finer")
    if finer and not (level >= 0 and 0 < finer <= FINEST - level):
        raise InputError(f"{path}: finer", f"{finer} levels beyond facets of level {level} are not possible")
    if not -1 <= level <= FINEST or not 1 <= len(channels) <= MOST_CHANNELS:
        raise InputError(path, f"has facets of level {level} and {len(channels)} channels")
    n = arrays["group"].shape[0] if arrays["group"].ndim else 0
    facets = facet_count(level + finer) if level >= 0 else max(n, 1)
    numbers = {"group": len(groups), "facet_i": facets, "facet_r": facets}
    indices = {name: _indices(path, arrays, name, n, below) for name, below in numbers.items()}
    sums = {name: _sums(path, arrays, name, n, _WIDTHS.get(name, len(channels))) for name in SUMS}
    _check_directions(path, sums)
    left_out = _left_out(path, arrays["left_out"], len(groups))
    return FacetTable(level, channels, groups, isotropic, **indices, **sums, left_out=left_out, finer=finer)


def _whole(path: object, arrays: Mapping[str, np.ndarray], name: str) -> int:
    array = arrays[name]
    if array.ndim or array.dtype.kind not in "biu":
        raise InputError(
            f"{path}: {name}", f"expected one whole number, found {array.dtype} of {array.shape}"
        )
    return int(array)


def _names(path: object, arrays: Mapping[str, np.ndarray], name: str) -> tuple[str, ...]:
    array = arrays[name]
    names = tuple(map(str, array.tolist())) if array.ndim == 1 and array.dtype.kind == "U" else ()
    if not names or len(set(names)) < len(names):
        raise InputError(f"{path}: {name}", "expected a row of different names")
    return names


def _indices(path: object, arrays: Mapping[str, np.ndarray], name: str, n: int, below: int) -> np.ndarray:
    array = arrays[name]
    if array.shape != (n,) or array.dtype.kind not in "iu":
        raise InputError(
            f"{path}: {name}", f"expected {n} whole numbers, found {array.dtype} of {array.shape}"
        )
    if n and not (array.min() >= 0 and array.max() < below):
        raise InputError(f"{path}: {name}", f"expected whole numbers from 0 to {below - 1}")
    return array.astype(np.int32, copy=False)


def _sums(path: object, arrays: Mapping[str, np.ndarray], name: str, n: int, width: int) -> np.ndarray:
    array, shape = arrays[name], (n, width) if width else (n,)
    if array.shape != shape or array.dtype.kind != "f":
        raise InputError(
            f"{path}: {name}", f"expected numbers of {shape}, found {array.dtype} of {array.shape}"
        )
    if not (np.abs(array) <= LARGEST).all():
        raise InputError(f"{path}: {name}", f"expected finite numbers of at most {LARGEST:g}")
    if name in ("count", "weight", "variance", "value2") and (array < 0.0).any():
        raise InputError(f"{path}: {name}", "expected no number below 0")
    return array.astype(np.float64, copy=False)


def _check_directions(path: object, sums: Mapping[str, np.ndarray]) -> None:
    """Sums of unit vectors above the surface, by the weights that are summed too."""
    weight = sums["weight"]
    for name in ("incident", "exit"):
        length = np.linalg.norm(sums[name], axis=1)
        if not (length <= UNIT * weight).all() or (length[weight > 0.0] <= 0.0).any():
            raise InputError(f"{path}: {name}", "expected means of unit vectors")
        if (sums[name][:, 2] < -1e-6 * weight).any():
            raise InputError(f"{path}: {name}", "has directions below the surface")


def _left_out(path: object, array: np.ndarray, groups: int) -> np.ndarray:
    """Counts (g, reasons), with those of reasons that later versions count."""
    fits = array.ndim == 2 and array.shape[0] in (0, groups) and array.shape[1] <= len(LEFT_OUT)
    if not fits or array.dtype.kind not in "iu" or (array.size and array.min() < 0):
        raise InputError(f"{path}: left_out", f"expected counts of {groups} photos, found {array.shape}")
    return np.pad(array, ((0, 0), (0, len(LEFT_OUT) - array.shape[1])))
