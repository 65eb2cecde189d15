"""Every benchmark of speed and memory, one after another: the numbers of benchmarks/README.md.

    python -m benchmarks.all [--quick] [--only NAME,NAME]

A quarter of an hour on two idle cores. Each is a process of its own, and prints its own table; the times that each
took, and start-up, come last.
"""

from __future__ import annotations

import argparse
import platform
import subprocess
import sys
import time
from pathlib import Path

from benchmarks.evaluation import best_time
from photogonio.reconstruct.modes.parallel import cores

ROOT = Path(__file__).parents[1]
SCRIPTS: dict[str, tuple[str, ...]] = {
    "png": (),
    "kernel": (),
    "facet_lookup": (),
    "evaluation": (),
    "fit": (),
    "end_to_end": (),
    "whole": (),
    "growth": (),
}


def machine() -> str:
    """Processor, cores and memory, where the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        model = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
        memory = int(Path("/proc/meminfo").read_text().split()[1]) / 2**20
    except (OSError, StopIteration):
        return f"{platform.machine()}, {cores()} cores"
    return f"{model}, {cores()} cores, {memory:.0f} GB, Python {platform.python_version()}"


def run(name: str, words: list[str]) -> bool:
    """One script; its output goes straight on. False if it fails."""
    print(f"\n== {name} ==", flush=True)
    start = time.perf_counter()
    done = subprocess.run([sys.executable, "-m", f"benchmarks.{name}", *words], cwd=ROOT)
    print(f"({time.perf_counter() - start:.0f} s)", flush=True)
    return done.returncode == 0


def startup(*words: str) -> float:
    """Seconds of a command line, the best of five."""
    command = [sys.executable, "-m", "photogonio", *words]
    return best_time(lambda: subprocess.run(command, cwd=ROOT, capture_output=True), 5)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="small cases: shows that all run")
    parser.add_argument("--only", default=",".join(SCRIPTS), help="names, with commas between")
    options = parser.parse_args(arguments)
    print(machine())
    quick = ["--quick"] if options.quick else []
    well = [run(name, [*SCRIPTS[name], *quick]) for name in options.only.split(",")]
    print("\n== start-up ==")
    print(
        f"photogonio --help {startup('--help'):.2f} s, a wrong argument {startup('process', '--wrong'):.2f} s"
    )
    return 0 if all(well) else 1


if __name__ == "__main__":
    sys.exit(main())
