"""Hours of it:  python -m tests.fuzz --long N [--only NAME ...] [--seed S]

N inputs are shared out over all readers; each that is not read or refused in one line is printed with what reproduces
it, and the exit status is 1; so it is if the process ever took more memory than a reader may, or left a file where it
was called.
"""

from __future__ import annotations

import argparse
import os
import random
import sys
import tempfile
import time
from pathlib import Path

from photogonio.system.memory import peak_megabytes, reset_peak
from tests.fuzz.harness import Fuzzed
from tests.fuzz.targets import TARGETS

MOST_MEGABYTES = 2000  # at any time, libraries and all


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz")
    parser.add_argument("--long", type=int, metavar="N", default=10_000)
    parser.add_argument("--only", nargs="+", default=[], choices=[target.name for target in TARGETS])
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    os.environ["PHOTOGONIO_CACHE"] = ""
    chosen = [one for one in TARGETS if (one.name in args.only if args.only else one.share)]
    shares = sum(max(one.share, 1) for one in chosen)
    wrong, most = 0, 0.0
    before = set(os.listdir())
    with tempfile.TemporaryDirectory() as place:
        for target in chosen:
            fuzzed = Fuzzed.of(target, Path(place) / target.name)
            count, start, seen = args.long * max(target.share, 1) // shares, time.monotonic(), set()
            reset_peak()
            for k in range(count):
                seed = f"{args.seed} {target.name} {k}"
                fault = fuzzed(random.Random(seed))
                if fault.startswith("longer"):  # once, code may have been compiled for it
                    fault = fuzzed(random.Random(seed))
                if not fault:
                    continue
                wrong += 1
                last = tuple(fault.splitlines()[-3:])
                if last not in seen or fault.startswith("longer"):  # which have nothing in common
                    seen.add(last)
                    print(f"--- {target.name}, input {seed!r}:\n{fault}", flush=True)
            seconds = time.monotonic() - start
            read = f"{fuzzed.accepted} read, {fuzzed.refused} refused"
            most = max(most, peak_megabytes())
            memory = f"{peak_megabytes():.0f} MB at the most"
            print(f"{target.name}: {count} inputs, {read}, {seconds:.0f} s, {memory}", flush=True)
    left = sorted(set(os.listdir()) - before)
    print(
        f"{wrong} inputs went wrong; {most:.0f} MB at the most; files left here: {', '.join(left) or 'none'}"
    )
    return 1 if wrong or left or most > MOST_MEGABYTES else 0


if __name__ == "__main__":
    sys.exit(main())
