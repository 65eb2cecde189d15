"""Quick looks at photos, kept between runs: a photo that was checked before is not read again."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from photogonio.cache.kept import CORNERS, code_key, key_of
from photogonio.cache.store import Store
from photogonio.calib.geometry.board import Corners
from photogonio.calib.identify.layout import Markers
from photogonio.calib.identify.quick_look import QuickLook
from photogonio.calib.identify.sharpness import Sharpness
from photogonio.capture.files.arrays import arrays_in
from photogonio.capture.linear.encoding import Encoding
from photogonio.capture.photoset import Board
from photogonio.system.provenance import hash_file

SUFFIX = ".glance.npz"


class Glances:
    """What was seen at a glance; without a store nothing is kept."""

    def __init__(self, store: Store | None):
        self._store = store

    def key(self, path: Path, encoding: Encoding, demosaic: str, board: Board | None) -> str | None:
        """Of all that a look at a photo depends on; None where it is not to be kept."""
        if self._store is None:
            return None
        try:
            return key_of("glance", code_key(), hash_file(path), encoding, demosaic, board)
        except OSError:
            return None

    def get(self, key: str | None) -> QuickLook | None:
        """What was found; None if it is not at hand."""
        content = None if self._store is None or key is None else self._store.read(key, SUFFIX)
        if self._store is None or key is None or content is None:
            return None
        try:
            return _unpacked(arrays_in(io.BytesIO(content), len(content), key, "a look at a photo"))
        except (ValueError, KeyError, TypeError):
            self._store.discard(key, SUFFIX)
            return None

    def put(self, key: str | None, seen: QuickLook) -> None:
        """Keep what was found, if there is room for it."""
        if self._store is not None and key is not None:
            self._store.put_bytes(key, SUFFIX, lambda path: _write(path, seen))


def _write(path: Path, seen: QuickLook) -> None:
    sharp = seen.sharp
    parts = {
        "numbers": np.array([*seen.size, seen.step, seen.white, seen.clipped], float),
        "small": seen.small,
        "full": seen.full,
        "sharp": np.array([] if sharp is None else [sharp.width, sharp.across, sharp.down], float),
    }
    if seen.corners is not None:
        parts |= {"corners_" + name: np.asarray(getattr(seen.corners, name)) for name in CORNERS}
    if seen.markers is not None:
        parts |= {"ids": seen.markers.ids, "quads": seen.markers.quads}
        parts["family"] = np.array(seen.markers.family)
    with path.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **parts)


def _unpacked(parts: Mapping[str, np.ndarray]) -> QuickLook:
    width, height, step, white, clipped = parts["numbers"].tolist()
    corners = Corners(*(parts["corners_" + name] for name in CORNERS)) if "corners_ids" in parts else None
    markers = None
    if "family" in parts:
        markers = Markers(tuple(str(name) for name in parts["family"]), parts["ids"], parts["quads"])
    sharp = Sharpness(*parts["sharp"].tolist()) if len(parts["sharp"]) else None
    size = int(width), int(height)
    return QuickLook(
        size, white, clipped, parts["small"], parts["full"].astype(bool), int(step), markers, corners, sharp
    )
