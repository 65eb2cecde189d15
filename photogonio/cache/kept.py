"""A calibration kept under the contents of its files and of the program, and the keys of all that is kept."""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import cv2
import numpy as np

import photogonio
from photogonio import calib, capture, reconstruct
from photogonio.cache.file_hashes import remembered_hashes
from photogonio.cache.store import Store
from photogonio.calib.rig.gaussian import NOTHING, RigPrior
from photogonio.calib.setup import Setup
from photogonio.calib.setup_file import setup_document, setup_of
from photogonio.capture.photoset import MANIFEST, PhotoSet
from photogonio.system.provenance import hash_file

ROOMS = (capture, calib, reconstruct)
# decoders, and what numbers are worked out by; OpenCV goes by several names, and tells its version itself
LIBRARIES = (
    "numpy",
    "scipy",
    "numba",
    "llvmlite",
    "OpenImageIO",
    "rawpy",
    "deflate",
    "pillow",
    "pillow-heif",
    "colour-science",
)
DRAWING = ("matplotlib", "jinja2")  # what pages and pictures are made by, beside those
CORNERS = ("ids", "points", "pixels", "sigma", "marker_ids", "marker_pixels")  # of a board, as they are kept


@dataclass(frozen=True, slots=True)
class KeptSetup:
    """The calibration of a photo set, kept under the contents of its files and of the program."""

    store: Store | None
    key: str  # empty: of a set whose files cannot all be read
    hashes: dict[str, str]  # SHA-256 of the photos' files, by file; none without a store

    @classmethod
    def of(cls, photoset: PhotoSet, store: Store | None, workers: int, rig: RigPrior = NOTHING) -> KeptSetup:
        """Of a set by itself, or with what is expected of its rig."""
        if store is None:
            return cls(None, "", {})
        files = sorted({photo.file for photo in photoset.photos})
        try:
            folder = photoset.folder.resolve()
            manifest = hash_file(folder / MANIFEST)
            found = remembered_hashes(
                store, key_of("hashes", str(folder)), [folder / name for name in files], workers=workers
            )
        except OSError:
            return cls(store, "", {})  # whoever reads the file will say what is wrong with it
        hashes = {name: found[folder / name] for name in files}
        known = (rig,) if rig.expected else ()
        key = key_of("setup", code_key(), manifest, hashes, *known)
        return cls(store, key, hashes)

    def load(self) -> Setup | None:
        """The setup that was kept; None if there is none."""
        if self.store is None or not self.key:
            return None
        content = self.store.read(self.key, ".json")
        try:
            return None if content is None else setup_of(json.loads(content), self.key)
        except ValueError:  # InputError is one
            self.store.discard(self.key, ".json")
            return None

    def save(self, setup: Setup) -> Setup:
        """Keep a setup; returned as it will be loaded, so that later runs go on from the same numbers."""
        if self.store is None or not self.key:
            return setup
        text = json.dumps(setup_document(setup), allow_nan=False)
        self.store.put_bytes(self.key, ".json", lambda path: path.write_text(text, encoding="utf-8"))
        return self.load() or setup


def key_of(*parts: object) -> str:
    """A hash of plain values, arrays, and tuples, mappings and dataclasses of them: equal for equal contents.

    Raises ``TypeError`` for anything else, rather than to leave it out.
    """
    digest = hashlib.blake2b(digest_size=20)
    _feed(digest, parts)
    return digest.hexdigest()


def _feed(digest: hashlib.blake2b, value: object) -> None:
    if isinstance(value, np.ndarray):
        digest.update(f"array {value.dtype.str} {value.shape};".encode())
        digest.update(np.ascontiguousarray(value).data)
    elif is_dataclass(value) and not isinstance(value, type):
        digest.update(f"{type(value).__name__} ".encode())
        for f in fields(value):
            digest.update(f.name.encode() + b"=")
            _feed(digest, getattr(value, f.name))
    elif isinstance(value, Mapping):
        _feed(digest, sorted(value.items(), key=lambda item: repr(item[0])))
    elif isinstance(value, frozenset):
        _feed(digest, sorted(value))
    elif isinstance(value, (tuple, list)):
        digest.update(f"({len(value)} ".encode())
        for item in value:
            _feed(digest, item)
    elif value is None or isinstance(value, (str, bool, int, float, np.generic)):
        digest.update(f"{type(value).__name__} {value!r};".encode())
    else:
        raise TypeError(f"{type(value).__name__} has no key")


@lru_cache(maxsize=1)
def code_key() -> str:
    """A hash of all program text that photos go through, and of the versions of the libraries that numbers come from.

    The same for a checkout, where rooms stand beside the front door, and what is installed, where they stand in it.
    """
    versions = {name: _version(name) for name in LIBRARIES}
    digest = hashlib.blake2b(f"{cv2.__version__} {sys.version_info[:2]} {versions}".encode())
    for folder, leaving_out in _rooms():
        digest.update(text_key(folder, leaving_out).encode())
    return digest.hexdigest()


@lru_cache(maxsize=1)
def written_key() -> str:
    """:func:`code_key`, and a hash of what else shapes the files that are written: templates, and what draws.

    Numbers do not hang on those, so that photos that were reduced need not be so again for a page that is laid out
    anew.
    """
    versions = {name: _version(name) for name in DRAWING}
    digest = hashlib.blake2b(f"{code_key()} {versions}".encode())
    for folder, leaving_out in _rooms():
        paths = {path for path in folder.rglob("*") if _is_data(path.relative_to(folder))} - set(leaving_out)
        digest.update(_files_key(folder, (path for path in paths if path.is_file())).encode())
    return digest.hexdigest()


def _rooms() -> Iterator[tuple[Path, list[Path]]]:
    """The folders whose files bear on results, and the files in each that do not, or are another's."""
    front = Path(str(photogonio.__file__)).parent
    rooms = {room.__name__.rpartition(".")[2]: Path(str(room.__file__)).parent for room in ROOMS}
    yield front, [path for name in (*rooms, "synthetic") for path in (front / name).rglob("*")]
    for folder in rooms.values():
        yield folder, []


def _is_data(path: Path) -> bool:
    """Neither program text, nor made of it, nor for type checkers, nor an editor's or the system's own."""
    hidden = any(part.startswith((".", "__pycache__")) for part in path.parts)
    return not hidden and path.suffix not in (".py", ".pyc", ".pyi", ".typed") and not path.name.endswith("~")


def _version(library: str) -> str:
    try:
        return version(library)
    except PackageNotFoundError:  # built by hand
        return "unknown"


def text_key(package: Path, leaving_out: Collection[Path] = ()) -> str:
    """A hash of all program text in a package's folder and the folders in it, by path and content."""
    return _files_key(package, set(package.rglob("*.py")) - set(leaving_out))


def _files_key(folder: Path, paths: Iterable[Path]) -> str:
    digest = hashlib.blake2b()
    for path in sorted(paths):
        text = path.read_bytes()
        digest.update(f"{path.relative_to(folder).as_posix()} {len(text)};".encode() + text)
    return digest.hexdigest()
