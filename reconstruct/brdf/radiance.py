"""Radiance's BSDF XML, read: reflection at a surface's own front from tensor trees and matrices.

WINDOW's "front" is the outside, so that the surface's own front is "Reflection Back"; a file that has "Reflection
Front" alone is of a thing seen from there. docs/cli.md says what was tried.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.capture.jit import jit
from photogonio.reconstruct.brdf.radiance_matrix import angle_bases, matrix_of, text_of
from photogonio.reconstruct.brdf.shirley_chiu import disk_to_square
from photogonio.reconstruct.modes.angles import spherical_angles

_LARGEST = 256 << 20  # bytes
_SIDES = ("Reflection Back", "Reflection Front")
_COLOURS = ("CIE-X", "CIE-Z", "CIE-u", "CIE-v")
_DEEPEST = 12

Evaluate = Callable[[np.ndarray, np.ndarray], np.ndarray]


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

    def albedo(self, incident: np.ndarray) -> np.ndarray:
        """(n, 1) directional albedo of light from unit vectors (n, 3): cells' areas are projected solid angles."""
        exit = np.broadcast_to([0.0, 0.0, 1.0], incident.shape)
        place = self._places(np.asarray(incident, float), exit)[:, : self.axes - 2]
        whose, node = np.arange(len(place)), np.zeros(len(place), int)
        sent, area = np.zeros(len(place)), np.pi
        steps = (1 << (self.axes - 2)) * np.arange(4)  # of a cell's parts, those of the two exit axes
        while len(node):
            leaf = self.child[node] < 0
            np.add.at(sent, whose[leaf], area * self.value[node[leaf]])
            bits = (place >= 0.5).astype(int)
            place, step = 2 * place - bits, bits @ (1 << np.arange(self.axes - 2))
            below = self.child[node[~leaf]] + step[whose[~leaf]]
            node, whose, area = (below[:, None] + steps).ravel(), np.repeat(whose[~leaf], 4), 0.25 * area
        return sent[:, None]

    def _places(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        (theta_i, phi_i), (theta_r, phi_r) = spherical_angles(incident), spherical_angles(exit)
        if self.axes == 4:
            first: tuple[np.ndarray, ...] = disk_to_square(-incident[:, 0], -incident[:, 1])
            turn = phi_r
        else:
            first = (0.5 - 1e-6 - 0.5 * np.sin(theta_i),)  # the pole belongs to the half that is filled
            turn = phi_r - phi_i - np.pi
        second = disk_to_square(np.sin(theta_r) * np.cos(turn), np.sin(theta_r) * np.sin(turn))
        return np.clip(np.column_stack([*first, *second]), 0.0, 1.0 - 1e-12)


@dataclass(frozen=True, slots=True)
class Radiance:
    """What the file says of the reflection of one side."""

    channels: tuple[str, ...]  # Y; X, Y, Z; or one a wavelength
    isotropic: bool
    evaluate: Evaluate  # incident, exit (n, 3) -> (n, c), 1/sr
    note: str  # what was read


def read_radiance(path: Path) -> Radiance:
    """The reflection of a BSDF XML.

    Raises:
        InputError: no such file, no XML, or neither a tensor tree nor a matrix of reflection.
    """
    root = _root(path)
    structure = (root.findtext(".//IncidentDataStructure") or "").strip()
    side, blocks = _blocks(path, root)
    tree = structure in ("TensorTree3", "TensorTree4")
    if not tree and structure not in ("Columns", "Rows"):
        raise InputError(
            path, f"has {structure or 'no structure'}; expected a tensor tree or a matrix (Columns, Rows)"
        )
    found: dict[str, Evaluate] = {}
    for name, block in blocks.items():
        if tree:
            found[name] = parse_tree(path, block.findtext("ScatteringData") or "", int(structure[-1]))
            continue
        try:
            found[name] = matrix_of(block, structure, angle_bases(root))
        except ValueError as error:
            raise InputError(path, f"its scattering data cannot be read ({error})") from None
    channels, evaluate = _coloured(found)
    return Radiance(
        channels, structure == "TensorTree3", evaluate, f"{side}, {structure}, {', '.join(blocks)}"
    )


def _blocks(path: Path, root: ElementTree.Element) -> tuple[str, dict[str, ElementTree.Element]]:
    """The side that is read, and its blocks by wavelength."""
    found: dict[str, dict[str, ElementTree.Element]] = {side: {} for side in _SIDES}
    for data in root.iter("WavelengthData"):
        for block in data.iter("WavelengthDataBlock"):
            side = text_of(block, "WavelengthDataDirection")
            if side in found:
                found[side].setdefault(text_of(data, "Wavelength") or "Visible", block)
    sides = [side for side in _SIDES if found[side]]
    if not sides:
        raise InputError(path, f"holds no reflection; expected a block of {' or '.join(_SIDES)}")
    taken = found[sides[0]]
    visible = {name: block for name, block in taken.items() if name in ("Visible", *_COLOURS)}
    return sides[0], visible if "Visible" in visible else taken


def _coloured(found: dict[str, Evaluate]) -> tuple[tuple[str, ...], Evaluate]:
    """Channels, and all of them at once: Y alone, X, Y and Z, or one a wavelength."""
    if "Visible" not in found:
        names = tuple(found)
        return names, lambda i, r: np.hstack([found[name](i, r) for name in names])
    if {"CIE-X", "CIE-Z"} <= set(found):
        order = ("CIE-X", "Visible", "CIE-Z")
        return ("X", "Y", "Z"), lambda i, r: np.hstack([found[name](i, r) for name in order])
    if {"CIE-u", "CIE-v"} <= set(found):
        return ("X", "Y", "Z"), lambda i, r: _from_uv(
            *(found[n](i, r) for n in ("Visible", "CIE-u", "CIE-v"))
        )
    return ("Y",), found["Visible"]


def _from_uv(y: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """X, Y, Z (n, 3) of luminance and CIE 1976 u', v', (n, 1) each."""
    v = np.maximum(v, 1e-6)
    return np.hstack([y * 9.0 * u / (4.0 * v), y, y * (12.0 - 3.0 * u - 20.0 * v) / (4.0 * v)])


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


def parse_tree(path: Path, text: str, axes: int) -> Tree:
    """A tree's text: "{ v }" is a cell, "{ v v ... }" a block of 2^(axes k) cells, first axis slowest, "{ {} ... }"
    the halves along every axis, first axis fastest.

    Raises:
        InputError: braces or numbers that do not fit.
    """
    quick = _quick(text, axes)
    if quick is not None:
        return quick
    child: list[int] = [-1]
    value: list[float] = [0.0]
    tokens = re.findall(r"[{}]|[^\s{},][^{}]*", text)
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
            if len(numbers) == 1:
                value[node] = numbers[0]
            elif numbers:
                _spread(np.array(numbers), node, axes, below, value, wrong)
        else:
            try:
                stack[-1][2].extend(map(float, token.replace(",", " ").split()))
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


def tree_text(child: np.ndarray, value: np.ndarray, axes: int) -> str:
    """A tree as text, depth first. Inverse of :func:`parse_tree`, to five digits.

    ``child`` (n,) says where a cell's parts begin, -1 of a leaf, whose ``value`` (n,), not negative, is told. The first
    of a tree of four axes is its root; the first four of one of three are the halves of the root that isotropic
    surfaces have, those along the first axis holding nothing.
    """
    length = 40 * len(value) + 64
    text = np.empty(length, np.uint8)
    used = _write(child, value, axes, _block_order(axes), text)
    return text[:used].tobytes().decode("ascii")


def _block_order(axes: int) -> np.ndarray:
    """(2^axes,) of a cell's halves, first axis fastest: their places in a block of them, last axis fastest."""
    bits = (np.arange(2**axes)[:, None] >> np.arange(axes)) & 1
    return bits @ 2 ** np.arange(axes)[::-1]


def _quick(text: str, axes: int) -> Tree | None:
    """A tree of leaves and of blocks of 2^axes of them, as ours are; None of any other."""
    try:
        data = text.encode("ascii")
    except UnicodeEncodeError:
        return None
    shape, leaves = np.frombuffer(data, np.uint8), np.empty(0)
    counts = np.empty(len(data), np.int32)
    tokens, nodes = _tokens(shape, counts, 2**axes)
    if tokens < 0:
        return None
    bare = data.translate(bytes.maketrans(b"{},", b"   "))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            leaves = np.fromstring(bare, sep=" ")
        except (ValueError, DeprecationWarning):
            return None
    child, value = np.full(nodes, -1), np.zeros(nodes)
    order = np.argsort(_block_order(axes))
    if not _build(counts[:tokens], leaves, 2**axes, order, child, value) or not np.isfinite(value).all():
        return None
    return Tree(axes, child, value)


_OPEN, _CLOSE = -1, -2


@jit
def _tokens(text, counts, parts):
    """Braces and how many numbers stand together, into ``counts``; how many such tokens, and nodes at most. -1 tokens
    where numbers stand together that are neither one nor ``parts``."""
    at, run, inside, nodes = 0, 0, False, 1
    for byte in text:
        brace = byte == 123 or byte == 125
        if brace or byte == 32 or byte == 44 or (9 <= byte <= 13):
            if inside:
                run += 1
            inside = False
            if brace:
                if run:
                    if run != 1 and run != parts:
                        return -1, 0
                    counts[at] = run
                    at += 1
                    nodes += run
                    run = 0
                counts[at] = -1 if byte == 123 else -2
                at += 1
                nodes += 1 if byte == 123 else 0
        else:
            inside = True
    if inside or run:
        return -1, 0
    return at, nodes + parts * (nodes // 2 + 1)


@jit
def _build(tokens, numbers, parts, order, child, value):
    """The nodes that tokens tell of; whether they are a tree."""
    node, seen = np.zeros(_DEEPEST + 3, np.int64), np.zeros(_DEEPEST + 3, np.int64)
    depth, made, taken = 0, 1, 0
    done = False
    for k in range(len(tokens)):
        token = tokens[k]
        if done:
            return False
        if token == _OPEN:
            if depth > _DEEPEST:
                return False
            if depth == 0:
                node[1], seen[1] = 0, 0
            else:
                above = node[depth]
                if seen[depth] >= parts:
                    return False
                if child[above] < 0:
                    if made + parts > len(child):
                        return False
                    child[above] = made
                    made += parts
                node[depth + 1], seen[depth + 1] = child[above] + seen[depth], 0
                seen[depth] += 1
            depth += 1
        elif token == _CLOSE:
            if depth == 0:
                return False
            if seen[depth] != parts and seen[depth] != -1:
                return False
            depth -= 1
            done = depth == 0
        else:
            if depth == 0 or seen[depth] != 0 or taken + token > len(numbers):
                return False
            seen[depth] = -1
            if token == 1:
                value[node[depth]] = numbers[taken]
            else:
                if made + parts > len(child):
                    return False
                child[node[depth]] = made
                for part in range(parts):
                    value[made + order[part]] = numbers[taken + part]
                made += parts
            taken += token
    return done and taken == len(numbers)


@jit
def _write(child, value, axes, order, text):
    """The text's length."""
    parts = 2**axes
    node, seen = np.zeros(64, np.int64), np.zeros(64, np.int64)
    at, depth = 0, 0
    block = np.empty(parts, np.int64)
    roots = 1
    if axes == 3:
        roots = 4
        text[at], text[at + 1] = 123, 10
        at += 2
    for root in range(roots):
        node[0], seen[0], depth = root, 0, 1
        while depth:
            one = node[depth - 1]
            first = child[one]
            if first >= 0 and seen[depth - 1] == 0:
                deeper = False
                for k in range(parts):
                    deeper = deeper or child[first + k] >= 0
                if deeper:
                    text[at], text[at + 1] = 123, 10
                    at += 2
            if first >= 0 and seen[depth - 1] < parts:
                deeper = False
                for k in range(parts):
                    deeper = deeper or child[first + k] >= 0
                if deeper:
                    node[depth], seen[depth] = first + seen[depth - 1], 0
                    seen[depth - 1] += 1
                    depth += 1
                    continue
                for k in range(parts):
                    block[order[k]] = first + k
                text[at] = 123
                at += 1
                for k in range(parts):
                    text[at] = 32
                    at = _number(value[block[k]], text, at + 1)
            elif first < 0:
                text[at], text[at + 1] = 123, 32
                at = _number(value[one], text, at + 2)
            text[at], text[at + 1], text[at + 2] = 32, 125, 10
            at += 3
            depth -= 1
        if axes == 3:
            for byte in (123, 32, 48, 32, 125, 10):
                text[at] = byte
                at += 1
    if axes == 3:
        text[at] = 125
        at += 1
    return at


@jit
def _number(value, text, at):
    """Five digits of a number that is not negative; where the text goes on."""
    if not value > 1e-300:
        text[at] = 48
        return at + 1
    power = int(np.floor(np.log10(value))) - 4
    digits = int(np.rint(value * 10.0**-power if power > -300 else value / 10.0**power))
    while digits >= 100000:
        digits = (digits + 5) // 10
        power += 1
    while digits % 10 == 0:
        digits //= 10
        power += 1
    count, rest = 0, digits
    while rest:
        rest //= 10
        count += 1
    if -count <= power < 0:  # a point among them or before them
        for k in range(count, 0, -1):
            if k == -power:
                text[at] = 46
                at += 1
            text[at] = 48 + digits // 10 ** (k - 1) % 10
            at += 1
        return at
    for k in range(count, 0, -1):
        text[at] = 48 + digits // 10 ** (k - 1) % 10
        at += 1
    if power:
        text[at] = 101
        at += 1
        if power < 0:
            text[at] = 45
            at += 1
            power = -power
        if power >= 100:
            text[at] = 48 + power // 100
            at += 1
        if power >= 10:
            text[at] = 48 + power // 10 % 10
            at += 1
        text[at] = 48 + power % 10
        at += 1
    return at
