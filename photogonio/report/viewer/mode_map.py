"""The coefficients as a picture: a square a mode, by the functions of the incident and of the exit direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf

LEAST = 4  # modes; fewer are read in the table
GAP = 1.0  # squares between two blocks
TOLD = 300  # modes whose numbers the picture says; of more they would be most of the page


@dataclass(frozen=True, slots=True)
class Square:
    """One mode; places in squares from the upper left."""

    x: float
    y: float
    positive: bool
    depth: float  # 0 to 1: the square root of its size over the largest
    sure: bool  # further from 0 than a 95 % interval reaches
    said: str


@dataclass(frozen=True, slots=True)
class Block:
    """Modes that share an azimuthal order, or all of a basis that turns."""

    x: float
    side: float
    title: str


@dataclass(frozen=True, slots=True)
class ModeMap:
    width: float
    height: float
    blocks: Sequence[Block]
    squares: Sequence[Square]


def mode_map(brdf: Brdf) -> ModeMap | None:
    """The map of a BRDF's modes, means of its channels; None where the modes are too few for a picture."""
    if len(brdf.modes) < LEAST:
        return None
    value = brdf.coefficients.mean(1)
    # channels share their photos: their errors are taken to go together
    error = brdf.standard_errors.mean(1)
    depth = np.sqrt(np.abs(value) / max(np.abs(value).max(), np.finfo(float).tiny))
    blocks, places = (_by_order if brdf.symmetry == "isotropic" else _by_pair)(brdf.modes)
    letters = "n m l" if brdf.symmetry == "isotropic" else "n l n′ l′"
    squares = [
        Square(
            x,
            y,
            bool(value[k] >= 0.0),
            round(float(depth[k]), 3),
            bool(abs(value[k]) > 1.96 * error[k]),
            f"{letters} = {' '.join(str(int(n)) for n in brdf.modes[k])}: {value[k]:.5f} ± {error[k]:.5f}"
            if len(brdf.modes) <= TOLD
            else "",
        )
        for k, at in enumerate(places)
        for x, y in at
    ]
    return ModeMap(
        blocks[-1].x + blocks[-1].side, max(block.side for block in blocks), tuple(blocks), tuple(squares)
    )


_Places = list[list[tuple[float, float]]]


def _by_order(modes: np.ndarray) -> tuple[list[Block], _Places]:
    """A block for each l, its squares by n and m; a mode stands at (n, m) and (m, n), which are one function."""
    blocks, left = [], {}
    end = 0.0
    for l in np.unique(modes[:, 2]):
        side = float(1 + (modes[modes[:, 2] == l, :2].max() - l) // 2)
        left[int(l)] = end
        blocks.append(Block(end, side, f"l = {int(l)}"))
        end += side + GAP
    places = []
    for n, m, l in modes:
        a, b = float((n - l) // 2), float((m - l) // 2)
        places.append([(left[int(l)] + x, y) for x, y in dict.fromkeys(((a, b), (b, a)))])
    return blocks, places


def _by_pair(modes: np.ndarray) -> tuple[list[Block], _Places]:
    """One block, its squares by the two functions that a mode multiplies."""
    functions = sorted({(int(n), int(l)) for n, l in (*modes[:, :2], *modes[:, 2:])})
    rank = {one: float(k) for k, one in enumerate(functions)}
    places: _Places = []
    for n, l, m, k in modes:
        a, b = rank[int(n), int(l)], rank[int(m), int(k)]
        places.append(list(dict.fromkeys(((a, b), (b, a)))))
    return [Block(0.0, float(len(functions)), "incident by exit, (n, l) in order")], places
