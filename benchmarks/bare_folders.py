"""Folders of photos without a word of help: whether `init` sees all that a manifest asks, and `process` takes it.

Twelve folders are rendered, drawn anew by the seed: balls and flat pieces on sheets of `photogonio target`, by a
phone's flash and a torch, by the flash alone, by a lamp with polished balls and a patch on the sheet, in brackets;
JPEG, HEIC and DNG; with photos of the bare sheet and without. Manifest and truth are taken away and all photos put
into one folder under the names that a camera would give. A row is one folder: what of the manifest is right, how far
the sample is off (a ball's middle and its radius, a flat piece's worst corner, mm), and how `process` ends::

    python -m benchmarks.bare_folders [--seed 1] [--cases 0 5 ...] [--width 800] [--no-process] [--keep FOLDER]
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.photoset import MANIFEST, PhotoSet, Plane, Sphere
from photogonio.capture.target.layout import Target, make_target
from photogonio.cli import main as command
from photogonio.evaluate.truth import TRUTH
from photogonio.synthetic.scene.hard_cases import changed
from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.parts import BallScene, BoardScene, PatchScene
from photogonio.synthetic.scene.phone import SHAPES, ToneCurve
from photogonio.synthetic.scene.scene import load_scene
from photogonio.synthetic.write.photoset import synthesize

NEAR = 1.0  # mm, that a sample may be off
SHEETS: tuple[dict[str, object], ...] = (
    {"paper": "a4"},
    {"paper": "letter"},
    {"paper": "a4", "kind": "aruco-grid"},
    {"paper": "a4", "square": 15.0},
    {"paper": "a3", "square": 25.0},
)


@dataclass(frozen=True, slots=True)
class Case:
    """One kind of folder."""

    shape: str  # "sphere" | "plane"
    light: str  # "both": flash and torch in turns | "flash" | "lamp"
    format: str  # "jpeg" | "heic" | "dng"
    sheet: int  # of SHEETS
    bare: int  # photos of the bare sheet
    aids: bool = False  # polished balls and a patch on the sheet
    brackets: bool = False
    still: bool = False  # the camera


CASES = (
    Case("sphere", "both", "jpeg", 0, 6),
    Case("plane", "both", "jpeg", 1, 6),
    Case("sphere", "both", "dng", 3, 0),
    Case("plane", "both", "dng", 2, 5),
    Case("sphere", "both", "heic", 2, 7),
    Case("plane", "both", "heic", 0, 0),
    Case("sphere", "lamp", "dng", 0, 6, aids=True, brackets=True, still=True),
    Case("plane", "lamp", "jpeg", 4, 5, aids=True, brackets=True),
    Case("sphere", "flash", "jpeg", 1, 6),
    Case("plane", "flash", "dng", 3, 6),
    Case("sphere", "lamp", "heic", 4, 0, aids=True),
    Case("plane", "lamp", "dng", 0, 8, aids=True),
)


@dataclass(frozen=True, slots=True)
class Judged:
    """One folder's manifest beside the truth; empty words where all is right."""

    wrong: tuple[str, ...]
    off: float  # mm; infinite for another shape
    size: float  # mm: a ball's radius, a flat piece's height
    doubts: int  # remarks that begin with CHECK


def scene_of(case: Case, width: int, seed: int) -> Scene:
    """A scene of a kind, its sample, surface, curve and lamps drawn by the seed."""
    rng = np.random.default_rng(seed)
    sheet = make_target(**SHEETS[case.sheet])  # type: ignore[arg-type]
    scene = load_scene("phone-plane")
    far = float(rng.uniform(2.0, 2.5)) * sheet.size[0]
    scene = replace(
        scene,
        seed=seed,
        brdf=_surface(rng),
        board=_board(sheet),
        mirror_ball=_balls(sheet) if case.aids else (),
        white_patch=(PatchScene(_points(sheet.patch)),) if case.aids else (),
    )
    size = (width, round(width * 2 / 3))
    camera = {
        "size": size,
        "focal": 1.75 * width,
        "distance": (0.9 * far, 1.1 * far),
        "calibration": case.bare,
    }
    camera |= {"motion": "fixed", "hand": None, "elevation": (55.0, 55.0)} if case.still else {}
    lamp: dict[str, object] = {"distance": (0.7 * far, far)}
    if case.light == "lamp":
        lamp |= {"attached_at": None}
    else:
        at = (float(rng.uniform(-16, 16)), float(rng.uniform(-12, 12)), float(rng.uniform(-4, 0)))
        lamp |= {"attached_at": at, "attached_every": 2 if case.light == "both" else 1}
    sensor: dict[str, object] = {"format": case.format}
    if case.format == "dng":
        sensor |= {"encoding": "linear", "bits": 16, "denoise": None, "sharpen": None}
    else:
        sensor["tone"] = ToneCurve(str(rng.choice(SHAPES)), float(rng.uniform(0.5, 1.0)))
    if case.brackets:
        sensor |= {"exposure": None, "brackets": (1.0, 0.25), "level": 0.8}
        lamp["count"] = 8
    sample = _sample(case, sheet, rng)
    return changed(
        scene, sample=sample, camera=camera, lamp=lamp, sensor=sensor, render={"near": 2, "edge": 4}
    )


