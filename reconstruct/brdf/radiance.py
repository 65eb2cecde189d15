"""Radiance's BSDF XML, read: reflection at a surface's own front from tensor trees and full Klems matrices.

WINDOW's "front" is the outside, so that the surface's own front is "Reflection Back"; a file that has "Reflection
Front" alone is of a thing seen from there. docs/cli.md says what was tried.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.klems import PATCHES, patch_of
from photogonio.reconstruct.brdf.shirley_chiu import disk_to_square
from photogonio.reconstruct.modes.angles import spherical_angles

_LARGEST = 256 << 20  # bytes
_SIDES = ("Reflection Back", "Reflection Front")
_DEEPEST = 12


@dataclass(frozen=True, slots=True)
class Tree:
    """A tensor tree as flat arrays: a node is a leaf with a value, or points at its first child."""

    axes: int  # 3: isotropic; 4
    child: np.ndarray  # (n,) -1 for a leaf
    value: np.ndarray  # (n,) 1/sr

    def __call__(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        """f (n, 1), 1/sr, of unit vectors (n, 3): the cell's, as in Radiance."""
        place = self._places(np.asarray(incident, float), np.asarray(exit, float))
        node = np.zeros(len(place), int)
        for _ in range(_DEEPEST + 1):
            inner = self.child[node] >= 0
            if not inner.any():
                break
            bits = (place >= 0.5).astype(int)
            step = bits @ (1 << np.arange(self.axes))
            node = np.where(inner, self.child[node] + step, node)
            place = np.where(inner[:, None], 2 * place - bits, place)
        return np.where((incident[:, 2] > 0) & (exit[:, 2] > 0), self.value[node], 0.0)[:, None]

    def _places(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        (theta_i, phi_i), (theta_r, phi_r) = spherical_angles(incident), spherical_angles(exit)
        if self.axes == 4:
            first = disk_to_square(-incident[:, 0], -incident[:, 1])
            turn = phi_r
        else:
            first = (0.5 - 1e-6 - 0.5 * np.sin(theta_i),)  # the pole belongs to the half that is filled
            turn = phi_r - phi_i - np.pi
        second = disk_to_square(np.sin(theta_r) * np.cos(turn), np.sin(theta_r) * np.sin(turn))
        return np.clip(np.column_stack([*first, *second]), 0.0, 1.0 - 1e-12)


@dataclass(frozen=True, slots=True)
class Klems:
    """A full Klems matrix."""

    value: np.ndarray  # (145 exit, 145 incident) 1/sr

    def __call__(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        """f (n, 1), 1/sr, of unit vectors (n, 3): the patches', as in Radiance."""
        (theta_i, phi_i), (theta_r, phi_r) = spherical_angles(incident), spherical_angles(exit)
        f = self.value[patch_of(theta_r, phi_r), patch_of(theta_i, phi_i + np.pi)]
        return np.where((incident[:, 2] > 0) & (exit[:, 2] > 0), f, 0.0)[:, None]


@dataclass(frozen=True, slots=True)
class Radiance:
    """What the file says of the surface's front, gray."""

    evaluate: Tree | Klems
    isotropic: bool


def read_radiance(path: Path) -> Radiance:
    """The reflection of a BSDF XML.

    Raises:
        InputError: no such file, no XML, or neither a tensor tree nor a full Klems matrix of reflection.
    """
    root = _root(path)
    data = {
        d.findtext("WavelengthDataDirection", "").strip(): d
        for d in root.iter("WavelengthDataBlock")
        if _visible(root, d)
    }
    block = next((data[side] for side in _SIDES if side in data), None)
    if block is None:
        raise InputError(path, f"holds no reflection; expected a block of {' or '.join(_SIDES)}")
    text = block.findtext("ScatteringData") or ""
    structure = (root.findtext(".//IncidentDataStructure") or "").strip()
    if structure in ("TensorTree3", "TensorTree4"):
        axes = int(structure[-1])
        return Radiance(parse_tree(path, text, axes), axes == 3)
    basis = (block.findtext("ColumnAngleBasis") or "").strip()
    if structure == "Columns" and basis == "LBNL/Klems Full":
        return Radiance(_klems(path, text), False)
    raise InputError(
        path, f"has {structure or 'no structure'} {basis}; expected a tensor tree or LBNL/Klems Full"
    )


def _root(path: Path) -> ElementTree.Element:
    try:
        if path.stat().st_size > _LARGEST:
            raise InputError(path, f"is larger than {_LARGEST >> 20} MB")
        data = path.read_bytes()
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}") from None
    if b"<!ENTITY" in data:
        raise InputError(path, "declares XML entities, which no BSDF file needs")
    try:
        root = ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputError(path, f"is no XML: {error}") from None
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""
    if root.tag != "WindowElement":
        raise InputError(path, f"is {root.tag}, no WindowElement; expected a BSDF of Radiance or WINDOW")
    return root


def _visible(root: ElementTree.Element, block: ElementTree.Element) -> bool:
    """Whether the block is of visible light, not of solar or one of the colours."""
    for data in root.iter("WavelengthData"):
        if block in list(data):
            return (data.findtext("Wavelength") or "Visible").strip() == "Visible"
    return True


def parse_tree(path: Path, text: str, axes: int) -> Tree:
    """A tree's text: "{ v }" is a cell, "{ v v ... }" a block of 2^(axes k) cells, first axis slowest, "{ {} ... }"
    the halves along every axis, first axis fastest.

    Raises:
        InputError: braces or numbers that do not fit.
    """
    child: list[int] = [-1]
    value: list[float] = [0.0]
    tokens = re.findall(r"[{}]|[^\s{},]+", text)
    stack: list[tuple[int, int, list[float]]] = []  # node, children seen, numbers
    wrong = InputError(path, "its tensor tree is cut short or has numbers where none belong")

    def below(node: int) -> int:
        """The first of the node's children, made if there are none yet."""
        if child[node] < 0:
            child[node] = len(child)
            child.extend([-1] * 2**axes)
            value.extend([0.0] * 2**axes)
        return child[node]

    closed = False
    for token in tokens:
        if token == "{":
            if closed or len(stack) > _DEEPEST:
                raise wrong
            if not stack:
                stack.append((0, 0, []))
                continue
            node, seen, numbers = stack[-1]
            if numbers or seen >= 2**axes:
                raise wrong
            stack[-1] = (node, seen + 1, numbers)
            stack.append((below(node) + seen, 0, []))
        elif token == "}":
            if not stack:
                raise wrong
            node, seen, numbers = stack.pop()
            closed = not stack
            if (seen and (numbers or seen != 2**axes)) or not (seen or numbers):
                raise wrong
            if numbers:
                _spread(np.array(numbers), node, axes, below, value, wrong)
        else:
            try:
                stack[-1][2].append(float(token))
            except (ValueError, IndexError):
                raise wrong from None
    if not closed or not np.isfinite(value).all():
        raise wrong
    return Tree(axes, np.array(child), np.array(value))


def _spread(numbers: np.ndarray, node: int, axes: int, below, value: list[float], wrong: InputError) -> None:
    """A block of cells, put below its node."""
    side = round(len(numbers) ** (1 / axes))
    if side**axes != len(numbers) or side & (side - 1):
        raise wrong
    if side == 1:
        value[node] = float(numbers[0])
        return
    cube = numbers.reshape((side,) * axes)
    first = below(node)
    for k in range(2**axes):
        half = tuple(slice(side // 2 * (k >> a & 1), side // 2 * ((k >> a & 1) + 1)) for a in range(axes))
        _spread(cube[half].ravel(), first + k, axes, below, value, wrong)


def _klems(path: Path, text: str) -> Klems:
    try:
        numbers = np.array(text.replace(",", " ").split(), float)
    except ValueError:
        raise InputError(path, "has something that is no number among its scattering data") from None
    if numbers.size != PATCHES**2 or not np.isfinite(numbers).all():
        raise InputError(path, f"has {numbers.size} numbers; expected {PATCHES} x {PATCHES}")
    return Klems(numbers.reshape(PATCHES, PATCHES))
