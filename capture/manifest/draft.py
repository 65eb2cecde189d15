"""The photos of a folder as entries of a manifest: roles from folder names, exposures from EXIF."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

from photogonio.capture.containers.tone import LINEAR, SRGB, Tone
from photogonio.capture.errors import InputError
from photogonio.capture.files.documents import read_text, read_toml
from photogonio.capture.files.exposure import Exposure, stepped
from photogonio.capture.files.formats import HEAD, NAMES, OTHERS, PROMISED, SUFFIXES, by_content, by_name
from photogonio.capture.files.images import Header, read_header
from photogonio.capture.manifest.stub import photo_tables, quoted, remark, stub_manifest
from photogonio.capture.photoset import MANIFEST, Photo
from photogonio.capture.target.layout import make_target

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
DEVELOPED = {"jpeg", "heif", "avif", "jxl", "webp"}  # what a camera or a phone writes beside its RAW
PICTURES = ("coverage.png", "fit.png", "lobes.png")  # of a result
RESULTS = {  # files that tell a folder of results, and its pictures
    "coefficients.json": PICTURES,
    "comparison.json": ("scatter.png", "balls.png"),
}
DRAWN = "-photos"  # behind the name of a setup: the folder of its pictures
NAMED = 200  # letters of file names in a message


@dataclass(frozen=True, slots=True)
class Folder:
    """What is in a folder."""

    photos: tuple[Photo, ...]  # in order of their paths
    tones: tuple[Tone, ...]  # of each
    passed: Mapping[str, str]  # files that look like photos and are none of them, and why
    notes: tuple[str, ...]  # of the exposures


def manifest_text(folder: Path) -> str:
    """The whole photoset.toml for a folder's photos: its own, if it names no photo yet, with the photos
    added; else that of the A4 target, with a word on what to check.

    Raises InputError if there are no photos, if none can be read, or if the file names photos already.
    """
    found = survey(folder)
    lines = [tone_line(found.tones), *found.notes]
    path = folder / MANIFEST
    if path.exists():
        text, values = read_text(path), read_toml(path)
        if "photo" in values:
            raise InputError(path, "names photos already; move it away to begin anew")
        lines += encoding_doubt(values, encoding_for(found.tones))
    tables = (
        "".join(f"# {line}.\n" for line in lines) + photo_tables(found.photos) + passed_lines(found.passed)
    )
    if path.exists():
        return text.rstrip() + "\n\n" + tables
    stub = stub_manifest(make_target(), name=folder.resolve().name, encoding=encoding_for(found.tones))
    check = "# CHECK: the board, sample, balls and patch are those of the A4 sheet of `photogonio target`.\n"
    return check + stub + "\n" + tables


def encoding_for(tones: Iterable[Tone]) -> str:
    """The encoding that all files agree on, "auto" if it has no name or they differ."""
    curves = {curve for tone in tones for curve in tone.curves}
    return {frozenset({LINEAR}): "linear", frozenset({SRGB}): "srgb"}.get(frozenset(curves), "auto")


def tone_line(tones: Iterable[Tone]) -> str:
    """How the photos' codes stand for light, and what says so."""
    return "Tone curves: " + ", ".join(dict.fromkeys(f"{tone.name} ({tone.source})" for tone in tones))


def encoding_doubt(values: Mapping[str, object], found: str) -> list[str]:
    """What is to be checked where a manifest names another encoding than the photos have."""
    radiometry = values.get("radiometry")
    stated = radiometry.get("encoding") if isinstance(radiometry, dict) else None
    if stated not in ("linear", "srgb") or stated == found:
        return []
    return [f'CHECK: [radiometry] encoding = "{stated}" goes before what the photos have, "{found}"']


def passed_lines(passed: Mapping[str, str]) -> str:
    lines = [remark(f"# NOT TAKEN: {quoted(name)}: {why}") for name, why in passed.items()]
    return "\n" + "\n".join(lines) + "\n" if lines else ""


