"""``photogonio init``."""

from __future__ import annotations

import argparse
import textwrap
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.capture.files.documents import read_toml
from photogonio.capture.files.formats import by_name
from photogonio.capture.manifest.draft import (
    DEVELOPED,
    Folder,
    encoding_doubt,
    encoding_for,
    manifest_text,
    numbered_anew,
    passed_lines,
    survey,
    tone_line,
)
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.manifest.seen import (
    FLASH,
    STUB_BESIDE,
    flash_light,
    sample_lines,
    seen_manifest,
    with_sample,
)
from photogonio.capture.manifest.stub import photo_tables, quoted
from photogonio.capture.photoset import MANIFEST, Photo, PhotoSet, Plane, Sphere
from photogonio.survey.recognise import Recognised, recognise
from photogonio.system.outputs import check_place, staged_file
from photogonio.system.progress import Reporter

NO_BOARD = (
    "# CHECK: no photo shows a board whose markers are numbered row by row: write [board] (docs/photoset.md),\n"
    "# or take it out and give [camera] matrix, rotation and translation.\n"
)
BENT = (  # of a camera's own JPEG, HEIF and their kin
    'Cameras bend what they develop by a curve that no file tells: encoding = "unknown" learns it from the print.',
    'Where the codes are known to stand for light as the files say, write "auto". RAW photos are surer.',
)
WIDTH = 110  # characters of a line of remarks
FAR = 2.0  # mm between the manifest's sample and the photos' that are worth a word


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    folder = Path(args.folder)
    found, path = survey(folder), folder / MANIFEST
    given = load_photoset(folder, unnamed=True) if path.is_file() else None
    known = {p.file: p for p in (() if given is None else given.photos)}
    found = replace(found, photos=numbered_anew(found.photos, known))
    new = [p for p in found.photos if p.file not in known]
    if known and not new:
        reporter.say(f"{path} names all {len(known)} photos already; nothing is to be added")
        return _numbers(path, found, list(known.values()), None, 0)
    check_place(path, folder=False)
    every = [known.get(p.file, p) for p in found.photos]
    before = path.read_text("utf-8") if given is not None else ""
    seen = recognise(folder, every, None if given is None else given.board, reporter.progress)
    photos = _lit(seen, known, one_light=given is not None and bool(given.lights))
    text = (
        _new_text(folder, found, seen, photos)
        if given is None
        else _added_text(path, given, found, seen, photos)
    )
    with staged_file(path) as stage:
        stage.write_text(text, encoding="utf-8", newline="")
    for name, why in found.passed.items():
        reporter.warn(f"{name} is not taken: {why}")
    if given is None and seen.found is None:
        reporter.warn("no photo shows a board: the manifest is that of the A4 sheet of `photogonio target`")
    for doubt in _doubts(seen) if given is None and seen.found is not None else []:
        reporter.warn(doubt)
    _say(reporter, path, photos, seen, given)
    if given is not None and (doubts := text.count("# CHECK: ") - before.count("# CHECK: ")) > 0:
        reporter.say(f"what is in doubt stands in the file as CHECK ({doubts} new)")
    return _numbers(path, found, photos, seen, len(new))


def _new_text(folder: Path, found: Folder, seen: Recognised, photos: list[Photo]) -> str:
    """A whole manifest; that of our A4 sheet, to be looked over, if no photo shows a board."""
    if seen.found is None:
        return NO_BOARD + manifest_text(folder)
    notes = [tone_line(found.tones), *found.notes]
    notes += [f"Camera: {seen.camera}"] if seen.camera else []
    if seen.found.sheet is None:
        size = seen.found.board.pitch
        notes.append(
            f"CHECK: no photo tells how large the print is; its squares are taken for {size:g} mm. Measure several"
        )
        notes.append("together: if they differ, all lengths here change in proportion (board, sample).")
    else:
        notes.append(
            f"The board is that of `photogonio target --paper {seen.found.sheet}`. CHECK: measure its ruler."
        )
    bent = _bent(found, seen)
    notes += BENT if bent else ()
    sample = None if seen.sample is None else seen.sample.sample
    head = seen_manifest(
        name=folder.resolve().name,
        board=seen.found.board,
        sample=sample_lines(sample, _doubts(seen)),
        notes=notes,
        encoding="unknown" if bent else encoding_for(found.tones),
        flash=any(p.light == FLASH for p in photos),
        beside=[(float(one.corners[:, 0].mean()), float(one.corners[:, 1].mean())) for one in seen.beside],
    )
    return head + "\n" + photo_tables(photos) + passed_lines(found.passed)


