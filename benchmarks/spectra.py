"""Tables of many channels against the same with three: CPU time of ``fit``, and its peak memory.

    python -m benchmarks.spectra [--surfaces lambert ...] [--rows 1500] [--channels 31] [--turns 3] [--quick]

Rows are scattered up to 80 degrees, noise is 2 % of each; both sides take turns, and times are the processors' own.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from photogonio.synthetic.brdf.library import directions, make_brdf

FEW = 3  # channels of the other side, evenly taken
MOST = np.radians(80.0)
NOISE = 0.02


def spectrum(channels: int) -> np.ndarray:
    """(c,) albedos of something red."""
    return 0.15 + 0.5 / (1.0 + np.exp(-np.linspace(-5.0, 5.0, channels)))


def rows_of(surface: str, rows: int, channels: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Angles (n, 4), degrees, and noisy values (n, c)."""
    rng = np.random.default_rng(seed)
    theta = np.arccos(np.sqrt(rng.uniform(np.cos(MOST) ** 2, 1.0, (2, rows))))
    phi = rng.uniform(0.0, 2.0 * np.pi, (2, rows))
    where = [directions(*one) for one in zip(theta, phi, strict=True)]
    value = np.hstack([make_brdf(surface, {"albedo": (one,)})(*where) for one in spectrum(channels)])
    value *= 1.0 + NOISE * rng.normal(size=value.shape)
    return np.degrees([theta[0], phi[0], theta[1], phi[1]]).T, value


def written(path: Path, angles: np.ndarray, value: np.ndarray) -> Path:
    names = ["theta_i", "phi_i", "theta_r", "phi_r", *(f"value_{k}" for k in range(value.shape[1]))]
    text = ",".join(names)
    np.savetxt(path, np.hstack([angles, value]), fmt="%.6g", delimiter=",", header=text, comments="")
    return path


def fitted(table: Path) -> tuple[float, float]:
    """CPU seconds and peak megabytes of one ``fit``."""
    words = ["-m", "photogonio", "fit", str(table), "-o", str(table.with_suffix("")), "--quiet"]
    process = subprocess.Popen([sys.executable, *words], stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"fit of {table.name} failed")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--surfaces", nargs="+", default=["lambert", "oren-nayar", "satin-paint"])
    parser.add_argument("--rows", type=int, default=1500)
    parser.add_argument("--channels", type=int, default=31)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args(arguments)
    if options.quick:
        options.surfaces, options.rows, options.channels, options.turns = ["lambert"], 60, 7, 1
    for surface in options.surfaces:
        angles, value = rows_of(surface, options.rows, options.channels, options.seed)
        few = value[:, np.linspace(0, value.shape[1] - 1, FEW).round().astype(int)]
        with tempfile.TemporaryDirectory() as folder:
            many, three = (
                written(Path(folder, f"{name}.csv"), angles, one)
                for name, one in (("many", value), ("three", few))
            )
            if not options.quick:
                fitted(three)  # compiled code is loaded from files from here on
            turns = [(fitted(many), fitted(three)) for _ in range(options.turns)]
        ratio = statistics.median(one[0] / other[0] for one, other in turns)
        peaks = [max(turn[k][1] for turn in turns) for k in range(2)]
        seconds = [statistics.median(turn[k][0] for turn in turns) for k in range(2)]
        print(
            f"{surface}: {options.channels} channels over {FEW}: {ratio:.2f} times the CPU time "
            f"({seconds[0]:.1f} over {seconds[1]:.1f} s), peak {peaks[0]:.0f} and {peaks[1]:.0f} MB",
            flush=True,
        )


if __name__ == "__main__":
    main()
