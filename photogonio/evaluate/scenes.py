"""Scenes whose answer is known, measured: synthesize, process, compare; what it cost and how close it came."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

import numpy as np

from photogonio import synthetic
from photogonio.cache.kept import key_of, text_key
from photogonio.cache.store import VARIABLE
from photogonio.capture.errors import InputError
from photogonio.compare.compare import Comparison, compare
from photogonio.compare.known import Known
from photogonio.compare.reflectances import as_reflectance, load_known
from photogonio.evaluate.truth import TRUTH, CalibrationError, calibration_error, load_truth
from photogonio.options import Options
from photogonio.pipeline import process
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.report.summary import photos_used
from photogonio.result import Result
from photogonio.synthetic.scene import hard_cases as hard
from photogonio.synthetic.scene.hard_cases import changed
from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.scene import load_scene
from photogonio.synthetic.write.photoset import synthesize
from photogonio.system.memory import peak_megabytes, reset_peak
from photogonio.system.processes import ProcessDied, as_done
from photogonio.system.progress import Reporter, Stopwatch

SUITE = (
    "matte-ball",
    "oren-nayar-ball",
    "minnaert-ball",
    "example",
    "torrance-sparrow-ball",
    "blinn-phong-ball",
    "plastic-ball",
    "glossy-ball",
    "metal-ball",
    "retro-ball",
    "oren-nayar-plane",
    "plastic-plane",
    "brushed-plane",
)
QUICK = ("matte-ball", "example", "plastic-ball", "oren-nayar-ball")
SMALLER, QUICK_LAMPS, QUICK_CALIBRATION = 0.7, 8, 4
Job = TypeVar("Job")
Done = TypeVar("Done")
INNER, OUTER = np.radians(70.0), np.radians(80.0)  # masks: what all errors are quoted at, and the field's


@dataclass(frozen=True, slots=True)
class Score:
    """One scene, measured."""

    scene: str
    inner: Comparison  # both angles below 70 degrees
    outer: Comparison  # below 80
    calibration: CalibrationError
    result: Result
    seconds: dict[str, float]  # by stage
    megabytes: float  # peak of the process while this scene was processed; NaN where the system does not tell

    @property
    def error(self) -> float:
        """Relative L2 below 70 degrees of the worst channel."""
        return float(self.inner.measures["relative_l2"].max())

    def to_dict(self) -> dict[str, object]:
        brdf = self.result.brdf
        outer = {name: values.max() for name, values in self.outer.measures.items()}
        return {
            "scene": self.scene,
            "error_70": self.error,
            "error_70_channels": self.inner.measures["relative_l2"],
            **{f"{name}_80": value for name, value in outer.items()},
            **(self.outer.appearance.to_dict() if self.outer.appearance else {}),
            **{f"calibration_{name}": value for name, value in self.calibration.to_dict().items()},
            "order": brdf.order,
            "lobes": len(brdf.lobes),
            "roughness": [lobe.roughness for lobe in brdf.lobes],
            "symmetry": brdf.symmetry,
            "level": self.result.table.level,
            "photos_used": photos_used(self.result),
            "photos_left_out": len(self.result.left_out),
            **{f"seconds_{name}": value for name, value in self.seconds.items()},
            "seconds": sum(self.seconds.values()),
            "megabytes": self.megabytes,
        }


def evaluate_scenes(scenes: Sequence[Scene], sets: Path, *, workers: int, reporter: Reporter) -> list[Score]:
    """Each scene by itself in a process of one worker, ``workers`` of them at a time, in the order given.

    Raises:
        InputError: a set cannot be used.
    """
    jobs = [(scene, sets) for scene in scenes]
    scores: list[Score] = []
    for done, found in enumerate(spread_over_processes(_score, jobs, workers)):
        reporter.progress("evaluating scenes", done + 1, len(jobs))
        if isinstance(found, Refusal):
            raise InputError(found.where, found.what)
        scores.append(found)
    return scores


def spread_over_processes(work: Callable[[Job], Done], jobs: Sequence[Job], workers: int) -> Iterator[Done]:
    """The results of ``work`` on each job in their order, ``workers`` jobs at a time, each in a process; one at a time
    in this one.

    Raises:
        InputError: a process died.
    """
    if min(workers, len(jobs)) <= 1:
        yield from map(work, jobs)
        return
    early: dict[int, Done] = {}
    next_one = 0
    try:
        for place, found in as_done(work, jobs, workers, _keep_nothing):
            early[place] = found
            while next_one in early:
                yield early.pop(next_one)
                next_one += 1
    except ProcessDied as died:
        of = ", ".join(str(1 + place) for place in died.under_way)
        raise InputError(
            "evaluate", f"a process died at number {of} of {len(jobs)}: is there memory enough?"
        ) from None


@dataclass(frozen=True, slots=True)
class Refusal:
    """An InputError on its way between processes."""

    where: str
    what: str


def _score(job: tuple[Scene, Path]) -> Score | Refusal:
    try:
        return evaluate_scene(*job, workers=1, reporter=Reporter(quiet=True))
    except InputError as error:
        return Refusal(error.where, error.what)


def _keep_nothing() -> None:
    """No result of an earlier run may make this one look fast."""
    os.environ[VARIABLE] = ""


def evaluate_scene(scene: Scene, sets: Path, *, workers: int, reporter: Reporter) -> Score:
    """Render (or take from ``sets``), process with everything automatic, and compare with the truth."""
    folder = rendered(scene, sets, workers=workers, reporter=reporter)
    reset_peak()
    watch = Stopwatch()
    result = process(folder, None, Options(workers=workers), Reporter(quiet=True))
    watch.lap("process")
    truth = load_known(folder / TRUTH)
    inner, outer = (against(result.brdf, truth, mask) for mask in (INNER, OUTER))
    return Score(
        scene=scene.name,
        inner=inner,
        outer=outer,
        calibration=calibration_error(result.measured, load_truth(folder)),
        result=result,
        seconds=dict(result.seconds),
        megabytes=peak_megabytes(),
    )


def against(brdf: Brdf, truth: Known, mask: float) -> Comparison:
    """A fit compared with the truth; on a relative scale, after one factor a channel."""
    known = Known("fit", brdf.channels, isotropic=not brdf.turning, evaluate=brdf)
    return compare(known, truth, mask=mask, scale=brdf.scale == "relative")


def rendered(scene: Scene, sets: Path, *, workers: int, reporter: Reporter) -> Path:
    """The scene's photo set in ``sets``, rendered unless it is there; a changed scene or renderer is a new set."""
    folder = sets / f"{scene.name}-{key_of(scene, renderer_key())[:12]}"
    if not (folder / TRUTH).is_file():
        reporter.say(f"rendering {scene.name}")
        synthesize(
            scene,
            folder,
            workers,
            lambda done, total: reporter.progress(f"rendering {scene.name}", done, total),
            foreign=as_reflectance,
        )
    return folder


