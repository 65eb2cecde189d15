"""``batch`` killed (-9) at random moments and run again: the bytes of one run that nobody disturbed.

    python -m benchmarks.killed_batch [--kills 20] [--sets 16] [--seed 1]

Each kill falls within the time that a set takes, a third of that before the first is begun or after it is done: so that
nearly all meet work under way, which is counted. Prints a line for each kill; after it, finished sets must be there
unchanged. Exit status 1 if anything differs.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from photogonio.batch.ledger import LEDGER, read_ledger
from photogonio.cache.store import VARIABLE
from tests.drawn.tiny_set import TinySet

ROOT = Path(__file__).parents[1]
QUICK = ("--order", "0", "--lobes", "none", "--level", "2", "--executor", "local:2", "--quiet")


def started(archive: Path, out: Path, cache: Path) -> subprocess.Popen[bytes]:
    words = [sys.executable, "-m", "photogonio", "batch", str(archive), "-o", str(out), *QUICK]
    environment = os.environ | {VARIABLE: str(cache)}
    return subprocess.Popen(words, cwd=ROOT, env=environment, start_new_session=True)


def undisturbed(archive: Path, out: Path, cache: Path) -> float:
    """Seconds of a run."""
    start = time.monotonic()
    started(archive, out, cache).wait()
    return time.monotonic() - start


def kill(process: subprocess.Popen[bytes]) -> None:
    """The whole of it, as a machine that is switched off."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    process.wait()


def contents(out: Path) -> dict[str, bytes]:
    """All that is no leftover of a kill."""
    files = [path for path in sorted(out.rglob("*")) if path.is_file()]
    return {
        str(path.relative_to(out)): path.read_bytes()
        for path in files
        if not any(part.startswith(".part-") for part in path.relative_to(out).parts)
    }


def times_of_finished(out: Path) -> dict[Path, int]:
    """When the files of sets that the ledger calls finished were written."""
    done = [name for name, entry in read_ledger(out / LEDGER).items() if entry.finished]
    return {path: path.stat().st_mtime_ns for name in done for path in (out / name).iterdir()}


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--sets", type=int, default=16)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    rng, wrong = np.random.default_rng(options.seed), 0
    with tempfile.TemporaryDirectory() as made:
        archive, out, plain = (Path(made) / name for name in ("archive", "killed", "plain"))
        for k in range(options.sets):
            TinySet(archive / f"set-{k}")
        started(
            archive, Path(made) / "warm", Path(made) / "cache-warm"
        ).wait()  # compiles: kills are to meet work
        # the second finds all done: what is left is start and end
        whole, idle = (undisturbed(archive, plain, Path(made) / "cache-plain") for _ in range(2))
        each, met = (whole - idle) / options.sets, 0
        print(f"undisturbed: {whole:.1f} s, {each:.1f} s a set", flush=True)
        for k in range(options.kills):
            before = times_of_finished(out)
            after = max(0.0, idle + each * float(rng.uniform(-1 / 3, 4 / 3)))
            process = started(archive, out, Path(made) / "cache")
            try:
                process.wait(after)
            except subprocess.TimeoutExpired:
                pass
            alive = process.poll() is None
            kill(process)
            under_way = (
                alive and sum(entry.finished for entry in read_ledger(out / LEDGER).values()) < options.sets
            )
            met += under_way
            now = times_of_finished(out)
            touched = [path for path in before if now.get(path) != before[path]]
            wrong += len(touched)
            print(
                f"kill {k} after {after:.1f} s{'' if under_way else ', all done'}: {len(before)} files before, "
                f"{len(touched)} touched",
                flush=True,
            )
        started(archive, out, Path(made) / "cache").wait()
        mine, theirs = contents(out), contents(plain)
        different = [name for name in sorted({*mine, *theirs}) if mine.get(name) != theirs.get(name)]
        leftovers = [path for path in out.rglob(".part-*")]
        print(
            f"{met} of {options.kills} kills met work under way; {len(theirs)} files, {len(different)} different, "
            f"{len(leftovers)} leftovers of kills",
            *different,
        )
    return int(wrong > 0 or bool(different))


if __name__ == "__main__":
    sys.exit(main())
