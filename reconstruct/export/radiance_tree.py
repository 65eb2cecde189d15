"""Radiance's tensor tree: cells of incident and exit directions, finer where the BRDF bends.

Directions lie on the unit disk of (sin theta cos phi, sin theta sin phi), mapped on a square by Shirley and Chiu
(1997): equal areas are equal projected solid angles. An isotropic tree has three axes: (1 - sin theta_i) / 2, then the
exit direction's square, turned so that the incident azimuth is half a turn; an anisotropic one has four: the square of
the negated incident direction, then that of the exit direction. A node of text is "{ value }", or its halves along
every axis, the first axis fastest; the last halves stand as "{ values }", the last axis fastest. Found to be so with
Radiance's own library, which answers with the cell's value.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.shirley_chiu import square_to_disk
from photogonio.reconstruct.export import radiance_xml as xml
from photogonio.reconstruct.export.loss import ANGLES, PLACE
from photogonio.reconstruct.export.radiance_cells import CellTree, Level, Values
from photogonio.reconstruct.export.table_grid import title

_BASE, _DEEPEST = (
    {3: 6, 4: 4},
    {3: 11, 4: 8},
)  # halvings of each axis everywhere, and at most, by number of axes
_LEAVES = {3: 500_000, 4: 300_000}  # at most, which keeps a file to 4 MB and its writing to 3 s
_COUNTS = ((61.0, 1.0), (82.0, 0.2), (90.0, 0.05))  # degrees up to which an error counts so much
_ENOUGH = 1e-3  # relative rms within the cells, below which finer ones are not worth their bytes
_FINE, _POLAR, _TURNS = (
    89,
    16,
    12,
)  # polar angles at which albedos are known; and of a surface whose turn counts
_BASIS = "\t\t\t<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>"


def write_radiance_tree(brdf: Brdf, path: Path) -> None:
    """Tensor tree of three axes for isotropic BRDFs, of four for others; gray, as :func:`.radiance_xml.gray` has it."""
    axes = 4 if brdf.turning else 3
    path.write_text(
        xml.document(
            name=title(brdf),
            remark=PLACE,
            definition=f"\t\t<IncidentDataStructure>TensorTree{axes}</IncidentDataStructure>",
            basis=_BASIS,
            data=_tree(brdf, axes),
        ),
        encoding="utf-8",
    )


def _tree(brdf: Brdf, axes: int) -> str:
    top = np.zeros((1, 4), int)
    if axes == 3:  # of the first axis the other half holds nothing
        top = np.array([[0, j, k] for k in (0, 1) for j in (0, 1)])
    start = Level.of(top, 4 - axes)
    base, deepest = min(_BASE[axes], _DEEPEST[axes] - 1), _DEEPEST[axes]
    cells = CellTree.of(_values(brdf, axes), _weight, axes - 2, start, base)
    bound = cells.grow(_LEAVES[axes], _ENOUGH, deepest)
    cells.hold(bound, _least_albedo(brdf, axes, deepest))
    return _text(cells, bound)


def _least_albedo(brdf: Brdf, axes: int, halvings: int) -> np.ndarray:
    """(2^halvings, ...) least directional albedo, gray, from within equal parts of the incident axes, up to where
    albedos are compared."""
    edge = np.linspace(0.0, 1.0, 2**halvings + 1)
    last = np.radians(ANGLES[-1])
    if axes == 3:
        polar = np.linspace(0.0, last, _FINE)
        theta = np.minimum(np.arcsin(np.clip(1 - 2 * edge, 0.0, 1.0)), last)
        albedo = np.interp(theta, polar, xml.gray(brdf, brdf.directional_albedo(polar)))
        return np.minimum(albedo[1:], albedo[:-1])
    x, y = square_to_disk(*np.meshgrid(edge, edge, indexing="ij"))
    polar, turn = last * np.sqrt(np.linspace(0.0, 1.0, _POLAR)), np.linspace(0.0, 2 * np.pi, _TURNS + 1)
    known = xml.gray(brdf, brdf.directional_albedo(polar[:, None], turn[:-1]))
    between = RegularGridInterpolator((polar, turn), np.hstack([known, known[:, :1]]))
    theta = np.minimum(np.arcsin(np.minimum(np.hypot(x, y), 1.0)), last)
    albedo = between(np.stack([theta, np.mod(np.arctan2(y, x) + np.pi, 2 * np.pi)], axis=-1))
    albedo = np.minimum(albedo[1:], albedo[:-1])
    return np.minimum(albedo[:, 1:], albedo[:, :-1])


def _values(brdf: Brdf, axes: int) -> Values:
    """f, gray, (n,) at places (n, axes)."""

    def values(place: np.ndarray) -> np.ndarray:
        x, y = square_to_disk(place[:, -2], place[:, -1])
        theta_r, phi_r = np.arcsin(np.minimum(np.hypot(x, y), 1.0)), np.arctan2(y, x)
        if axes == 3:
            theta_i, phi_i = np.arcsin(1 - 2 * place[:, 0]), np.full(len(place), np.pi)
        else:
            x, y = square_to_disk(place[:, 0], place[:, 1])
            theta_i, phi_i = np.arcsin(np.minimum(np.hypot(x, y), 1.0)), np.arctan2(y, x) + np.pi
        return xml.gray(brdf, np.maximum(brdf.evaluate(theta_i, phi_i, theta_r, phi_r), 0.0))

    return values


def _weight(place: np.ndarray) -> np.ndarray:
    """(n,) projected solid angle of a volume there, little where nobody looks."""
    sine_r = np.hypot(*square_to_disk(place[:, -2], place[:, -1]))
    if place.shape[1] == 3:
        sine_i = area = 1 - 2 * place[:, 0]
    else:
        sine_i, area = np.hypot(*square_to_disk(place[:, 0], place[:, 1])), np.ones(len(place))
    limits = np.sin(np.radians([limit for limit, _ in _COUNTS[:-1]]))
    counts = np.array([count for _, count in _COUNTS])
    return area * counts[np.searchsorted(limits, np.maximum(sine_i, sine_r))]


def _text(cells: CellTree, bound: float) -> str:
    """The tree, depth first."""
    axes = cells.levels[0].place.shape[1]
    bits = (np.arange(2**axes)[:, None] >> np.arange(axes)) & 1
    order = np.argsort(bits @ 2 ** np.arange(axes)[::-1]).tolist()  # of a block of values: last axis fastest
    divided = [cells.divided(level, bound).tolist() for level in cells.levels]
    first = [level.first.tolist() for level in cells.levels]
    told = [[f"{mean:.5g}" for mean in level.mean.tolist()] for level in cells.levels]
    parts: list[str] = []

    def walk(depth: int, cell: int) -> None:
        if not divided[depth][cell]:
            parts.append(f"{{ {told[depth][cell]} }}")
            return
        start = first[depth][cell]
        if not any(divided[depth + 1][start : start + 2**axes]):
            below = told[depth + 1]
            parts.append(f"{{ {' '.join([below[start + k] for k in order])} }}")
            return
        parts.append("{")
        for k in range(2**axes):
            walk(depth + 1, start + k)
        parts.append("}")

    if axes == 4:
        walk(0, 0)
        return "\n".join(parts)
    parts.append("{")
    for k in range(4):
        walk(0, k)
        parts.append("{ 0 }")
    parts.append("}")
    return "\n".join(parts)
