"""How time and memory of photos to table grow with their number, their pixels and the facets' level.

    python -m benchmarks.growth [--quick] [--photos 24,240]

Each row is a process of its own, except with --quick. "seconds" are of the reduction alone, "peak" is the
process's largest resident memory, libraries included; "x" is the ratio to the row above. Last, the powers p
of time ~ size^p.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.end_to_end import made_setup, make_set
from photogonio.capture.linear.prepare import prepare
from photogonio.capture.manifest.load import load_photoset
from photogonio.reconstruct.modes.parallel import cores
from photogonio.reconstruct.reduce.directions import ReduceOptions
from photogonio.run.reduce_photos import Plan, reduce_photos
from photogonio.system.memory import peak_megabytes

SHARE = 0.06


def measure(folder: Path, photos: int, megapixels: float, level: int) -> dict[str, float]:
    """Seconds, peak megabytes and cells of one reduction."""
    setup = made_setup(photos, ".png", SHARE, megapixels)
    reader = prepare(load_photoset(folder))
    job = Plan(level, ReduceOptions(), cores())
    reduce_photos(reader, replace(setup, views=setup.views[:1]), job)  # loads what is compiled
    start = time.perf_counter()
    reduced = reduce_photos(reader, setup, job)
    seconds = time.perf_counter() - start
    peak = peak_megabytes()
    return {"seconds": seconds, "peak": peak, "cells": len(reduced.table)}


def measure_apart(folder: Path, photos: int, megapixels: float, level: int) -> dict[str, float]:
    """:func:`measure` in a process of its own."""
    words = ["--child", str(folder), str(photos), str(megapixels), str(level)]
    command = [sys.executable, "-m", "benchmarks.growth", *words]
    done = subprocess.run(command, check=True, capture_output=True, text=True, cwd=Path(__file__).parents[1])
    return json.loads(done.stdout)


def rows(
    title: str,
    sizes: Sequence[float],
    jobs: Sequence[tuple[int, float, int]],
    made: Path,
    measured: Callable[..., dict[str, float]],
) -> None:
    """A line for each job (photos, megapixels, level), and the power of time against size."""
    seconds: list[float] = []
    for size, (photos, megapixels, level) in zip(sizes, jobs, strict=True):
        folder = made / f"{photos}-{megapixels:g}"
        if not folder.exists():
            make_set(folder, made_setup(photos, ".png", SHARE, megapixels), ".png")
        found = measured(folder, photos, megapixels, level)
        ratio = f"x {found['seconds'] / seconds[-1]:6.2f}" if seconds else " " * 8
        seconds.append(found["seconds"])
        line = f"{title:10} {size:8g}  {found['seconds']:8.2f} s  {ratio}  {found['peak']:7.0f} MB"
        print(f"{line}  {found['cells']:9} cells", flush=True)
    if len(seconds) > 1:
        power = np.polyfit(np.log(sizes), np.log(seconds), 1)[0]
        print(f"{title:10} time ~ size^{power:.2f}")


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few small photos: shows that it runs")
    parser.add_argument("--photos", default="24,240", help="numbers of photos of 12 megapixels")
    parser.add_argument("--child", nargs=4, metavar=("SET", "PHOTOS", "MEGAPIXELS", "LEVEL"))
    options = parser.parse_args(arguments)
    if options.child:
        folder, photos, megapixels, level = options.child
        print(json.dumps(measure(Path(folder), int(photos), float(megapixels), int(level))))
        return
    large, few = (0.1, 2) if options.quick else (12.0, 12)
    numbers = [2, 4] if options.quick else [int(n) for n in options.photos.split(",")]
    pixels = [large / 2, large] if options.quick else [3.0, 6.0, 12.0, 24.0]
    levels = [2, 3] if options.quick else [2, 3, 4, 5, 6]
    measured = measure if options.quick else measure_apart
    tables = {
        "photos": (numbers, [(n, large, 4) for n in numbers]),
        "Mpx": (pixels, [(few, size, 4) for size in pixels]),
        "facets": ([10 * 4**level for level in levels], [(few, large, level) for level in levels]),
    }
    with tempfile.TemporaryDirectory() as made:
        for title, (sizes, jobs) in tables.items():
            rows(title, sizes, jobs, Path(made), measured)


if __name__ == "__main__":
    main()
