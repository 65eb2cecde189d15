"""Random damages of a warm cache: every run must end well, and write the bytes that a run without any cache writes.

    python -m benchmarks.damaged_cache [--count 200] [--seed 1]

Every damage is of one file that is kept: bits flipped, bytes lost, added or overwritten, another entry's content, an
empty file, a folder, a link to nowhere or to itself in its place, or no right to read it. Prints a line for each that
goes wrong, and the count; exit status 1 if any does.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from photogonio.cache.store import VARIABLE
from photogonio.options import Options
from photogonio.pipeline import process
from photogonio.report import page
from tests.drawn.tiny_set import TinySet

COUNT, SEED = 200, 1
NAMES = ("coefficients.json", "setup.json", "table.npz", "report.html")
QUICK = Options(order=1, lobes=0, workers=1)


def flip(path: Path, rng: np.random.Generator) -> None:
    content = bytearray(path.read_bytes())
    for place in rng.integers(0, len(content), rng.integers(1, 4)):
        content[place] ^= 1 << int(rng.integers(8))
    path.write_bytes(content)


def cut(path: Path, rng: np.random.Generator) -> None:
    content = path.read_bytes()
    path.write_bytes(content[: rng.integers(len(content))])


def overwrite(path: Path, rng: np.random.Generator) -> None:
    content = bytearray(path.read_bytes())
    start = int(rng.integers(len(content)))
    stop = min(len(content), start + int(rng.integers(1, 4096)))
    content[start:stop] = bytes(stop - start) if rng.random() < 0.5 else rng.bytes(stop - start)
    content[-1] ^= 1  # never the same by chance
    path.write_bytes(content)


def lengthen(path: Path, rng: np.random.Generator) -> None:
    path.write_bytes(path.read_bytes() + rng.bytes(int(rng.integers(1, 100))))


def empty(path: Path, rng: np.random.Generator) -> None:
    path.write_bytes(b"")


def exchange(path: Path, rng: np.random.Generator) -> None:
    """The content of another entry."""
    others = [one for one in sorted(path.parents[1].glob("*/*")) if one.is_file() and one != path]
    path.write_bytes(others[rng.integers(len(others))].read_bytes())


def make_folder(path: Path, rng: np.random.Generator) -> None:
    path.unlink()
    path.mkdir()
    (path / "file").write_text("x")


def link_to_nowhere(path: Path, rng: np.random.Generator) -> None:
    path.unlink()
    path.symlink_to(path.parent / "nowhere")


def link_to_itself(path: Path, rng: np.random.Generator) -> None:
    path.unlink()
    path.symlink_to(path)


def lock(path: Path, rng: np.random.Generator) -> None:
    path.chmod(0)


def lose_folder(path: Path, rng: np.random.Generator) -> None:
    """A file where entries' folder was."""
    shutil.rmtree(path.parent)
    path.parent.write_text("x")


DAMAGES: tuple[Callable[[Path, np.random.Generator], None], ...] = (
    flip,
    cut,
    overwrite,
    lengthen,
    empty,
    exchange,
    make_folder,
    link_to_nowhere,
    link_to_itself,
    lock,
    lose_folder,
)


def damage(cache: Path, rng: np.random.Generator, which: int) -> str:
    """Damage one entry of a cache in the ``which``-th way; what was done."""
    found = sorted(path for path in cache.glob("*/*") if path.is_file() and not path.is_symlink())
    entries = [path for path in found if path.stat().st_size]
    path, way = entries[rng.integers(len(entries))], DAMAGES[which % len(DAMAGES)]
    way(path, rng)
    return f"{way.__name__} {path.name}"


def written(folder: Path, out: Path) -> dict[str, bytes]:
    """What ``process`` writes of a set, by name."""
    process(folder, out, QUICK)
    return {name: (out / name).read_bytes() for name in NAMES}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=COUNT)
    parser.add_argument("--seed", type=int, default=SEED)
    args = parser.parse_args()
    # pictures take most of a tiny set's time, and nothing of them is kept
    page.draw_pictures = lambda result, *, source: ()  # type: ignore[assignment]
    rng, wrong = np.random.default_rng(args.seed), 0
    with tempfile.TemporaryDirectory() as place:
        folder, cache = Path(place) / "tiny", Path(place) / "cache"
        TinySet(folder)
        os.environ[VARIABLE] = ""
        plain = written(folder, Path(place) / "plain")
        os.environ[VARIABLE] = str(cache)
        written(folder, Path(place) / "first")
        for k in range(args.count):
            what = damage(cache, rng, k)
            if k % 3 == 0:  # without the calibration what was seen in single photos is asked for
                for path in cache.glob("*/*.json"):
                    shutil.rmtree(path) if path.is_dir() else path.unlink()  # a folder, by the damage
            try:
                same = written(folder, Path(place) / "again") == plain
                fault = "" if same else "other bytes"
            except Exception as error:  # whatever a damaged cache leads to is counted
                fault = f"{type(error).__name__}: {error}"
            if fault:
                wrong += 1
                print(f"{what}: {fault}", flush=True)
    print(f"{args.count - wrong} of {args.count} damages: the same bytes as from nothing")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
