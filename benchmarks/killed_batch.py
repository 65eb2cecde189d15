"""``batch`` killed (-9) at random moments and run again: the bytes of one run that nobody disturbed.

    python -m benchmarks.killed_batch [--kills 20] [--sets 24] [--seed 1]

All sets differ. A kill falls at a random moment within the time of one set and a half, counted from where the run kept
the first it had worked out, which is well within its first set; every fifth within start-up. Counted are the kills when
sets were under way. Prints a line for each kill; after it, finished sets must be there unchanged. Exit status 1 if
anything differs.
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
from tests.drawn.tiny_set import LIGHTS, TinySet, ball_photo, toward

ROOT = Path(__file__).parents[1]
QUICK = ("--order", "0", "--lobes", "none", "--level", "2", "--executor", "local:2", "--quiet")


def draw(folder: Path, number: int) -> None:
    """A set like no other."""
    made = TinySet(folder)
    for name, light in zip(made.photos, LIGHTS, strict=True):
        made.write(name, ball_photo(toward(*light)) * (3.0 - 0.05 * number))


def started(archive: Path, out: Path, cache: Path) -> subprocess.Popen[bytes]:
    words = [sys.executable, "-m", "photogonio", "batch", str(archive), "-o", str(out), *QUICK]
    environment = os.environ | {VARIABLE: str(cache)}
    return subprocess.Popen(words, cwd=ROOT, env=environment, start_new_session=True)


def traces(out: Path, cache: Path) -> set[str]:
    """What a run leaves while it works: what it keeps, and what it is writing."""
    return {str(path) for path in (*cache.rglob("*.table"), *cache.rglob("*.json"), *out.rglob(".part-*"))}


def until_work(process: subprocess.Popen[bytes], out: Path, cache: Path, before: set[str]) -> bool:
    """Waits until there are traces of work that were not there before; False if it ends without."""
    while process.poll() is None:
        if traces(out, cache) - before:
            return True
        time.sleep(0.05)
    return False


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
    parser.add_argument("--sets", type=int, default=24)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    rng, wrong = np.random.default_rng(options.seed), 0
    with tempfile.TemporaryDirectory() as made:
        archive, out, plain = (Path(made) / name for name in ("archive", "killed", "plain"))
        cache = Path(made) / "cache"
        for k in range(options.sets):
            draw(archive / f"set-{k}", k)
        started(
            archive, Path(made) / "warm", Path(made) / "cache-warm"
        ).wait()  # compiles: kills are to meet work
        process, start = started(archive, plain, Path(made) / "cache-plain"), time.monotonic()
        until_work(process, plain, Path(made) / "cache-plain", set())
        begun = time.monotonic()
        process.wait()
        whole, first = time.monotonic() - start, begun - start
        each, met = (whole - first) / options.sets, 0
        print(f"undisturbed: {whole:.1f} s, {first:.1f} s until work is seen, {each:.1f} s a set", flush=True)
        for k in range(options.kills):
            before, known = times_of_finished(out), traces(out, cache)
            process = started(archive, out, cache)
            if k % 5 == 4:
                after, working = float(rng.uniform(0.0, first)), False
                time.sleep(after)
            else:
                working, after = until_work(process, out, cache, known), float(rng.uniform(0.0, 1.5 * each))
                time.sleep(after if working else 0.0)
            finished = sum(entry.finished for entry in read_ledger(out / LEDGER).values())
            under_way = working and process.poll() is None and finished < options.sets
            kill(process)
            met += under_way
            now = times_of_finished(out)
            touched = [path for path in before if now.get(path) != before[path]]
            wrong += len(touched)
            when = f"{after:.1f} s {'into work' if working else 'into start-up'}"
            print(
                f"kill {k} {when}: {finished} sets done, {len(before)} files before, {len(touched)} touched",
                flush=True,
            )
        started(archive, out, cache).wait()
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
