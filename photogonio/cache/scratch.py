"""What memory shall not hold of many photos, set aside on disk: decoded photos, uncompressed, for the passes that read
a photo again, and what was read of each.

Calibration looks at a photo several times, each time with more known. Decoding costs most of a look; what was decoded
is mapped into memory again, of which only the parts that are looked at cost anything, as long as the system's own file
cache holds them. So much is kept as fits in half of the memory that is free, which the system may take back at any
time; photos beyond that are decoded anew. The file has no name: it is gone when the process is, however that ends.
"""

from __future__ import annotations

import mmap
import os
import pickle
import shutil
import tempfile
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO, TypeVar

import numpy as np

from photogonio.capture.files.images import Image, read_image

Value = TypeVar("Value")

SHARE = 0.5  # of free memory and of free disk
# bytes written at a time: for larger ones Linux takes huge pages, which a virtual machine may have to be given first;
# a photo of 72 MB then took up to 0.16 s, and 0.03 s in pieces
PIECE = 1 << 17


class Scratch:
    """Decodes photos, and remembers. A context manager; any number of threads may use it at once."""

    def __init__(
        self, most_bytes: int | None = None, decoded: Callable[[Path, Image], None] = lambda path, image: None
    ):
        """``most_bytes`` are kept; by default what memory and disk allow. ``decoded`` is shown each photo
        that is decoded."""
        self._most = free_bytes() if most_bytes is None else most_bytes
        self._decoded = decoded
        self._file: BinaryIO | None = None
        self._end = 0
        self._kept: dict[tuple[Path, str], _Kept] = {}
        self._lock = threading.Lock()
        self._last = threading.local()  # each thread's latest photo, of which it may read several parts

    def __enter__(self) -> Scratch:
        if self._most and hasattr(os, "pwrite") and hasattr(mmap, "MAP_PRIVATE"):
            self._file = tempfile.TemporaryFile(prefix="photogonio-")
        return self

    def __exit__(self, *_: object) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None

    def take(self, path: Path, *, demosaic: str = "superpixel") -> Image:
        """The photo, read back if it was kept. Raises InputError as :func:`capture.files.images.read_image` does."""
        return self._latest(path, demosaic, keep=False)

    def keep(self, path: Path, *, demosaic: str = "superpixel") -> Image:
        """The photo, which is kept if there is room: for those that are read again."""
        return self._latest(path, demosaic, keep=True)

    def let_go(self) -> None:
        """Forget each thread's latest photo: what comes next begins with others."""
        self._last = threading.local()

    def put(self, value: Value) -> Callable[[], Value]:
        """Set ``value`` aside, however little room there is for photos, and return what reads it back, a copy each
        time. It stays in memory where it cannot be written."""
        packed = pickle.dumps(value, pickle.HIGHEST_PROTOCOL)
        place = self._room(len(packed), unless_full=False)
        if place is None or self._file is None:
            return lambda: value
        try:
            _write(self._file.fileno(), packed, place)
        except OSError:  # the disk is full
            return lambda: value
        size = len(packed)
        del packed

        def recall() -> Value:
            if self._file is None:
                raise ValueError("what was set aside is gone")
            return pickle.loads(os.pread(self._file.fileno(), size, place))

        return recall

    def _latest(self, path: Path, demosaic: str, *, keep: bool) -> Image:
        asked, last = (path, demosaic), self._last  # which let_go may replace meanwhile
        if getattr(last, "asked", None) != asked:
            last.asked = last.image = None  # memory for one photo, not two
            last.image = self._found(path, demosaic, keep)
            last.asked = asked
        return last.image

    def _found(self, path: Path, demosaic: str, keep: bool) -> Image:
        kept = self._kept.get((path, demosaic))
        if kept is not None and self._file is not None:
            return kept.read(self._file.fileno())
        image = read_image(path, demosaic=demosaic)
        self._decoded(path, image)
        place = self._room(_size(image)) if keep else None
        if place is not None and self._file is not None:
            try:
                self._kept[path, demosaic] = _Kept.written(image, self._file.fileno(), place)
            except OSError:
                self._most = 0  # the disk is full
        return image

    def _room(self, size: int, *, unless_full: bool = True) -> int | None:
        """Where ``size`` bytes may be written; None if nowhere."""
        with self._lock:
            place = self._end
            if self._file is None or (unless_full and place + size > self._most):
                return None
            self._end += _paged(size)
            return place


@dataclass(frozen=True, slots=True)
class _Kept:
    """Where a photo's arrays are, and the photo without them."""

    bare: Image
    arrays: tuple[tuple[str, np.dtype, tuple[int, ...], int], ...]  # name, type, shape, place

    @classmethod
    def written(cls, image: Image, file: int, place: int) -> _Kept:
        arrays = []
        for name in ("pixels", "saturated"):
            array = getattr(image, name)
            if array is not None:
                array = np.ascontiguousarray(array)
                _write(file, array, place)
                arrays.append((name, array.dtype, array.shape, place))
                place += _paged(array.nbytes)
        nothing = np.empty((0, 0, 0), image.pixels.dtype)
        return cls(replace(image, pixels=nothing, saturated=None), tuple(arrays))

    def read(self, file: int) -> Image:
        found = {name: _mapped(file, kind, shape, at) for name, kind, shape, at in self.arrays}
        return replace(self.bare, pixels=found["pixels"], saturated=found.get("saturated"))


def _size(image: Image) -> int:
    """Bytes in the file."""
    return _paged(image.pixels.nbytes) + (0 if image.saturated is None else _paged(image.saturated.nbytes))


def _paged(size: int) -> int:
    """Bytes in whole pages: only at these can a file be mapped."""
    return -(-size // mmap.ALLOCATIONGRANULARITY) * mmap.ALLOCATIONGRANULARITY


def _write(file: int, content: np.ndarray | bytes, place: int) -> None:
    rest = (content.data if isinstance(content, np.ndarray) else memoryview(content)).cast("B")
    while rest:
        done = os.pwrite(file, rest[:PIECE], place)
        rest, place = rest[done:], place + done


def _mapped(file: int, kind: np.dtype, shape: tuple[int, ...], place: int) -> np.ndarray:
    """An array of the file in memory, which may be written to; the file is not."""
    count = int(np.prod(shape))
    memory = mmap.mmap(
        file, count * kind.itemsize, mmap.MAP_PRIVATE, mmap.PROT_READ | mmap.PROT_WRITE, offset=place
    )
    return np.frombuffer(memory, kind).reshape(shape)


def free_bytes() -> int:
    """What may be kept: a share of the memory that is free, and of the disk. 0 where the system does not tell."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
        memory = next(int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable"))
        disk = shutil.disk_usage(tempfile.gettempdir()).free
    except (OSError, StopIteration, ValueError, IndexError):
        return 0
    return int(SHARE * min(memory, disk))
