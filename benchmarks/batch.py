"""Many small sets: ``batch`` with two workers against ``process`` of one after another.

    python -m benchmarks.batch [--quick] [--sets 200] [--chunk 20] [--workers 2] [--options "--order 0 --lobes none"]
    python -m benchmarks.batch --laws 60,250,1000 [--workers 2] [--options "--order 0 --lobes none --level 2"]

Drawn sets of 8 photos of 160 x 120 pixels, camera and lamps given, nothing kept between runs. Chunks of the sets take
turns, so that both sides meet the same load of the machine; "one start-up" is paid by ``batch`` once a chunk (0: all
sets are one chunk). Times are the clock's and the processor's of all processes. Coefficients and tables must be the
same bytes, else the exit status is 1. --laws does as many sets by ``batch`` alone, tells the time, the parent's largest
memory and the bytes written, and the powers p of each ~ sets^p.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from photogonio.cache.store import VARIABLE
from tests.drawn.tiny_set import TinySet, ball_photo, toward

ROOT = Path(__file__).parents[1]
MORE = ((30.0, 20.0), (65.0, 250.0))  # lamps beside the tiny set's six: theta, phi, degrees
FILES = ("coefficients.json", "table.npz")


def draw(folder: Path) -> None:
    """A set of eight photos."""
    made = TinySet(folder)
    for k, (theta, phi) in enumerate(MORE, len(made.photos)):
        direction = toward(theta, phi)
        made.write(f"sample/s{k}.png", ball_photo(direction) * 3.0)
        made.manifest += (
            f'\n[[light]]\nid = "L{k}"\nkind = "directional"\ndirection = {direction.tolist()}\n'
            f'[[photo]]\nfile = "sample/s{k}.png"\nrole = "sample"\nlight = "L{k}"\n'
        )
    made.save()


def took(commands: Sequence[Sequence[str]]) -> np.ndarray:
    """Seconds of the clock and of processors for commands one after another."""
    start, before = time.perf_counter(), os.times()
    for words in commands:
        subprocess.run(
            [sys.executable, "-m", "photogonio", *words, "--quiet"],
            check=False,  # a set may be not to be trusted
            cwd=ROOT,
            env=os.environ | {VARIABLE: ""},
        )
    after = os.times()
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return np.array([time.perf_counter() - start, used])


def compared(
    sets: Sequence[Path], made: Path, workers: int, options: Sequence[str]
) -> tuple[np.ndarray, int]:
    """Seconds (2, 2) of ``process`` and of ``batch``, and how many results differ."""
    alone = [
        ["process", str(one), "-o", str(made / "alone" / one.name), *options, "--workers", str(workers)]
        for one in sets
    ]
    words = ["batch", *map(str, sets), "-o", str(made / "batch"), "--executor", f"local:{workers}", *options]
    times = np.stack([took(alone), took([words])])
    different = sum(
        (made / "alone" / one.name / name).read_bytes() != (made / "batch" / one.name / name).read_bytes()
        for one in sets
        for name in FILES
    )
    return times, different


def grown(sets: Sequence[Path], out: Path, workers: int, options: Sequence[str]) -> dict[str, float]:
    """What a batch of so many sets costs."""
    words = ["batch", *map(str, sets), "-o", str(out), "--executor", f"local:{workers}", *options, "--quiet"]
    start, before, peak = time.perf_counter(), os.times(), 0.0
    process = subprocess.Popen(
        [sys.executable, "-m", "photogonio", *words], cwd=ROOT, env=os.environ | {VARIABLE: ""}
    )
    status = Path(f"/proc/{process.pid}/status")
    while process.poll() is None:
        lines = status.read_text().splitlines() if status.exists() else []
        peak = max([peak, *(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))])
        time.sleep(0.2)
    after = os.times()
    used = after.children_user + after.children_system - before.children_user - before.children_system
    written = sum(path.stat().st_size for path in out.rglob("*") if path.is_file()) / 1e6
    page = (out / "summary.html").stat().st_size / 1e6
    return {
        "s": time.perf_counter() - start,
        "s of processors": used,
        "MB of the parent": peak,
        "MB": written,
        "MB of page": page,
    }


def laws(sizes: Sequence[int], made: Path, workers: int, options: Sequence[str]) -> None:
    """A line for each number of sets, and the powers."""
    sets = [made / "archive" / f"set-{k:05}" for k in range(max(sizes))]
    for one in sets:
        draw(one)
    took([["process", str(sets[0]), "-o", str(made / "warm"), *options]])  # compiles
    rows = []
    for size in sizes:
        rows.append(grown(sets[:size], made / f"{size}", workers, options))
        print(
            f"{size:6} sets  " + "  ".join(f"{value:.4g} {name}" for name, value in rows[-1].items()),
            flush=True,
        )
    for name in rows[0] if len(rows) > 1 else ():
        power = np.polyfit(np.log(sizes), np.log([row[name] for row in rows]), 1)[0]
        print(f"{name:18} ~ sets^{power:.2f}")


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="two sets: shows that it runs")
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--chunk", type=int, default=20)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--options", default="", help="of process and batch")
    parser.add_argument("--laws", default="", metavar="SETS", help="numbers of sets, by batch alone")
    asked = parser.parse_args(arguments)
    if asked.laws:
        with tempfile.TemporaryDirectory() as folder:
            laws([int(n) for n in asked.laws.split(",")], Path(folder), asked.workers, asked.options.split())
        return 0
    if asked.quick:
        asked.sets, asked.options = 2, "--order 0 --lobes none --level 2"
    total, wrong = np.zeros((2, 2)), 0
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder)
        sets = [made / "archive" / f"set-{k:04}" for k in range(asked.sets)]
        for one in sets:
            draw(one)
        took([["process", str(sets[0]), "-o", str(made / "warm"), *asked.options.split()]])  # compiles
        size = asked.chunk or len(sets)
        for first in range(0, len(sets), size):
            chunk = sets[first : first + size]
            times, different = compared(chunk, made, asked.workers, asked.options.split())
            total, wrong = total + times, wrong + different
            (alone, busy), (batch, less) = total
            print(
                f"{first + len(chunk):5} sets  process {alone:7.1f} s ({busy:7.1f} of processors)  "
                f"batch {batch:7.1f} s ({less:7.1f})  x {alone / batch:.2f} ({busy / less:.2f})",
                flush=True,
            )
    print("same bytes" if not wrong else f"{wrong} files differ")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