def _surface(rng: np.random.Generator) -> dict[str, object]:
    albedo = rng.uniform(0.1, 0.8, 3).round(3).tolist()
    return [
        {"model": "oren-nayar", "albedo": albedo, "sigma": 0.3},
        {"model": "satin-paint", "albedo": albedo, "roughness": 0.4},
        {"model": "plastic", "albedo": albedo, "roughness": 0.25},
    ][rng.integers(3)]


def _board(sheet: Target) -> BoardScene:
    board = sheet.board
    if hasattr(board, "squares"):
        return BoardScene(
            "charuco", board.dictionary, board.squares, board.square_length, None, board.marker_length
        )
    return BoardScene(
        "aruco-grid",
        board.dictionary,
        None,
        None,
        board.markers,
        board.marker_length,
        board.marker_separation,
    )


def _balls(sheet: Target) -> tuple[BallScene, ...]:
    return tuple(BallScene((x, y, 8.0), 8.0) for x, y in sheet.balls)


def _points(corners: np.ndarray) -> tuple[tuple[float, ...], ...]:
    return tuple((float(x), float(y)) for x, y in corners)


def _sample(case: Case, sheet: Target, rng: np.random.Generator) -> dict[str, object]:
    """A ball or a flat piece about the middle of the sheet, as the truth; nothing is told of it."""
    middle = np.array(sheet.sample) + rng.uniform(-12.0, 12.0, 2)
    if case.shape == "sphere":
        radius = round(float(rng.uniform(15.0, 30.0)), 2)
        return {"shape": "sphere", "center": (*middle.round(2).tolist(), radius), "radius": radius}
    half, turn = rng.uniform(20.0, 38.0, 2), float(rng.uniform(-0.6, 0.6))
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * half
    spin = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    height = round(float(rng.uniform(0.3, 3.0)), 2)
    return {"shape": "plane", "outline": _points((middle + corners @ spin).round(2)), "height": height}


def bare(folder: Path, into: Path, rng: np.random.Generator) -> dict[str, str]:
    """Copies a rendered set's photos as a camera would name them, without manifest and truth; photos of the bare sheet
    first or last. Returns their files in the set by their names."""
    told = load_photoset(folder)
    parts = [[p.file for p in told.photos if (p.role == "calibration") is first] for first in (True, False)]
    files = [*parts[0], *parts[1]] if rng.random() < 0.5 else [*parts[1], *parts[0]]
    into.mkdir()
    start, named = int(rng.integers(1, 900)), {}
    for k, file in enumerate(files):
        name = f"IMG_{start + k:04d}{Path(file).suffix}"
        shutil.copyfile(folder / file, into / name)
        named[name] = file
    return named


def judged(folder: Path, into: Path, named: dict[str, str]) -> Judged:
    """The manifest of ``into`` beside that of the rendered set."""
    told, text = load_photoset(folder), (into / MANIFEST).read_text()
    got, scene = load_photoset(into), json.loads((folder / TRUTH).read_text())["scene"]
    wrong = []
    board, found = told.board, got.board
    for key in ("dictionary", "squares", "square_length", "markers", "marker_length", "marker_separation"):
        if not _alike(getattr(board, key, None), getattr(found, key, None)):
            wrong.append(f"board's {key} {getattr(found, key, None)}")
    truth = {p.file: p for p in told.photos}
    if sorted(p.file for p in got.photos) != sorted(named):
        wrong.append("photos")
    roles = [p.file for p in got.photos if p.role != truth[named[p.file]].role]
    wrong += [f"role of {file}" for file in roles]
    flash = [
        p.file
        for p in got.photos
        if p.role == "sample" and (p.light == "flash") != (truth[named[p.file]].light == "flash")
    ]
    wrong += [f"flash of {file}" for file in flash]
    if _brackets(got, {name: name for name in named}) != _brackets(
        told, {file: name for name, file in named.items()}
    ):
        wrong.append("brackets")
    off, size = _off(scene["sample"], got)
    return Judged(tuple(wrong), off, size, sum("CHECK" in line for line in text.splitlines()))