def survey(folder: Path) -> Folder:
    """All photos below a folder, in order of their paths, with role, light or bracket, and exposure; and what looks
    like a photo and is not taken.

    A folder inside a role's folder is a bracket if no two of its photos have the same exposure time, else a
    light: ``sample/L01/a.jpg``. Of a RAW file and a developed one of its name the RAW is taken.

    Raises InputError if there is none that can be read.
    """
    if not folder.is_dir():
        raise InputError(folder, "no such folder")
    headers, passed, faults = read_all(folder)
    if faults and not headers:
        raise faults[0]
    if not headers:
        others = f"; found {', '.join(sorted(passed))[:NAMED]}" if passed else ""
        raise InputError(folder, f"no photo here ({PROMISED}){others}")
    exposures, notes = stepped({name: header.exposure for name, header in headers.items()})
    photos = [photo_of(name, exposure) for name, exposure in exposures.items()]
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
    return Folder(tuple(result), tuple(header.tone for header in headers.values()), passed, notes)


def numbered_anew(photos: Iterable[Photo], known: Mapping[str, Photo]) -> tuple[Photo, ...]:
    """``photos`` with brackets that are no others' of the ``known`` ones, by file: a bracket that has known members is
    that of theirs, others come after all that there are."""
    photos = tuple(photos)
    theirs: dict[int, int] = {}
    for photo in photos:
        own = known[photo.file].bracket if photo.file in known else None
        if photo.bracket is not None and own is not None:
            theirs.setdefault(photo.bracket, own)
    after = max((p.bracket for p in known.values() if p.bracket is not None), default=0)
    for bracket in dict.fromkeys(p.bracket for p in photos if p.bracket is not None):
        if bracket not in theirs:
            after += 1
            theirs[bracket] = after
    return tuple(p if p.bracket is None else replace(p, bracket=theirs[p.bracket]) for p in photos)


def read_all(folder: Path) -> tuple[dict[str, Header], dict[str, str], list[InputError]]:
    """Headers of all photos by their names, why other files that look like photos are not taken, and what is wrong
    with those that cannot be read."""
    files = sorted(path for path in folder.rglob("*") if path.is_file() and not hidden(folder, path))
    raw = {path.with_suffix(""): path.name for path in files if by_name(path) == "raw"}
    headers: dict[str, Header] = {}
    passed: dict[str, str] = {}
    faults = []
    for path in files:
        name, kind = path.relative_to(folder).as_posix(), by_name(path)
        why = not_taken(path)
        if kind in DEVELOPED and path.with_suffix("") in raw:
            why = f"developed from {raw[path.with_suffix('')]}, which is taken"
        if why is None and kind is not None:
            try:
                headers[name] = read_header(path)
            except InputError as error:
                faults.append(error)
                why = error.what
        if why is not None:
            passed[name] = why
    return headers, passed, faults


def hidden(folder: Path, path: Path) -> bool:
    return any(part.startswith(".") for part in path.relative_to(folder).parts)


def not_taken(path: Path) -> str | None:
    """Why a file that is a picture by its name or its content is no photo; None if it is one, or no picture at all."""
    suffix = path.suffix.lower()
    if by_name(path) is not None:
        return "is a picture of a result that lies here" if of_result(path) else None
    if suffix in OTHERS:
        return f"{OTHERS[suffix]} is not read; convert it to TIFF of 16 bits"
    try:
        with path.open("rb") as file:
            kind = by_content(file.read(HEAD))
    except OSError:
        return None
    if kind is None or kind == "bmp":  # BM begins other files too
        return None
    endings = ", ".join(sorted(SUFFIXES[kind]))
    return f"is {NAMES[kind]} by its content, but not by its name; rename it ({endings})"


def of_result(path: Path) -> bool:
    """Whether a picture is one that a result has: by its name, and the numbers beside it."""
    beside = any(path.name in names and path.with_name(told).is_file() for told, names in RESULTS.items())
    folder = path.parent
    setup = folder.with_name(folder.name.removesuffix(DRAWN))
    written = all(setup.with_name(setup.name + suffix).is_file() for suffix in (".json", ".html"))
    return beside or (setup != folder and written)


def photo_of(name: str, exposure: Exposure) -> Photo:
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
