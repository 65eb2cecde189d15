"""Tone curves that no file names, found from print alone: how far the light that they stand for is off.

Ten curves of phones' shapes; simulated readings of a board under a hand-held flash and a torch, eight-bit codes, with a
printed strip of greys and without it. Light is judged over two decades below three quarters of full scale, against
middle light::

    python -m benchmarks.tone_curves [--seeds 40 41 42] [--curves srgb ...] [--quick]
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np

from photogonio.calib.response.fit import fit_response
from tests.calib.response.phones import CURVES, Tone, photos

GREYS = (0.65, 0.4, 0.25, 0.15, 0.09, 0.06)  # of white paper
LIGHT = 0.75 * np.geomspace(0.01, 1.0, 60)  # of full scale
MIDDLE = 0.4
WIDE = 1.959964  # standard errors on either side


def judged(tone: Tone, seed: int, greys: tuple[float, ...], count: int) -> tuple[float, float, float]:
    """What is missed, as root of the mean square and at most, relative; share of the light that the stated 95 %
    interval holds."""
    curves = fit_response(photos(tone, seed=seed, greys=greys, count=count)).curves
    codes, middle = tone(LIGHT), tone(np.full_like(LIGHT, MIDDLE))
    off = np.abs(curves.log_light(codes, 0) - curves.log_light(middle, 0) - np.log(LIGHT / MIDDLE))
    held = off <= WIDE * curves.error_between(codes, middle, 0)
    return float(np.sqrt(np.mean(off**2))), float(off.max()), float(held.mean())


def lines(names: list[str], seeds: list[int], count: int) -> Iterator[str]:
    yield "| curve | without greys: rms, worst, held | with greys: rms, worst, held |"
    yield "|---|---|---|"
    every: list[list[np.ndarray]] = [[], []]
    for name in names:
        told = []
        for found, greys in zip(every, ((), GREYS), strict=True):
            found.append(np.array([judged(CURVES[name], seed, greys, count) for seed in seeds]))
            rms, worst, held = found[-1].mean(axis=0)
            told.append(f"{rms:.2%}, {worst:.2%}, {held:.0%}")
        yield f"| {name} | {told[0]} | {told[1]} |"
    for label, sets in zip(("without", "with"), (np.concatenate(one) for one in every), strict=True):
        within = (sets[:, :2] <= 0.01).sum(axis=0)
        yield f"{label} greys: within 1 % in {within[0]} (rms) and {within[1]} (everywhere) of {len(sets)}"


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[40, 41, 42])
    parser.add_argument("--curves", choices=sorted(CURVES), nargs="+", default=sorted(CURVES))
    parser.add_argument("--quick", action="store_true", help="one curve, one set, six photos")
    args = parser.parse_args(arguments)
    names, seeds = (["srgb"], [40]) if args.quick else (args.curves, args.seeds)
    for line in lines(names, seeds, 6 if args.quick else 10):
        print(line, flush=True)


if __name__ == "__main__":
    main()