def _alike(one: object, other: object) -> bool:
    if isinstance(one, float) and isinstance(other, float):
        return abs(one - other) < 0.01
    return one == other


def _brackets(photos: PhotoSet, called: dict[str, str]) -> set[frozenset[str]]:
    groups: dict[int, set[str]] = {}
    for p in photos.photos:
        if p.bracket is not None:
            groups.setdefault(p.bracket, set()).add(called[p.file])
    return {frozenset(one) for one in groups.values()}


def _off(truth: dict[str, object], got: PhotoSet) -> tuple[float, float]:
    """How far middle or worst corner is off, and radius or height."""
    sample = got.sample
    if truth["shape"] == "sphere" and isinstance(sample, Sphere):
        return float(np.linalg.norm(np.asarray(sample.center) - truth["center"])), sample.radius - truth[
            "radius"
        ]
    if truth["shape"] == "plane" and isinstance(sample, Plane):
        corners, outline = np.asarray(truth["outline"]), np.asarray(sample.outline)
        if len(corners) != len(outline):
            return np.inf, 0.0
        apart = np.linalg.norm(corners[:, None] - outline, axis=2)
        return float(max(apart.min(axis=0).max(), apart.min(axis=1).max())), sample.height - truth["height"]
    return np.inf, 0.0


def run(words: list[str]) -> tuple[int, str, str]:
    """A command's exit status, what it printed, and what it complained of."""
    out, complaints = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(complaints):
        code = command(words)
    return code, out.getvalue(), complaints.getvalue()


def row(k: int, seed: int, width: int, place: Path, processed: bool) -> tuple[bool, str]:
    """One folder rendered, `init`ed and processed; whether all is right, and the row."""
    case, name = CASES[k], f"{k:02d}-{seed}"
    folder, into = place / name, place / f"{name}-bare"
    if not folder.exists():
        synthesize(replace(scene_of(case, width, 100 * seed + k), name=name), folder)
    shutil.rmtree(into, ignore_errors=True)
    named = bare(folder, into, np.random.default_rng(100 * seed + k))
    words = f"{k} {case.shape} {case.light} {case.format} {SHEETS[case.sheet]} bare {case.bare}"
    code, _, said = run(["init", str(into), "--quiet"])
    if code:
        return False, f"{words}: init {code}: {said.strip()}"
    try:
        found = judged(folder, into, named)
    except InputError as error:
        return False, f"{words}: {error}"
    right = not found.wrong and found.off <= NEAR and abs(found.size) <= NEAR
    told = f"{words}: {'right' if right else 'WRONG'}, off {found.off:.2f}, size {found.size:+.2f}"
    told += f", {found.doubts} CHECK"
    told += "".join(f"; {one}" for one in found.wrong[:4])
    if processed:
        for verb in (["check", str(into)], ["process", str(into), "-o", str(place / f"{name}-out")]):
            code, _, said = run([*verb, "--json"])
            right &= code in (0, 3)
            told += f"; {verb[0]} {code}" + (f" {said.strip()[-300:]}" if code not in (0, 3) else "")
    return right, told


def lines(cases: list[int], seed: int, width: int, place: Path, processed: bool) -> Iterator[str]:
    rights = []
    for k in cases:
        right, told = row(k, seed, width, place, processed)
        rights.append(right)
        yield told
    yield f"right: {sum(rights)} of {len(rights)}"


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cases", type=int, nargs="+", default=list(range(len(CASES))))
    parser.add_argument("--width", type=int, default=800)
    parser.add_argument("--no-process", action="store_true")
    parser.add_argument("--keep", type=Path, help="folder for the sets; default: none is kept")
    args = parser.parse_args(arguments)
    with nullcontext(args.keep) if args.keep else tempfile.TemporaryDirectory() as place:
        Path(place).mkdir(exist_ok=True, parents=True)
        for line in lines(args.cases, args.seed, args.width, Path(place), not args.no_process):
            print(line, flush=True)


if __name__ == "__main__":
    main()