def _added_text(path: Path, given: PhotoSet, found: Folder, seen: Recognised, photos: list[Photo]) -> str:
    """The manifest as it is, with photos that it does not name, and with the sample if its own is the example's."""
    (text, ends), values = _read(path), read_toml(path)
    lines = [] if given.photos else [tone_line(found.tones), *found.notes]
    lines += encoding_doubt(values, encoding_for(found.tones))
    if _bent(found, seen) and given.radiometry.encoding == "auto":
        lines.append(f'CHECK: [radiometry] encoding = "auto" stands in this file. {BENT[0]} {BENT[1]}')
    if seen.sample is not None:
        replaced = with_sample(text, sample_lines(seen.sample.sample, _doubts(seen)))
        if replaced is not None:
            text = replaced
        elif (far := _apart(given.sample, seen.sample.sample)) > FAR:
            lines.append(f"CHECK: the photos show the sample {far:.1f} mm from where [sample] says")
    if any(words in text for words in STUB_BESIDE):
        lines.append(
            "CHECK: [[mirror_ball]] and [[white_patch]] are where the printed sheet has a place for them: delete what "
            "does not lie there, else its light is read from the bare print"
        )
    flash = any(p.light == FLASH for p in photos) and all(light.id != FLASH for light in given.lights)
    tables = "".join(map(_remark, lines)) + photo_tables(photos)
    tables += passed_lines({name: why for name, why in found.passed.items() if quoted(name) not in text})
    text += "" if text.endswith("\n") else "\n"
    text += (flash_light() if flash else "") + "\n" + tables
    try:
        tomllib.loads(text.removeprefix("\ufeff"))
    except ValueError:
        asked = "has photo or light as a list (photo = [...]), to which no table can be added"
        raise InputError(path, f"{asked}; write each as [[photo]] or [[light]]") from None
    return text.replace("\n", ends)


def _remark(line: str) -> str:
    """A sentence or two as a remark, over as many lines as it takes."""
    whole = line[0].upper() + line[1:].rstrip(".") + "."
    return textwrap.fill(whole, WIDTH, initial_indent="# ", subsequent_indent="# ") + "\n"


def _read(path: Path) -> tuple[str, str]:
    """A manifest's text, its lines with plain ends if all have the same, and what their ends are."""
    text = path.read_bytes().decode()
    alike = text.count("\r\n") == text.count("\n") > 0
    return (text.replace("\r\n", "\n"), "\r\n") if alike else (text, "\n")


def _bent(found: Folder, seen: Recognised) -> bool:
    """Whether a camera developed the photos, by a curve of its own."""
    return bool(seen.camera) and all(by_name(Path(p.file)) in DEVELOPED for p in found.photos)


def _apart(one: Sphere | Plane, other: Sphere | Plane) -> float:
    """How far a sample's middle is from another's; infinite between a ball and a flat piece."""
    if isinstance(one, Sphere) and isinstance(other, Sphere):
        return float(np.linalg.norm(np.asarray(one.center) - np.asarray(other.center)))
    if isinstance(one, Plane) and isinstance(other, Plane):
        return float(np.linalg.norm(np.mean(one.outline, axis=0) - np.mean(other.outline, axis=0)))
    return float("inf")


def _doubts(seen: Recognised) -> list[str]:
    if seen.sample is None:
        return ["no photo shows a sample on the board: this one is an example"]
    if not seen.sample.placed:
        return ["the sample's outline is found to some millimetres only"]
    return [] if seen.sample.sure else ["what stands on the board is not wholly told by this shape"]


def _lit(seen: Recognised, known: dict[str, Photo], *, one_light: bool) -> list[Photo]:
    """The photos that are not ``known``, those by a flash with its light. Where the manifest has one (``one_light``),
    or will have the flash, a photo without a light's id would be lit by it: each other photo of the sample, or bracket,
    gets a light of its own, by its file's name."""
    lights: dict[int, str] = {}
    new = []
    flashed = any(p.file in seen.flash and p.light in (None, FLASH) for p in seen.photos)
    for p in seen.photos:
        light = p.light
        if light is None and p.file in seen.flash:
            light = FLASH
        elif light is None and p.role == "sample" and (flashed or one_light):
            light = Path(p.file).with_suffix("").as_posix()
            light = light if p.bracket is None else lights.setdefault(p.bracket, light)
        if p.file not in known:
            new.append(replace(p, light=light))
    return new


def _say(
    reporter: Reporter, path: Path, photos: list[Photo], seen: Recognised, given: PhotoSet | None
) -> None:
    counts = ", ".join(f"{count} {role}" for role, count in _counts(photos).items())
    reporter.say(f"written to {path} ({counts})")
    if given is None and seen.sample is not None:
        one = seen.sample.sample
        what = (
            f"a ball of radius {one.radius:.1f} at {one.center[0]:.1f}, {one.center[1]:.1f}"
            if isinstance(one, Sphere)
            else f"a flat piece with {len(one.outline)} corners"
        )
        reporter.say(f"the sample is {what}; what is in doubt stands in the file as CHECK")


def _counts(photos: list[Photo]) -> dict[str, int]:
    roles = [photo.role for photo in photos]
    return {role: roles.count(role) for role in dict.fromkeys(roles)}


def _numbers(
    path: Path, found: Folder, photos: list[Photo], seen: Recognised | None, added: int
) -> dict[str, object]:
    sample = None if seen is None or seen.sample is None else seen.sample.sample
    place: dict[str, object] | None = None
    if isinstance(sample, Sphere):
        place = {"shape": "sphere", "center": sample.center, "radius": sample.radius}
    elif sample is not None:
        place = {"shape": "plane", "outline": sample.outline, "height": sample.height}
    return {
        "out": str(path),
        "photos": _counts(photos),
        "added": added,
        "sample": place,
        "camera": "" if seen is None else seen.camera,
        "flash": [] if seen is None else list(seen.flash),
        "not_taken": dict(found.passed),
    }
