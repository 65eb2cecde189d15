"""Direction to facet: against a tree over the barycentres for speed, against every facet in turn for truth.

    python -m benchmarks.facet_lookup [--quick] [--level L]

The tree finds the nearest barycentre, which is not always that of the facet that holds the direction; the share of
directions where it is another is shown.
"""

from __future__ import annotations

import argparse
from functools import partial

import numba
import numpy as np
from scipy.spatial import cKDTree

from benchmarks.evaluation import best_time
from photogonio.reconstruct.modes.parallel import cores, over_rows
from photogonio.reconstruct.table.facets import barycentres, facet_index, vertices


def random_directions(count: int, seed: int = 0) -> np.ndarray:
    """(count, 3) unit vectors, even over the hemisphere."""
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    vectors[:, 2] = np.abs(vectors[:, 2])
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors


@numba.njit(nogil=True, cache=True)
def _every_facet(directions, normals, index):
    """The facet on whose three edges' inner sides a direction lies; of several or none, the one least outside."""
    for k in range(len(directions)):
        x, y, z = directions[k]
        best, deepest = -1, -np.inf
        for f in range(len(normals)):
            n = normals[f]
            margin = n[0, 0] * x + n[0, 1] * y + n[0, 2] * z
            if margin > deepest:
                margin = min(margin, n[1, 0] * x + n[1, 1] * y + n[1, 2] * z)
                if margin > deepest:
                    margin = min(margin, n[2, 0] * x + n[2, 1] * y + n[2, 2] * z)
                    if margin > deepest:
                        best, deepest = f, margin
                        if margin > 0.0:
                            break
        index[k] = best


def brute_force(directions: np.ndarray, level: int) -> np.ndarray:
    """(n,) facet of each direction (n, 3), by trying all facets of ``level``."""
    corners = vertices(level)
    normals = np.cross(corners, np.roll(corners, -1, axis=1))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    index = np.empty(len(directions), np.int32)
    over_rows(
        lambda start, stop: _every_facet(directions[start:stop], normals, index[start:stop]), len(index)
    )
    return index


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--quick", action="store_true", help="few directions: shows that it runs, not how fast"
    )
    parser.add_argument("--level", type=int, default=4)
    options = parser.parse_args(arguments)
    count, repeats = (20_000, 1) if options.quick else (10_000_000, 3)
    directions = random_directions(count)
    tree = cKDTree(barycentres(options.level))
    some = directions[: max(count // 10, 1)]
    print(f"level {options.level}, {count} random directions; nanoseconds each")
    for threads in dict.fromkeys((1, cores())):
        ours = best_time(partial(facet_index, directions, options.level, threads=threads), repeats) / count
        theirs = best_time(partial(tree.query, some, workers=threads), repeats) / len(some)
        print(
            f"  {threads} threads: {1e9 * ours:7.1f}, cKDTree {1e9 * theirs:7.1f}, ratio {theirs / ours:.1f}"
        )
    found = facet_index(directions, options.level)
    nearest = tree.query(some, workers=-1)[1]
    print(f"  nearest barycentre is another facet's: {np.mean(nearest != found[: len(some)]):.1%}")
    mismatches = int((found != brute_force(directions, options.level)).sum())
    print(f"  mismatches against every facet in turn: {mismatches} of {count}")


if __name__ == "__main__":
    main()