@lru_cache(maxsize=1)
def renderer_key() -> str:
    """A hash of the program text that renders; what the hard cases are is in their scenes."""
    return text_key(Path(synthetic.__file__).parent, leaving_out={Path(hard.__file__)})


def load_scenes(names: Sequence[str], *, quick: bool) -> list[Scene]:
    """The scenes named, or the suite (quick: a part of it); quick: with fewer and smaller photos.

    Raises:
        InputError: an unknown scene, or one named twice.
    """
    chosen = tuple(names) or (QUICK if quick else SUITE)
    if len(set(chosen)) != len(chosen):
        raise InputError("evaluate", "a scene is named twice")
    scenes = [load_scene(name) for name in chosen]
    return [smaller(scene) for scene in scenes] if quick else scenes


def smaller(scene: Scene) -> Scene:
    """The scene seen by a camera of 0.7 times as many pixels a side, in fewer photos, edges sampled less finely."""
    camera = scene.camera
    return changed(
        scene,
        camera={
            "size": tuple(round(SMALLER * side) for side in camera.size),
            "focal": SMALLER * camera.focal,
            "center": tuple(SMALLER * place for place in camera.center),
            "calibration": min(camera.calibration, QUICK_CALIBRATION),
        },
        render={"near": 2, "edge": 4},
        lamp={"count": min(scene.lamp.count, QUICK_LAMPS)},
    )
