"""How what is done to all photos of a set together grows with their number, without pictures.

    python -m benchmarks.many_photos [--quick] [--photos 100,1000,10000] [--pixels 150]
    python -m benchmarks.many_photos --settled 12,24,48,96

Drawn tables of one matte ball, of so many photos with so many pixels each: joined, kept as `table.npz` ("file", MB),
read again and fitted. With --settled instead a calibration: drawn corners, highlights and limbs of photos by a camera
that moves and a lamp each, settled together. Each size is a process of its own, except with --quick. Times are a
processor's seconds, "peak" the process's largest resident memory. Last, the powers p of quantity ~ photos^p.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from photogonio.calib.adjust.alternate import settle
from photogonio.reconstruct.fit import PhotoErrors, fit_table
from photogonio.reconstruct.table.facet_table import add_tables
from photogonio.reconstruct.table.table_file import load_table, save_table
from photogonio.synthetic.brdf.library import make_brdf
from photogonio.system.memory import peak_megabytes
from tests.drawn.calibrations import Drawn
from tests.drawn.tables import Plan, simulate

VIEW_ERROR = 0.003
Made = TypeVar("Made")


def measure(photos: int, pixels: int) -> dict[str, float]:
    """Seconds, MB and cells of one size."""
    truth = make_brdf("oren-nayar", {"albedo": 0.6, "sigma": 0.5})
    whole = simulate(truth, Plan(views=photos, pixels=pixels, level=1))
    parts = [
        replace(one, groups=whole.groups[k : k + 1], group=0 * one.group, left_out=whole.left_out[k : k + 1])
        for k in range(photos)
        for one in [whole.take(np.arange(*np.searchsorted(whole.group, (k, k + 1))))]
    ]
    found = {"cells": float(len(whole))}
    del whole
    table, found["join"] = timed(lambda: add_tables(parts))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "table.npz"
        _, found["save"] = timed(lambda: save_table(table, path))
        found["file"] = path.stat().st_size / 1e6
        _, found["read"] = timed(lambda: load_table(path))
    found["peak"] = peak_megabytes()
    known = PhotoErrors(view_errors=np.full(photos, VIEW_ERROR))
    _, found["fit"] = timed(lambda: fit_table(table, known=known))
    return found | {"peak of all": peak_megabytes()}


def settled(photos: int, pixels: int) -> dict[str, float]:
    """Seconds and MB of a calibration."""
    state = Drawn(1, views=photos).watched()
    _, seconds = timed(lambda: settle(state))
    return {"settling": seconds, "peak": peak_megabytes()}


def timed(task: Callable[[], Made]) -> tuple[Made, float]:
    start = time.process_time()
    return task(), time.process_time() - start


def measure_apart(what: str, photos: int, pixels: int) -> dict[str, float]:
    """:func:`measure` or :func:`settled` in a process of its own."""
    words = ["--child", what, str(photos), "--pixels", str(pixels)]
    command = [sys.executable, "-m", "benchmarks.many_photos", *words]
    done = subprocess.run(command, check=True, capture_output=True, text=True, cwd=Path(__file__).parents[1])
    return json.loads(done.stdout)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few photos: shows that it runs")
    parser.add_argument("--photos", default="100,1000,10000")
    parser.add_argument("--pixels", type=int, default=150, help="of the sample in a photo")
    parser.add_argument("--settled", default="", metavar="PHOTOS", help="numbers of photos to be calibrated")
    parser.add_argument("--child", nargs=2, metavar=("WHAT", "PHOTOS"))
    asked = parser.parse_args(arguments)
    measures = {"tables": measure, "settled": settled}
    if asked.child:
        print(json.dumps(measures[asked.child[0]](int(asked.child[1]), asked.pixels)))
        return
    what = "settled" if asked.settled else "tables"
    sizes = [8, 16] if asked.quick else [int(n) for n in (asked.settled or asked.photos).split(",")]
    rows = []
    for photos in sizes:
        row = (
            measures[what](photos, asked.pixels) if asked.quick else measure_apart(what, photos, asked.pixels)
        )
        rows.append(row)
        print(
            f"{photos:7} photos  " + "  ".join(f"{name} {value:.4g}" for name, value in row.items()),
            flush=True,
        )
    for name in rows[0]:
        values = np.array([row[name] for row in rows])
        if len(rows) > 1 and (values > 0).all():
            print(f"{name:12} ~ photos^{np.polyfit(np.log(sizes), np.log(values), 1)[0]:.2f}")


if __name__ == "__main__":
    main()
