"""Arrays from files that may be damaged, or not what their names say: sizes are looked at before anything is unpacked.

``numpy.load`` makes room for whatever shape a header claims, and unpacks whatever a zip entry holds.
"""

from __future__ import annotations

import io
import lzma
import math
import struct
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import IO, BinaryIO

import numpy as np

from photogonio.capture.errors import InputError

UNPACKED = 1 << 28  # bytes that any archive may unpack to
PACKED = 50  # larger ones: times the file's own size; sums of floats pack to a third, zeros to a thousandth
KINDS = "biufU"  # of numpy's types: numbers and text
DAMAGED = (
    OSError,
    EOFError,
    ValueError,  # UnicodeDecodeError and numpy's own among them
    TypeError,
    KeyError,
    IndexError,
    OverflowError,
    SyntaxError,
    RecursionError,
    MemoryError,
    NotImplementedError,  # a way of packing that zipfile does not know
    RuntimeError,  # encrypted
    struct.error,
    zlib.error,
    lzma.LZMAError,
    zipfile.BadZipFile,
    tokenize.TokenError,  # from the header of an array
)


def read_arrays(path: Path, what: str) -> dict[str, np.ndarray]:
    """The arrays of an ``.npz`` file by name.

    Raises:
        InputError: the file cannot be read as ``what`` it should be.
    """
    if not path.exists():
        raise InputError(path, "no such file")
    if not path.is_file():
        raise InputError(path, "is no file")
    try:
        with path.open("rb") as file:
            return arrays_in(file, path.stat().st_size, path, what)
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}") from error


def arrays_in(file: BinaryIO, size: int, path: object, what: str) -> dict[str, np.ndarray]:
    """The arrays of an ``.npz`` file of ``size`` bytes, which errors call ``path``. Raises as :func:`read_arrays`."""
    try:
        with zipfile.ZipFile(file) as archive:
            entries = archive.infolist()
            total = sum(entry.file_size for entry in entries)
            if total > max(UNPACKED, PACKED * size):
                raise InputError(path, f"would unpack to {total / 1e9:.1f} GB, which {what} does not")
            arrays = {}
            for entry in entries:
                with archive.open(entry) as part:
                    arrays[entry.filename.removesuffix(".npy")] = _array(part, entry.file_size)
            return arrays
    except InputError:
        raise
    except DAMAGED as error:
        raise InputError(path, f"cannot be read as {what} ({str(error) or type(error).__name__})") from error


def array_of(content: bytes) -> np.ndarray:
    """The array of an ``.npy`` file's bytes. Raises ValueError if they are none, whatever is wrong with them."""
    try:
        return _array(io.BytesIO(content), len(content))
    except DAMAGED as error:
        raise ValueError(f"no array ({error})") from error


def _array(file: IO[bytes], size: int) -> np.ndarray:
    """The array of an ``.npy`` file of ``size`` bytes."""
    major, _ = np.lib.format.read_magic(file)
    read_header = np.lib.format.read_array_header_1_0 if major == 1 else np.lib.format.read_array_header_2_0
    shape, fortran, dtype = read_header(file)
    count = math.prod(shape)
    if dtype.kind not in KINDS or min(shape, default=0) < 0 or count * dtype.itemsize != size - file.tell():
        raise ValueError(f"an array of {shape} {dtype} in {size} bytes")
    content = bytearray(file.read())
    if len(content) != count * dtype.itemsize:
        raise ValueError("ends early")
    array = np.frombuffer(content, dtype) if count and dtype.itemsize else np.zeros(count, dtype)
    array = array.reshape(shape, order="F" if fortran else "C")
    return np.ascontiguousarray(array.astype(dtype.newbyteorder("="), copy=False)).reshape(shape)
