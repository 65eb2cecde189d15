"""The photos of a folder as entries of a manifest: roles from folder names, exposures from EXIF."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path

from photogonio.capture.errors import InputError
from photogonio.capture.files.images import JPEG, STANDARD, read_header
from photogonio.capture.manifest.stub import photo_tables, stub_manifest
from photogonio.capture.photoset import MANIFEST, Photo
from photogonio.capture.target.layout import make_target

RAW = {  # of the many that LibRaw opens, those that cameras write
    ".3fr", ".arw", ".cr2", ".cr3", ".crw", ".dng", ".erf", ".fff", ".iiq", ".kdc", ".mef", ".mos", ".mrw",
    ".nef", ".nrw", ".orf", ".pef", ".raf", ".rw2", ".rwl", ".sr2", ".srf", ".srw", ".x3f",
}  # fmt: skip
ROLES = {  # beginnings of folder or file names
    "calib": "calibration",
    "board": "calibration",
    "sample": "sample",
    "probe": "probe",
    "chrome": "probe",
    "dark": "dark",
    "flat": "flat",
    "ambient": "ambient",
    "chart": "chart",
}
BY_LIGHT = {"sample", "probe", "ambient"}


def manifest_text(folder: Path) -> str:
    """The whole photoset.toml for a folder's photos: its own, if it names no photo yet, with the photos
    added; else that of the A4 target, with a word on what to check.

    Raises InputError if there are no photos, if one cannot be read, or if the file names photos already.
    """
    photos = list_photos(folder)
    path = folder / MANIFEST
    if path.exists():
        text = path.read_text(encoding="utf-8")
        try:
            named = "photo" in tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise InputError(path, f"not valid TOML: {error}") from error
        if named:
            raise InputError(path, "names photos already; move it away to begin anew")
        return text.rstrip() + "\n\n" + photo_tables(photos)
    encoding = "srgb" if Path(photos[0].file).suffix.lower() in JPEG else "linear"
    stub = stub_manifest(make_target(), name=folder.resolve().name.replace('"', ""), encoding=encoding)
    check = "# CHECK: the board, sample, balls and patch are those of the A4 sheet of `photogonio target`.\n"
    return check + stub + "\n" + photo_tables(photos)


def list_photos(folder: Path) -> list[Photo]:
    """All photos below a folder, in order of their paths, with role, light or bracket, and exposure.

    A folder inside a role's folder is a bracket if no two of its photos have the same exposure time, else a
    light: ``sample/L01/a.jpg``. Of a RAW file and a JPEG of one name the RAW is taken.
    """
    if not folder.is_dir():
        raise InputError(folder, "no such folder")
    known = STANDARD | RAW
    files = sorted(path for path in folder.rglob("*") if path.is_file() and path.suffix.lower() in known)
    raw = {path.with_suffix("") for path in files if path.suffix.lower() in RAW}
    files = [path for path in files if path.suffix.lower() not in JPEG or path.with_suffix("") not in raw]
    if not files:
        raise InputError(folder, "no photo here (PNG, TIFF, JPEG, OpenEXR or camera RAW)")
    photos = [photo_of(folder, path) for path in files]
    result: list[Photo] = []
    brackets = 0
    for inner, group in groupby(photos, key=lambda photo: inner_folder(photo)):
        members = list(group)
        if inner is not None and is_bracket(members):
            brackets += 1
            members = [replace(photo, bracket=brackets) for photo in members]
        elif inner is not None and members[0].role in BY_LIGHT:
            members = [replace(photo, light=inner[1]) for photo in members]
        result += members
    return result


def photo_of(folder: Path, path: Path) -> Photo:
    name = path.relative_to(folder).as_posix()
    exposure = read_header(path).exposure
    return Photo(name, role_of(name), None, exposure.exposure_time, exposure.f_number, exposure.iso)


def role_of(name: str) -> str:
    """By the first folder or file name along the path that begins with a role's; "sample" without one."""
    for part in name.lower().split("/"):
        for beginning, role in ROLES.items():
            if part.startswith(beginning):
                return role
    return "sample"


def inner_folder(photo: Photo) -> tuple[str, str] | None:
    """The folder inside a role's folder, by its path and its name."""
    parts = photo.file.split("/")
    return ("/".join(parts[:-1]), parts[-2]) if len(parts) > 2 else None


def is_bracket(photos: Sequence[Photo]) -> bool:
    times = [photo.exposure_time for photo in photos]
    return len(photos) > 1 and None not in times and len(set(times)) == len(times)
