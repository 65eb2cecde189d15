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
from photogonio.reconstruct.brdf.radiance import tree_text
from photogonio.reconstruct.brdf.shirley_chiu import square_to_disk
from photogonio.reconstruct.export import radiance_xml as xml
from photogonio.reconstruct.export.loss import ANGLES, PLACE
from photogonio.reconstruct.export.radiance_cells import CellTree, Level, Look
from photogonio.reconstruct.export.table_grid import title

_BASE, _DEEPEST = (
    {3: 6, 4: 4},
    {3: 11, 4: 9},
)  # halvings of each axis everywhere, and at most, by number of axes
_CLOSE = {3: 10, 4: 6}  # halvings about the mirror's direction and the light's own
_FEW, _MOST = 400_000, 2_000_000  # cells, of files of 3 and of 15 MB
_ENOUGH, _AT_MOST = 0.0015, 0.0085  # relative rms: worth so few cells, and so many
_MASKS = (61.0, 82.0)  # degrees below which errors count by f itself: cells across 60 and 80 are seen too
# what squared errors count: over f for the same incident direction, and below 60 and 80 degrees, where more may be lost
_SHARES = np.array([0.02, 1.0, 1.0 / 25.0])
_COUNTS = ((61.0, 1.0), (82.0, 0.6), (90.0, 0.4))  # degrees up to which the former counts so much
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
    cells = CellTree.of(tree_look(brdf, axes), _SHARES, axes - 2, start, base)
    cells.look_closely(_near_peaks, min(_CLOSE[axes], deepest))
    bound = cells.grow(_FEW, _ENOUGH, _MOST, _AT_MOST, deepest)
    cells.hold(bound, _least_albedo(brdf, axes, deepest))
    return tree_text(*cells.flat(bound), axes)


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


def _near_peaks(place: np.ndarray, halvings: int) -> np.ndarray:
    """(n,) whether cells touch the mirror's direction, or of an isotropic surface the light's own."""
    wide = 0.5**halvings
    centre = (place + 0.5) * wide
    exit = centre[:, -2:]
    if place.shape[1] == 4:
        apart = np.abs(exit - centre[:, :2])
        return np.maximum(apart[:, 0], apart[:, 1]) < 1.6 * wide
    aside = np.abs(exit[:, 1] - 0.5) < wide
    return aside & (np.abs(np.abs(exit[:, 0] - 0.5) - (0.5 - centre[:, 0])) < 2.1 * wide)


def tree_look(brdf: Brdf, axes: int) -> Look:
    """What cells are told by: see :class:`.radiance_cells.CellTree`."""
    masks = np.sin(np.radians(_MASKS))
    limits = np.sin(np.radians([limit for limit, _ in _COUNTS[:-1]]))
    counts = np.array([count for _, count in _COUNTS])

    def look(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x, y = square_to_disk(place[:, -2], place[:, -1])
        sine_r, phi_r = np.minimum(np.hypot(x, y), 1.0), np.arctan2(y, x)
        if axes == 3:
            sine_i = area = 1 - 2 * place[:, 0]
            phi_i = np.full(len(place), np.pi)
        else:
            x, y = square_to_disk(place[:, 0], place[:, 1])
            sine_i, phi_i = np.minimum(np.hypot(x, y), 1.0), np.arctan2(y, x) + np.pi
            area = np.ones(len(place))
        f = xml.gray(brdf, np.maximum(brdf.evaluate(np.arcsin(sine_i), phi_i, np.arcsin(sine_r), phi_r), 0.0))
        sine = np.maximum(sine_i, sine_r)
        weights = [area * counts[np.searchsorted(limits, sine)]]
        weights += [area * (sine < mask) for mask in masks]
        return f, np.column_stack(weights)

    return look
