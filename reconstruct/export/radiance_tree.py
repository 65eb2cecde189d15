"""Radiance's tensor tree: cells of incident and exit directions, finer where the BRDF bends.

Directions lie on the unit disk of (sin theta cos phi, sin theta sin phi), mapped on a square by Shirley and Chiu
(1997): equal areas are equal projected solid angles. An isotropic tree has three axes: (1 - sin theta_i) / 2, then the
exit direction's square, turned so that the incident azimuth is half a turn; an anisotropic one has four: the square of
the negated incident direction, then that of the exit direction. A node of text is "{ value }", or its halves along
every axis, the first axis fastest. Found to be so with Radiance's own library, which answers with the cell's value.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.shirley_chiu import disk_to_square, square_to_disk
from photogonio.reconstruct.export import radiance_xml as xml
from photogonio.reconstruct.export.loss import PLACE
from photogonio.reconstruct.export.table_grid import title

_DEEPEST = {3: 8, 4: 5}  # halvings of each axis, by number of axes
_PARTS = {3: 1, 4: 2}  # samples of each cell along each axis
_LEAVES = 240_000  # at most, which keeps a file below 4 MB and its reading fast
_SEEN, _BEYOND = float(np.sin(np.radians(82.0))), 0.05  # sine up to which errors count in full; beyond it
_ENOUGH = 1e-3  # relative rms within the cells, below which finer ones are not worth their bytes
_BASIS = "\t\t\t<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>"


@dataclass(frozen=True, slots=True)
class Level:
    """All cells of one fineness: means of f, and the squared deviation within each."""

    mean: np.ndarray  # (n, ...) 1/sr, an axis of 2^level for each of the tree's
    spread: np.ndarray  # (n, ...)


def write_radiance_tree(brdf: Brdf, path: Path) -> None:
    """Tensor tree of three axes for isotropic BRDFs, of four for others; gray, as :func:`.radiance_xml.gray` has it."""
    isotropic = not brdf.turning
    levels = _pyramid(*(_isotropic(brdf) if isotropic else _anisotropic(brdf)))
    axes = levels[0].spread.ndim
    path.write_text(
        xml.document(
            name=title(brdf),
            remark=PLACE,
            definition=f"\t\t<IncidentDataStructure>TensorTree{axes}</IncidentDataStructure>",
            basis=_BASIS,
            data=_text(levels, _threshold(levels)),
        ),
        encoding="utf-8",
    )


def _isotropic(brdf: Brdf) -> tuple[np.ndarray, np.ndarray]:
    """f, gray, at cells' centres (n / 2, n, n)and weights; the first axis's other half holds nothing."""
    n = 2 ** _DEEPEST[3]
    sine = 1 - 2 * (np.arange(n // 2) + 0.5) / n
    x, y = square_to_disk(*np.meshgrid(*[(np.arange(n) + 0.5) / n] * 2, indexing="ij"))
    # the mirror image of the exit direction about the plane of incidence has the same value
    upper = y.ravel() > 0
    theta_r, phi = np.arcsin(np.minimum(np.hypot(x, y).ravel()[upper], 1.0)), np.arctan2(y, x).ravel()[upper]
    value = np.zeros((n // 2, n * n), np.float32)
    mirrored = _mirror_of(x, y, n)
    for k, s in enumerate(sine):
        f = xml.gray(brdf, np.maximum(brdf.evaluate(np.arcsin(s), np.pi, theta_r, phi), 0.0))
        value[k, upper] = f
        value[k, mirrored[upper]] = f
    return _with_weight(value.reshape(n // 2, n, n), sine, np.hypot(x, y))


def _mirror_of(x: np.ndarray, y: np.ndarray, n: int) -> np.ndarray:
    """(n * n,) the cell that holds (x, -y), of each cell with centre (x, y)."""
    a, b = disk_to_square(x.ravel(), -y.ravel())
    i, j = (np.clip((side * n).astype(int), 0, n - 1) for side in (a, b))
    return i * n + j


def _anisotropic(brdf: Brdf) -> tuple[np.ndarray, np.ndarray]:
    """f, gray, (n, n, n, n), means of a few samples in each cell, and weights."""
    n = 2 ** _DEEPEST[4]
    m = n * _PARTS[4]
    x, y = square_to_disk(*np.meshgrid(*[(np.arange(m) + 0.5) / m] * 2, indexing="ij"))
    theta, phi = np.arcsin(np.minimum(np.hypot(x, y), 1.0)), np.arctan2(y, x)
    centre = square_to_disk(*np.meshgrid(*[(np.arange(n) + 0.5) / n] * 2, indexing="ij"))
    theta_i = np.arcsin(np.minimum(np.hypot(*centre), 1.0)).ravel()
    phi_i = np.arctan2(centre[1], centre[0]).ravel() + np.pi
    value = np.empty((n * n, n, n), np.float32)
    for k in range(n * n):
        f = xml.gray(brdf, np.maximum(brdf.evaluate(theta_i[k], phi_i[k], theta, phi), 0.0))
        value[k] = f.reshape(n, _PARTS[4], n, _PARTS[4]).mean(axis=(1, 3))
    return _with_weight(value.reshape(n, n, n, n), np.ones((n, n)), np.hypot(*centre))


def _pyramid(finest: np.ndarray, weight: np.ndarray) -> list[Level]:
    """From the coarsest cells, which halve the whole along every axis but may lack half of the first, to the finest.

    A node's spread is the weighted squared deviation of what it holds from its plain mean, which keeps the energy.
    """
    axes = finest.ndim
    mean, first, second = finest, weight * finest, weight * finest**2
    total = max(float(second.sum(dtype=float)), 1e-300)
    levels = [Level(mean, np.zeros(mean.shape))]
    while mean.shape[0] > 1:
        mean, first, second, weight = (_halved(a, axes) for a in (mean, first, second, weight))
        cells = 2.0 ** (axes * len(levels))
        spread = np.maximum(second - 2 * mean * first + mean**2 * weight, 0.0) * cells / total
        levels.insert(0, Level(mean, spread))
    return levels


def _with_weight(value: np.ndarray, sine_i: np.ndarray, sine_r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return value, _weight(value, sine_i, sine_r)


def _weight(value: np.ndarray, sine_i: np.ndarray, sine_r: np.ndarray) -> np.ndarray:
    """What a squared error counts: by projected solid angle, halfway to relative, little where nobody looks."""
    area = np.where(sine_i < _SEEN, 1.0, _BEYOND) * sine_i
    beyond = np.where(sine_r < _SEEN, 1.0, _BEYOND)
    mean = max(float(value.mean()), 1e-300)
    shape = area.reshape(*area.shape, *[1] * beyond.ndim)
    return (shape * beyond / (value + mean)).astype(np.float32)


def _halved(array: np.ndarray, axes: int) -> np.ndarray:
    """Means over pairs along the first ``axes`` axes."""
    for axis in range(axes):
        shape = (*array.shape[:axis], array.shape[axis] // 2, 2, *array.shape[axis + 1 :])
        array = array.reshape(shape).mean(axis=axis + 1)
    return array


def _threshold(levels: Sequence[Level]) -> float:
    """The spread up to which a node stays whole: the least that keeps to ``_LEAVES``, or that is good enough."""
    low, high = _ENOUGH**2 / _LEAVES, 1.0
    if _leaves(levels, low) <= _LEAVES:
        return low
    for _ in range(40):
        middle = np.sqrt(low * high)
        low, high = (low, middle) if _leaves(levels, middle) <= _LEAVES else (middle, high)
    return high


def _leaves(levels: Sequence[Level], least: float) -> int:
    """How many nodes stay whole: every one that is split has 2^axes halves, and spread only falls inward."""
    children = 2 ** levels[0].spread.ndim
    split = sum(int((level.spread > least).sum()) for level in levels[:-1])
    return levels[0].spread.size + (children - 1) * split


def _text(levels: Sequence[Level], least: float) -> str:
    """The tree, depth first."""
    axes = levels[0].spread.ndim
    bits = [tuple((k >> axis) & 1 for axis in range(axes)) for k in range(2**axes)]
    parts: list[str] = []

    def walk(depth: int, place: tuple[int, ...]) -> None:
        if depth == len(levels) - 1 or levels[depth].spread[place] <= least:
            parts.append(f"{{ {levels[depth].mean[place]:.5g} }}")
            return
        parts.append("{")
        for bit in bits:
            walk(depth + 1, tuple(2 * p + b for p, b in zip(place, bit, strict=True)))
        parts.append("}")

    whole = levels[0].spread.shape
    if whole == (1,) * axes:
        walk(0, (0,) * axes)
        return "\n".join(parts)
    parts.append("{")
    for bit in bits:
        if bit[0] < whole[0]:
            walk(0, bit)
        else:
            parts.append("{ 0 }")
    parts.append("}")
    return "\n".join(parts)
