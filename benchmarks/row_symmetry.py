"""How often the symmetry of measured rows is chosen wrongly, on rows drawn with the directions and noise of real ones.

Of each table named, such as the CUReT materials (Dana et al. 1999), a fit is taken for a true isotropic surface, and
its residuals over the noise that it tells for that of readings. Surfaces that turn are GGX of roughnesses in the ratio
1.5, bare or over a ground, at any azimuth, read in the same directions with the same noise over the mean::

    python -m benchmarks.row_symmetry TABLE_OR_FOLDER... [--sets N] [--first K] [--kind KIND] [--quick]

The cuts of :mod:`reconstruct.symmetry.row_turns` were set on sets 1000 to 1060. ``--quick`` takes two sets of each.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.symmetry_choice import Coated, Turned
from photogonio.reconstruct.estimate.weights import error_model
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.goniometer.told import Told
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.rows.noise_told import NoiseTold
from photogonio.reconstruct.rows.row_average import average_of
from photogonio.reconstruct.rows.row_models import ORDER
from photogonio.reconstruct.rows.row_noise import with_noise
from photogonio.reconstruct.symmetry.row_turns import judge_rows
from photogonio.reconstruct.symmetry.verdict import Verdict
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.reconstruct.table.goniometer_csv import samples_table
from photogonio.synthetic.brdf.library import make_brdf

SETS, QUICK = 100, 2
RATIO = 1.5
KINDS = ("isotropic", "anisotropic")
LEAST = 0.02  # of the mean: a fit is nowhere darker, taken for a surface


@dataclass(frozen=True, slots=True)
class Pattern:
    """A real table, as what others are drawn after."""

    cells: Cells
    said: np.ndarray  # (n, c) by a fit, 1/sr
    noise: NoiseTold
    off: np.ndarray  # (n,) residuals over their noise, of standard deviation 1


def pattern_of(file: Path) -> Pattern:
    cells = with_noise(cells_of(samples_table(read_samples(file, Told()))))
    average = average_of(cells, error_model(cells), ORDER)
    noise, said = average.fresh.noise, average.said
    off = ((cells.value - said) / noise.at(cells, said))[:, 0]
    return Pattern(cells, np.maximum(said, LEAST * said.mean()), noise, off / off.std())


def drawn(kind: str, seed: int, patterns: Sequence[Pattern]) -> Cells:
    """Rows of a surface of that kind."""
    rng = np.random.default_rng([seed, kind == "anisotropic"])
    like = patterns[rng.integers(len(patterns))]
    cells, value, noise = like.cells, like.said, like.noise
    if kind == "anisotropic":
        surface, incident = turning(rng), unit_vectors(cells.theta_i, cells.phi_i)
        value = surface(incident, unit_vectors(cells.theta_r, cells.phi_r))[:, :1]
        noise = replace(noise, constant=noise.constant * value.mean() / like.said.mean())
    off = rng.choice(like.off, size=value.shape)
    return replace(cells, value=value + noise.at(cells, value) * off, variance=np.zeros_like(value))


def turning(rng: np.random.Generator) -> Turned:
    """GGX of roughnesses in :data:`RATIO`, bare or over a ground."""
    mean, bare = float(rng.uniform(0.15, 0.4)), rng.uniform() < 0.5
    azimuth = float(rng.uniform(0.0, np.pi))
    f0 = float(rng.uniform(0.4, 0.95) if bare else rng.uniform(0.04, 0.08))
    along, across = mean * np.sqrt(RATIO), mean / np.sqrt(RATIO)
    coat = make_brdf("anisotropic-ggx", {"f0": (f0,), "roughness_x": along, "roughness_y": across})
    return Turned(Coated(coat, 0.0 if bare else float(rng.uniform(0.1, 0.6))), azimuth)


def verdict_on(cells: Cells) -> Verdict:
    rows = with_noise(cells)
    return judge_rows(rows, average_of(rows, error_model(rows), ORDER))[0]


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tables", nargs="+")
    parser.add_argument("--sets", type=int, default=SETS)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kind", choices=KINDS)
    parser.add_argument("--quick", action="store_true")
    asked = parser.parse_args(arguments)
    named = [Path(name) for name in asked.tables]
    files = [file for path in named for file in (sorted(path.glob("*.csv")) if path.is_dir() else [path])]
    patterns = [pattern_of(file) for file in files]
    sets = range(asked.first, asked.first + (QUICK if asked.quick else asked.sets))
    for kind in KINDS if asked.kind is None else (asked.kind,):
        wrong = 0
        for seed in sets:
            verdict = verdict_on(drawn(kind, seed, patterns))
            if (verdict.symmetry != "isotropic") != (kind == "anisotropic"):
                wrong += 1
                print(f"wrong: {kind} {seed}: {verdict.reason}", flush=True)
        print(f"{kind}: {wrong} of {len(sets)} wrong ({wrong / len(sets):.1%})", flush=True)


if __name__ == "__main__":
    main()
