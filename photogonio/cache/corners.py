"""First looks at photos, kept between runs: the board's corners in each, and the pixels about them.

A set that was stopped while it was calibrated, or that gets one more photo, is calibrated anew as a whole; but what
each photo shows by itself is then at hand, and photos of the bare board need not be read again.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from photogonio.cache.kept import CORNERS, code_key, key_of
from photogonio.cache.store import Store
from photogonio.calib.detect.photo_reader import Seen
from photogonio.calib.detect.subpixel import Around
from photogonio.calib.geometry.board import Corners
from photogonio.capture.files.arrays import arrays_in
from photogonio.capture.linear.reader import RadianceReader
from photogonio.capture.photoset import View

SUFFIX = ".look.npz"
AROUND = ("size", "first", "level")


class KeptLooks:
    """What was found in views of one set; several threads may use it. Of files without a hash nothing is kept."""

    def __init__(self, store: Store, reader: RadianceReader, hashes: Mapping[str, str]):
        self._store, self._reader, self._hashes = store, reader, hashes
        sensor, frames = reader.sensor, (reader.dark, reader.gain, reader.ambient)
        levels = (reader.channels, reader.size, sensor.encoding, sensor.clip, sensor.own_levels)
        photoset = reader.photoset
        self._shared = key_of(
            "look", code_key(), levels, reader.fields, photoset.radiometry, frames, photoset.board
        )

    def get(self, view: View, *, around: bool) -> Seen | None:
        """What was found in a view, with pixels about the corners or without; None if it is not at hand."""
        key = self._key(view, around=around)
        if key is None:
            return None
        content = self._store.read(key, SUFFIX)
        if content is None:
            return None
        try:
            return _unpacked(view, arrays_in(io.BytesIO(content), len(content), key, "a look at a photo"))
        except (ValueError, KeyError, TypeError):  # InputError is a ValueError
            self._store.discard(key, SUFFIX)
            return None

    def put(self, seen: Seen, *, around: bool) -> None:
        """Keep what was found, if there is room for it."""
        key = self._key(seen.view, around=around)
        if key is not None:
            self._store.put_bytes(key, SUFFIX, lambda path: _write(path, seen))

    def _key(self, view: View, *, around: bool) -> str | None:
        files = [photo.file for photo in view.photos]
        if not all(file in self._hashes for file in files):
            return None
        hashes = [self._hashes[file] for file in files]
        exposures = [self._reader.exposures.get(file) for file in files]
        noise = self._reader.sensor.noise if len(files) > 1 else None  # exposures are joined by it
        roles = [(photo.role, photo.turned) for photo in view.photos]
        return key_of(self._shared, hashes, exposures, noise, roles, view.light, around)


def _write(path: Path, seen: Seen) -> None:
    parts = {"seen_size": np.array(seen.size)}
    for prefix, names, one in (("corners_", CORNERS, seen.corners), ("around_", AROUND, seen.around)):
        if one is not None:
            parts |= {prefix + name: np.asarray(getattr(one, name)) for name in names}
    with path.open("wb") as file:
        np.savez(file, allow_pickle=False, **parts)


def _unpacked(view: View, parts: Mapping[str, np.ndarray]) -> Seen:
    corners, around = None, None
    if "corners_ids" in parts:
        corners = Corners(*(parts["corners_" + name] for name in CORNERS))
    if "around_first" in parts:
        width, height = parts["around_size"].tolist()
        around = Around((width, height), parts["around_first"], parts["around_level"])
    width, height = parts["seen_size"].tolist()
    return Seen(view, corners, (width, height), around)
