"""Valid files made wrong: by their bytes, and by what they say. Each mutation takes its choices from one generator."""

from __future__ import annotations

import io
import json
import math
import random
from collections.abc import Callable
from copy import deepcopy
from typing import Any

import numpy as np
import tomli_w

DEEP = 2000  # lists in lists
ODD_NUMBERS = (
    0,
    -1,
    1,
    2,
    3,
    4,
    90,
    91,
    360,
    1e-300,
    1e300,
    -1e300,
    2**31,
    2**63,
    10**4,
    10**18,
    10**400,
    0.5,
    -0.0,
)
ODD_VALUES: tuple[Any, ...] = (
    *ODD_NUMBERS,
    math.nan,
    math.inf,
    -math.inf,
    True,
    False,
    None,
    "",
    "x",
    "\0",
    "../../x",
    "/dev/zero",
    "ä" * 300,
    [],
    {},
    [[]],
    [None],
    [1, 2, 3],
    [[1, 2], [3]],
    {"x": 1},
)
MOST_MUTATIONS = 3


def of_bytes(content: bytes, rng: random.Random) -> bytes:
    """Bits flipped, pieces lost, doubled, moved, overwritten or put in."""
    content = bytearray(content)
    for _ in range(rng.randint(1, MOST_MUTATIONS)):
        place, length = rng.randrange(len(content) + 1), min(2 ** rng.randint(0, 10), len(content))
        piece = content[place : place + length]
        way = rng.randrange(7)
        if way == 0 and place < len(content):
            content[place] ^= 1 << rng.randrange(8)
        elif way == 1:
            del content[place : place + length]
        elif way == 2:
            content[place:place] = piece
        elif way == 3:
            other = rng.randrange(len(content) + 1)
            content[other : other + length] = piece
        elif way == 4:
            content[place : place + length] = rng.randbytes(len(piece))
        elif way == 5:
            content[place : place + length] = bytes([rng.choice((0, 255, 32, 48, 57))]) * len(piece)
        else:
            del content[place:]
    return bytes(content)


