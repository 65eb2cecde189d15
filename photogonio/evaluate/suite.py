"""The suite: materials by shapes, lamps and kits, a figure each, so that what a change spoils is seen the same day.

A set's name is its place in that table, ``plastic-25_ball_near_phone``; words choose rows and columns of it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

from photogonio.cache.kept import code_key, key_of
from photogonio.capture.errors import InputError
from photogonio.capture.manifest.schema import did_you_mean
from photogonio.compare.reflectances import load_known
from photogonio.evaluate.hard_cases import error_and_interval
from photogonio.evaluate.scenes import INNER, against, rendered, smaller, spread_over_processes
from photogonio.evaluate.truth import TRUTH
from photogonio.options import Options
from photogonio.pipeline import process
from photogonio.report.trust import faults_of
from photogonio.synthetic.scene.hard_cases import changed
from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.scene import load_scene
from photogonio.system.outputs import staged_file, to_json
from photogonio.system.progress import Reporter

_WARM, _BLUE = [0.62, 0.42, 0.25], [0.15, 0.22, 0.45]
MATERIALS: dict[str, dict[str, Any]] = {
    "lambert": {"model": "lambert", "albedo": _WARM},
    "lambert-dark": {"model": "lambert", "albedo": 0.05},
    "lambert-white": {"model": "lambert", "albedo": 0.92},
    "minnaert": {"model": "minnaert", "albedo": [0.4, 0.35, 0.3], "k": 1.2},
    "oepik": {"model": "oepik", "albedo": 0.3},
    "oren-nayar-20": {"model": "oren-nayar", "albedo": _WARM, "sigma": 0.2},
    "oren-nayar-50": {"model": "oren-nayar", "albedo": _WARM, "sigma": 0.5},
    "retro": {"model": "retro-reflector", "albedo": 0.25},
    "satin-30": {"model": "satin-paint", "albedo": _WARM, "roughness": 0.3},
    "satin-45": {"model": "satin-paint", "albedo": _WARM, "roughness": 0.45},
    "satin-60": {"model": "satin-paint", "albedo": _BLUE, "roughness": 0.6},
    "plastic-05": {"model": "plastic", "albedo": _BLUE, "roughness": 0.05},
    "plastic-10": {"model": "plastic", "albedo": _BLUE, "roughness": 0.1},
    "plastic-25": {"model": "plastic", "albedo": _BLUE, "roughness": 0.25},
    "plastic-40": {"model": "plastic", "albedo": _BLUE, "roughness": 0.4},
    "plastic-black": {"model": "plastic", "albedo": 0.02, "roughness": 0.2},
    "schlick-30": {"model": "plastic-schlick", "albedo": _WARM, "roughness": 0.3},
    "metal-20": {"model": "ggx-conductor", "roughness": 0.2},
    "metal-30": {"model": "ggx-conductor", "roughness": 0.3},
    "metal-50": {"model": "ggx-conductor", "roughness": 0.5},
    "brushed": {"model": "brushed-metal"},
    "turning": {"model": "anisotropic-ggx", "roughness_x": 0.3, "roughness_y": 0.2},
    "blinn-phong": {"model": "blinn-phong", "power": 60},
    "torrance-sparrow": {"model": "torrance-sparrow"},
}
SHAPES = ("ball", "plane")
LAMPS: dict[str, dict[str, Any]] = {
    "near": {"kind": "point", "radius": 7.0, "distance": (350.0, 500.0)},
    "distant": {"kind": "directional", "radius": 0.27},
}
KITS = ("full", "phone", "bare")  # two polished balls and a patch; neither, 8 bits; no board, all given


@dataclass(frozen=True, slots=True)
class SetScore:
    """One set of the suite, measured."""

    set: str
    error_70: float = math.nan  # relative L2 of f below 70 degrees, of the worst channel
    of_stated: float = math.nan  # the error over half the stated interval within the valid angles
    left_out: int = 0  # photos
    trusted: bool = True
    told: tuple[str, ...] = ()  # codes
    refused: str = ""  # the line it was refused with
    seconds: float = 0.0

    def to_dict(self) -> dict[str, object]:
        """As a row of ``evaluate.json``; no number is None there."""
        return {name: None if value != value else value for name, value in asdict(self).items()}


def suite_scenes(words: Sequence[str]) -> list[Scene]:
    """The sets that are named by all the words; of words of one kind (two materials), by any of them. No words: all.

    Raises:
        InputError: a word that names no material, shape, lamp or kit.
    """
    axes: tuple[Sequence[str], ...] = (tuple(MATERIALS), SHAPES, tuple(LAMPS), KITS)
    known = [name for axis in axes for name in axis]
    for word in words:
        if word not in known:
            raise InputError(word, f"no word of the suite{did_you_mean(word, known)}")
    return [_scene(*place) for place in product(*([w for w in a if w in words] or a for a in axes))]


def _scene(material: str, shape: str, lamp: str, kit: str) -> Scene:
    """Small photos, for what is compared has the same ones; a flat piece is seen by a camera that moves around it."""
    scene = replace(load_scene("example" if shape == "ball" else "plastic-plane"), brdf=MATERIALS[material])
    scene = smaller(changed(scene, lamp=LAMPS[lamp], name="_".join((material, shape, lamp, kit))))
    if kit == "phone":
        sensor = {"bits": 8, "encoding": "srgb", "bayer": True, "gain_electrons": 8000.0, "hot_pixels": 1e-4}
        return changed(scene, sensor=sensor, mirror_ball=(), camera={"vignetting": "cos4", "defocus": 0.8})
    if kit == "bare":
        still = {"given": True, "calibration": 0, "motion": "fixed", "elevation": (52.0, 52.0)}
        return changed(scene, board=None, mirror_ball=(), camera=still, lamp={"given": True})
    return scene


def run_suite(words: Sequence[str], sets: Path, *, workers: int, reporter: Reporter) -> Iterator[SetScore]:
    """Each set's score in turn; what the same program has measured before is read from ``sets``.

    Raises:
        InputError: as ``suite_scenes``.
    """
    jobs = [(scene, sets) for scene in suite_scenes(words)]
    for done, found in enumerate(spread_over_processes(_kept, jobs, workers)):
        reporter.progress("evaluating sets", done + 1, len(jobs))
        yield found


def _kept(job: tuple[Scene, Path]) -> SetScore:
    scene, sets = job
    place = sets / f"{scene.name}-{key_of(scene, code_key())[:12]}.json"
    try:
        row: dict[str, Any] = json.loads(place.read_text(encoding="utf-8"))
        known: dict[str, Any] = {name: math.nan if value is None else value for name, value in row.items()}
        return SetScore(**known)
    except (OSError, ValueError, TypeError, AttributeError):
        score = measured(scene, sets)
    with staged_file(place) as stage:
        stage.write_text(to_json(score.to_dict()), encoding="utf-8")
    return score


def measured(scene: Scene, sets: Path) -> SetScore:
    """Render one set (or take it from ``sets``), process it with everything automatic, and compare with the truth."""
    folder = rendered(scene, sets, workers=1, reporter=Reporter(quiet=True))
    try:
        result = process(folder, None, Options(workers=1))
    except InputError as refusal:
        return SetScore(scene.name, refused=str(refusal))
    truth = load_known(folder / TRUTH)
    error, stated = error_and_interval(result, truth)
    return SetScore(
        scene.name,
        error_70=float(against(result.brdf, truth, INNER).measures["relative_l2"].max()),
        of_stated=error / stated,
        left_out=len(result.left_out),
        trusted=not faults_of(result),
        told=tuple(sorted({one.code for one in result.diagnoses})),
        seconds=sum(result.seconds.values()),
    )


def suite_line(score: SetScore) -> str:
    """A line on screen."""
    if score.refused:
        return f"{score.set:36} refused: {score.refused}"
    line = f"{score.set:36} {100 * score.error_70:6.2f} %  {score.of_stated:5.2f} of stated  {score.seconds:5.1f} s"
    line += "" if score.trusted else "  not trusted"
    return line + (f"  told: {', '.join(score.told)}" if score.told else "")
