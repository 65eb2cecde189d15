"""Small prints of photos, made while these are in memory for something else: no photo is decoded for its print."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np

from photogonio.cache.kept import KeptSetup, code_key, key_of
from photogonio.calib.report.overlay import REJECTED
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import Image
from photogonio.capture.linear.reader import RadianceReader
from photogonio.capture.photoset import Photo, PhotoSet

WIDTH = 320  # pixels of a print
MOST = 200  # prints, 0.2 MB each in memory: a page has no room for more
_FINER = 3  # pixels a side, of a pixel of the print, that it is the mean of
_BRIGHT = 99.0  # percentile that is white


class SmallPrints:
    """Takes each photo as it is decoded. Any number of threads may use it at once."""

    def __init__(self, photoset: PhotoSet):
        views = [view for role in ("sample", "calibration") for view in photoset.views(role)][:MOST]
        self._asked = {
            view.name: view.photos[len(view.photos) // 2].file for view in views
        }  # of brackets one
        self._folder = photoset.folder
        self._paths = {self._folder / file for file in self._asked.values()}
        self._made: dict[Path, np.ndarray] = {}
        self._recalled: set[Path] = set()  # of those, that an earlier run made and kept
        self._lock = threading.Lock()

    def recall(self, kept: KeptSetup) -> None:
        """Take what an earlier run kept: photos that are decoded from now on are not printed again."""
        if kept.store is None:
            return
        for file in self._asked.values():
            told = kept.hashes.get(file)
            picture = kept.store.get_array(_key(told)) if told else None
            if picture is not None:
                path = self._folder / file
                with self._lock:
                    self._made[path] = picture
                    self._recalled.add(path)

    def add(self, path: Path, image: Image) -> None:
        """The print of a photo that was decoded, unless there is one."""
        with self._lock:
            if path in self._made or path not in self._paths:
                return
        small = small_print(image)
        with self._lock:
            self._made[path] = small

    def of(self, radiance: RadianceReader, kept: KeptSetup, threads: int) -> dict[str, np.ndarray]:
        """(h, w, 3) uint8 of sample and calibration photos, by name; ``radiance`` decodes those that were neither
        decoded in this run nor recalled."""
        photos = {photo.file: photo for photo in radiance.photoset.photos}
        some = {name: photos[file] for name, file in self._asked.items()}
        with ThreadPoolExecutor(max(1, threads)) as pool:
            found = dict(
                zip(some, pool.map(lambda p: self._of(p, radiance, kept), some.values()), strict=True)
            )
        return {name: small for name, small in found.items() if small is not None}

    def _of(self, photo: Photo, radiance: RadianceReader, kept: KeptSetup) -> np.ndarray | None:
        store, told, path = kept.store, kept.hashes.get(photo.file), self._folder / photo.file
        picture = self._made.get(path)
        if picture is None:
            picture = self._decoded(photo, radiance)
        if picture is None:
            return None
        if store is not None and told and path not in self._recalled:
            store.put_array(_key(told), picture)
        return picture[::-1, ::-1] if photo.turned else picture

    def _decoded(self, photo: Photo, radiance: RadianceReader) -> np.ndarray | None:
        path = self._folder / photo.file
        try:
            self.add(path, radiance.decode(path, demosaic=radiance.photoset.radiometry.demosaic))
        except InputError:
            return None
        return self._made.get(path)


def _key(told: str) -> str:
    """What the print of a file with the hash ``told`` is kept under."""
    return key_of("print", code_key(), told)


def small_print(image: Image) -> np.ndarray:
    """(h, w, 3) uint8, WIDTH across: 8 bits as they are, for they are made for the eye, others in square-root tones;
    what is clipped is tinted."""
    height, width = image.pixels.shape[:2]
    step = max(1, width // (_FINER * WIDTH))
    pixels = np.ascontiguousarray(image.pixels[::step, ::step])
    eye = pixels.dtype == np.uint8
    if pixels.dtype.kind == "u" and pixels.shape[2] == 3:
        tone, full = _of_codes(pixels, image.full_scale, eye)
    else:
        tone, full = _of_values(pixels.astype(np.float32) / np.float32(image.full_scale), eye)
    if image.saturated is not None:
        full = image.saturated[::step, ::step]
    tone[full] = 0.5 * tone[full] + 0.5 * np.array(REJECTED, np.float32) / 255
    size = WIDTH, max(1, round(WIDTH * height / width))
    return (cv2.resize(tone, size, interpolation=cv2.INTER_AREA) * 255).round().astype(np.uint8)


def _of_values(pixels: np.ndarray, eye: bool) -> tuple[np.ndarray, np.ndarray]:
    """Tones (h, w, 3) of pixels (h, w, c) whose full scale is 1, and which are clipped (h, w)."""
    value = np.nan_to_num(pixels, posinf=1.0, neginf=0.0)
    color = value if value.shape[2] == 3 else np.repeat(value.mean(2, keepdims=True), 3, axis=2)
    return _toned(color, float(np.percentile(color, _BRIGHT)), eye), value.max(2) >= 1.0


def _of_codes(codes: np.ndarray, full_scale: float, eye: bool) -> tuple[np.ndarray, np.ndarray]:
    """The same of integer codes (h, w, 3), each of which is worked out once."""
    counts = np.bincount(codes.ravel())
    values = np.arange(len(counts), dtype=np.float32) / np.float32(full_scale)
    place = (codes.size - 1) * _BRIGHT / 100
    low, high = values[np.searchsorted(np.cumsum(counts), np.floor([place, place + 1]), side="right")]
    bright = float(low + (high - low) * np.float32(place % 1))
    most = np.maximum(np.maximum(codes[..., 0], codes[..., 1]), codes[..., 2])
    return _toned(values, bright, eye)[codes], most >= np.searchsorted(values, np.float32(1.0))


def _toned(value: np.ndarray, bright: float, eye: bool) -> np.ndarray:
    tone = np.clip(value / (bright or 1.0), 0.0, 1.0)
    return tone if eye else np.sqrt(tone)