def of_lines(content: bytes, rng: random.Random) -> bytes:
    """Of text in rows and fields: rows lost, doubled and moved, fields exchanged for odd ones."""
    lines = content.decode("utf-8", "replace").splitlines()
    for _ in range(rng.randint(1, MOST_MUTATIONS)):
        k = rng.randrange(max(len(lines), 1))
        way = rng.randrange(6)
        if not lines:
            return b""
        if way == 0:
            del lines[k]
        elif way == 1:
            lines.insert(rng.randrange(len(lines) + 1), lines[k])
        elif way == 2:
            lines[k] = rng.choice(
                ("", "#", ",,,,", '"', "\t", lines[k] + ",1", lines[k][: len(lines[k]) // 2])
            )
        else:
            fields = lines[k].split(",")
            fields[rng.randrange(len(fields))] = str(rng.choice(ODD_VALUES)).replace("\n", " ")
            lines[k] = ",".join(fields)
    return ("\n".join(lines) + "\n").encode("utf-8", "replace")


def of_document(document: Any, rng: random.Random) -> Any:
    """A document of which some values are others, are lost, doubled, wrapped or buried deep."""
    document = json.loads(json.dumps(document))
    for _ in range(rng.randint(1, MOST_MUTATIONS)):
        places = list(_places(document))
        if not places:
            return document
        holder, key = places[rng.randrange(len(places))]
        way = rng.randrange(8)
        if way == 0:
            del holder[key]
        elif way == 1 and isinstance(holder, list):
            holder.append(holder[key])
        elif way == 1:
            holder[rng.choice(("x", "", "format", "version", key + "s"))] = holder[key]
        elif way == 2:
            holder[key] = [holder[key]]
        elif way == 3:
            other, name = places[rng.randrange(len(places))]
            holder[key] = json.loads(json.dumps(other[name]))
        elif way == 4 and isinstance(holder[key], int | float) and not isinstance(holder[key], bool):
            holder[key] = _scaled(holder[key], rng)
        else:
            holder[key] = deepcopy(rng.choice(ODD_VALUES))
    return document


def _scaled(value: float, rng: random.Random) -> float:
    factor = rng.choice((-1, 0, 2, 10, 1e3, 1e9, 1e-9))
    return value * factor if abs(value) < 1e200 else factor


def _places(value: Any):
    """(holder, key) of every value in a document."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield value, key
        yield from _places(item)


def as_json(document: Any, rng: random.Random) -> bytes:
    text = json.dumps(of_document(document, rng))
    if rng.random() < 0.02:
        text = text[:-1] + ', "deep": ' + "[" * DEEP + "]" * DEEP + text[-1:]
    return text.encode()


def as_toml(document: Any, rng: random.Random) -> bytes:
    changed = of_document(document, rng)
    if not isinstance(changed, dict):
        changed = {"x": 1}
    if rng.random() < 0.02:
        return (tomli_w.dumps(_sayable(changed)) + f"\ndeep = {'[' * DEEP}{']' * DEEP}\n").encode()
    return tomli_w.dumps(_sayable(changed)).encode("utf-8", "replace")


def _sayable(value: Any) -> Any:
    """Without null, which TOML has not."""
    if isinstance(value, dict):
        return {key: _sayable(item) for key, item in value.items() if item is not None}
    if isinstance(value, list):
        return [_sayable(item) for item in value if item is not None]
    return value


def as_npz(arrays: dict[str, np.ndarray], rng: random.Random) -> bytes:
    """An archive of which some arrays are others."""
    arrays = dict(arrays)
    for _ in range(rng.randint(1, MOST_MUTATIONS)):
        name = rng.choice(sorted(arrays))
        changed = _of_array(arrays[name], rng)
        if changed is None:
            arrays.pop(name)
        else:
            arrays[name] = changed
        if not arrays:
            break
    file = io.BytesIO()
    np.savez_compressed(file, **arrays)
    return file.getvalue()


def _of_array(array: np.ndarray, rng: random.Random) -> np.ndarray | None:
    ways: tuple[Callable[[], np.ndarray | None], ...] = (
        lambda: None,
        lambda: array[..., None],
        lambda: array[:0] if array.ndim else array[None],
        lambda: array.reshape(-1),
        lambda: array.T,
        lambda: array[1:] if array.ndim else array[None, None],
        lambda: np.array(rng.choice(ODD_NUMBERS[:-3]), float),
        lambda: (
            array.astype(rng.choice(("f4", "i8", "u1", "c16", "?"))) if array.dtype.kind in "fiub" else array
        ),
        lambda: np.array(["x"] * max(len(array), 1)) if array.ndim else np.array("{"),
        lambda: np.concatenate([array, array]) if array.ndim else array,
        lambda: (
            np.zeros((100_000, *array.shape[1:2]), array.dtype)
            if array.dtype.kind in "fiu" and array.size <= 100_000  # once: the same again has 10^10
            else array
        ),
        lambda: _with_odd(array, rng),
        lambda: _with_odd(array, rng),
        lambda: _with_odd(array, rng),
        lambda: _with_odd(array, rng),
    )
    try:
        with np.errstate(all="ignore"):
            return rng.choice(ways)()
    except (ValueError, TypeError, OverflowError):
        return array


def _with_odd(array: np.ndarray, rng: random.Random) -> np.ndarray:
    """One value, a row, a column or all of them odd."""
    if array.dtype.kind in "US":
        text = str(array) if array.ndim == 0 else ""
        if text.startswith("{"):
            return np.array(as_json(json.loads(text), rng).decode("utf-8", "replace"))
        return np.array(rng.choice(("", "x", "{}", "[1]")), array.dtype) if array.ndim == 0 else array[::-1]
    changed = array.copy()
    if not changed.size:
        return changed
    odd = rng.choice((math.nan, math.inf, -1, 0, 1e300, -1e300, 1e-300, 5, 2**31 - 1, -(2**31)))
    if changed.dtype.kind in "iub":
        odd = int(odd) if math.isfinite(odd) and abs(odd) < 2**31 else -1
    where: Any = tuple(rng.randrange(size) for size in changed.shape)
    where = rng.choice((where, where[:1], ..., where[:-1]))
    with np.errstate(all="ignore"):
        changed[where] = odd if changed.dtype.kind != "u" else abs(odd)
    return changed
