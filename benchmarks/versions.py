"""Is a file of version 2 as close to the truth as version 1 of the same result, which knows no coats and no brushes?

The relative error below 70 degrees of both, worst channel, of built-in scenes made smaller, or of results that exist::

    python -m benchmarks.versions [--scenes NAME ...] [--sets FOLDER] [--quick]
    python -m benchmarks.versions --results RESULT TRUTH RESULT TRUTH ...

A truth is a rendered set's truth.json or a table (.npz) of ``grid`` and ``brdf``.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.intervals import LIMIT, truth_of
from photogonio.compare.reflectances import find_brdf
from photogonio.evaluate.scenes import SUITE, evaluate_scene, smaller
from photogonio.evaluate.truth import TRUTH
from photogonio.reconstruct.brdf.brdf import Brdf, load_brdf
from photogonio.reconstruct.represent.developed import developed
from photogonio.synthetic.scene.scene import load_scene
from photogonio.system.progress import Reporter


def errors(brdf: Brdf, truth: Path) -> tuple[float, float, float, int]:
    """Relative errors below 70 degrees as found and in version 1, the loss that is stated of the latter, and its
    modes."""
    angles, true = truth_of(truth)
    inside = (angles[:, :2] < LIMIT).all(1) & (true > 0.0).any(1)
    first = developed(brdf)
    both = (_error(one, angles[inside], true[inside]) for one in (brdf, first.brdf))
    return *both, float(first.loss.max()), len(first.brdf.modes)


def _error(brdf: Brdf, angles: np.ndarray, true: np.ndarray) -> float:
    weight = (np.sin(2.0 * angles[:, 0]) * np.sin(2.0 * angles[:, 1]))[:, None]
    found = brdf.evaluate(angles[:, 0], 0.0, angles[:, 1], angles[:, 2])
    if brdf.scale == "relative":
        found = found * (np.sum(weight * true * found, axis=0) / np.sum(weight * found**2, axis=0))
    return float(
        np.sqrt(np.sum(weight * (found - true) ** 2, axis=0) / np.sum(weight * true**2, axis=0)).max()
    )


def line(name: str, brdf: Brdf, truth: Path) -> str:
    second, first, loss, modes = errors(brdf, truth)
    return f"{name:24s} {100 * second:9.3f} {100 * first:9.3f} {second / first:7.3f} {100 * loss:6.3f} {modes:6d}"


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", nargs="+", default=list(SUITE))
    parser.add_argument("--sets", type=Path, default=None, help="where rendered sets are kept")
    parser.add_argument("--quick", action="store_true", help="one scene")
    parser.add_argument("--results", nargs="+", type=Path, default=[], metavar=("RESULT TRUTH", ""))
    asked = parser.parse_args(arguments)
    print("set                      version 2 version 1   ratio   loss  modes    errors in per cent")
    for path, truth in zip(asked.results[::2], asked.results[1::2], strict=True):
        print(line(path.name, load_brdf(find_brdf(path)), truth), flush=True)
    if asked.results:
        return
    with tempfile.TemporaryDirectory() as folder:
        sets = asked.sets or Path(folder)
        for scene in map(smaller, map(load_scene, asked.scenes[:1] if asked.quick else asked.scenes)):
            score = evaluate_scene(scene, sets, workers=1, reporter=Reporter(quiet=True))
            truth = next(sets.glob(f"{scene.name}-*")) / TRUTH
            print(line(scene.name, score.result.brdf, truth), flush=True)


if __name__ == "__main__":
    main()
