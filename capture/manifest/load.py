"""Reads and checks ``photoset.toml`` (docs/photoset.md)."""

from __future__ import annotations

import os
from pathlib import Path, PureWindowsPath
from typing import Any

from photogonio.capture.errors import InputError
from photogonio.capture.files.documents import read_toml
from photogonio.capture.manifest.entries import MANIFEST_KEYS
from photogonio.capture.manifest.schema import read_table
from photogonio.capture.photoset import (
    MANIFEST,
    CameraEntry,
    CharucoBoard,
    GridBoard,
    LightEntry,
    Photo,
    PhotoSet,
    Radiometry,
)

LONGEST = 200  # characters of a name that a line says whole


def load_photoset(folder: str | Path, *, unnamed: bool = False) -> PhotoSet:
    """The validated photo set of a folder (or of its ``photoset.toml``); ``unnamed``: it may name no photos yet.

    Raises InputError, one line with file and key, for anything docs/photoset.md does not allow.
    No image is opened.
    """
    folder = Path(folder)
    if folder.name == MANIFEST and folder.is_file():
        folder = folder.parent
    path = folder / MANIFEST
    values = read_table(parse(folder, path), MANIFEST_KEYS, f"{path}:")
    sample, symmetry = values["sample"]
    photoset = PhotoSet(
        folder=folder,
        name=values.get("name", folder.resolve().name),
        length_unit=values.get("length_unit", "mm"),
        sample=sample,
        symmetry=symmetry,
        photos=values.get("photo", ()),
        board=values.get("board"),
        mirror_balls=values.get("mirror_ball", ()),
        white_patches=values.get("white_patch", ()),
        grey_patches=values.get("grey_patch", ()),
        radiometry=values.get("radiometry", Radiometry()),
        camera=values.get("camera", CameraEntry()),
        lights=values.get("light", ()),
    )
    check_lights(path, photoset.lights)
    if unnamed and not photoset.photos:
        return photoset
    check_photos(folder, path, photoset.photos)
    check_whole(path, photoset)
    return photoset


def parse(folder: Path, path: Path) -> dict[str, Any]:
    """The file's TOML, with a way out for a folder that has none."""
    if not folder.is_dir():
        raise InputError(folder, "no such folder")
    if not path.is_file():
        raise InputError(
            folder,
            f"no {MANIFEST} here; make one with `photogonio init {folder}` (from the photos' EXIF) or with "
            "`photogonio target` (beside a printable board)",
        )
    return read_toml(path)


def check_photos(folder: Path, path: Path, photos: tuple[Photo, ...]) -> None:
    """Every photo is a file inside the folder, named once a role; brackets are of one light."""
    if not photos:
        raise InputError(path, f"no [[photo]]: name the photos, or run `photogonio init {folder}`")
    root = folder.resolve()
    seen: set[tuple[str, str]] = set()
    lights: dict[tuple[str, int], str | None] = {}
    for k, photo in enumerate(photos):
        where = f"{path}: photo[{k}]"
        check_file(root, photo.file, f"{where} file")
        if (photo.file, photo.role) in seen:
            raise InputError(f"{where} file", f'"{photo.file}" is named twice with role "{photo.role}"')
        seen.add((photo.file, photo.role))
        if photo.bracket is not None:
            light = lights.setdefault((photo.role, photo.bracket), photo.light)
            if light != photo.light:
                what = (
                    f"photos of bracket {photo.bracket} have different lights, {light!r} and {photo.light!r}"
                )
                raise InputError(f"{where} bracket", what)


def check_file(root: Path, name: str, where: str) -> None:
    """A relative path with forward slashes to a file that is really inside ``root``."""
    if PureWindowsPath(name).is_absolute() or PureWindowsPath(name).drive or name.startswith("/"):
        raise InputError(where, f'expected a path relative to the folder, found "{name}"')
    if "\0" in name:
        raise InputError(where, f"no file is called {name!r:.60}")
    path = root / name
    try:
        inside = path.resolve().is_relative_to(root)
    except RuntimeError:  # Python before 3.13
        raise InputError(where, f'"{name}" is a link that leads to itself') from None
    if not inside:
        raise InputError(where, f'"{name}" leaves the folder')
    if not os.path.isfile(path):  # also of a name too long for any file, at which pathlib raises
        hint = "; paths have forward slashes" if "\\" in name else ""
        shown = name if len(name) <= LONGEST else f"{name[:60]}..."
        raise InputError(where, f'no such file: "{shown}"{hint}')


def check_lights(path: Path, lights: tuple[LightEntry, ...]) -> None:
    names: set[str] = set()
    for k, light in enumerate(lights):
        if light.id in names:
            raise InputError(f"{path}: light[{k}] id", f'"{light.id}" is used twice')
        names.add(light.id)


def check_whole(path: Path, photoset: PhotoSet) -> None:
    """What one part of the manifest asks of another."""
    if photoset.radiometry.vignetting == "flat" and not photoset.views("flat"):
        raise InputError(f"{path}: [radiometry] vignetting", '"flat" needs photos with role "flat"')
    unknown = photoset.radiometry.encoding == "unknown"
    printed = isinstance(photoset.board, CharucoBoard | GridBoard)
    if unknown and not printed and all(photo.bracket is None for photo in photoset.photos):
        what = '"unknown" needs photos with bracket numbers, or a printed [board] whose black and white tell the curve'
        raise InputError(f"{path}: [radiometry] encoding", what)
    if photoset.radiometry.paper is not None and photoset.board is None:
        raise InputError(
            f"{path}: [radiometry] paper", "says what the [board] is printed on, and there is none"
        )
    if photoset.board is None and (photoset.camera.matrix is None or photoset.camera.rotation is None):
        raise InputError(path, "without [board], [camera] needs matrix, rotation and translation")
