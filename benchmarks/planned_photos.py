"""Planned photos against random ones: the mean variance of f that each leaves, over small sets that are there already.

python -m benchmarks.planned_photos [--sets 20] [--quick]
"""

from __future__ import annotations

import argparse

import numpy as np

from photogonio.reconstruct.design.belief import Belief
from photogonio.reconstruct.design.materials import of_material
from photogonio.reconstruct.design.places import NEAREST, Feasible, best_photos, candidates
from photogonio.reconstruct.design.spots import Piece, Spot, Stance, apart

KINDS = ("matte", "satin", "plastic")
PIECES = {"flat": Piece(False, (35.0, 28.0)), "ball": Piece(True, (25.0, 25.0))}
BEGUN = 3  # photos of a set before any more are planned
COUNTS = (3, 8)
DRAWS = 5  # sets of random photos that one of planned photos is compared with
FEASIBLE = Feasible(600.0, 450.0)


def random_shot(rng: np.random.Generator) -> Stance:
    """Camera and lamp anywhere above the board, evenly over the sky from 15 and 8 degrees up."""
    while True:
        spots = [
            Spot(
                float(np.degrees(np.arcsin(rng.uniform(np.sin(np.radians(low)), 1.0)))),
                float(rng.uniform(-180, 180)),
                distance,
            )
            for low, distance in ((15.0, FEASIBLE.camera_distance), (8.0, FEASIBLE.lamp_distance))
        ]
        if apart(*spots) >= NEAREST:
            return Stance(*spots)


def left(belief: Belief, piece: Piece, shots: list[Stance]) -> list[float]:
    """The mean variance after each of the counts of photos."""
    found = []
    for k, shot in enumerate(shots):
        belief = belief.seen(piece.pairs(shot))
        if k + 1 in COUNTS:
            found.append(belief.mean_variance())
    return found


def main(sets: int) -> None:
    print(f"{'kind':8} {'sample':6} " + " ".join(f"after {n}: planned/random (worst)" for n in COUNTS))
    for shape, piece in PIECES.items():
        for kind in KINDS:
            start, ratios = of_material(kind), []
            shots = candidates(FEASIBLE, piece, turning=False)
            for number in range(sets):
                rng = np.random.default_rng([number, KINDS.index(kind)])
                begun = start
                for _ in range(BEGUN):
                    begun = begun.seen(piece.pairs(random_shot(rng)))
                steps = best_photos(begun, shots, piece.pairs, max(COUNTS))
                planned = [steps[n - 1].after for n in COUNTS]
                drawn = [
                    left(begun, piece, [random_shot(rng) for _ in range(max(COUNTS))]) for _ in range(DRAWS)
                ]
                ratios.append(np.array(planned) / np.mean(drawn, axis=0))
            found = np.array(ratios)
            print(f"{kind:8} {shape:6} " + " ".join(f"{np.median(r):.2f} ({r.max():.2f})" for r in found.T))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=20)
    parser.add_argument("--quick", action="store_true", help="one set")
    asked = parser.parse_args()
    main(1 if asked.quick else asked.sets)
