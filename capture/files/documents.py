"""TOML and JSON files that people write: text that is no such document, or cannot be meant, is refused in one line."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from photogonio.capture.errors import InputError

MOST_BYTES = 1 << 30
DEEPEST = 100  # tables in tables, lists in lists: no document of ours has a tenth of it
LARGEST = 2**63  # whole numbers beyond are taken for nothing but a slip


def read_toml(path: Path) -> dict[str, Any]:
    """A TOML document. Raises InputError naming the file, and the key where one is at fault."""
    return _read(path, "TOML", tomllib.loads)


def read_json(path: Path) -> Any:
    """A JSON document. Raises InputError naming the file, and the key where one is at fault."""
    return _read(path, "JSON", lambda text: json.loads(text, object_pairs_hook=_once_each))


def _once_each(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object whose keys are all different, as TOML's are; which of two is meant nobody knows."""
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"the key {twice!r:.60} is there twice")
    return found


def read_text(path: Path) -> str:
    """A file's UTF-8 text, without the mark that some editors put before it. Raises InputError."""
    if not path.exists():
        raise InputError(path, "no such file")
    if not path.is_file():
        raise InputError(path, "is no file")  # a pipe would be waited for without end
    try:
        if path.stat().st_size > MOST_BYTES:
            raise InputError(path, f"has more than {MOST_BYTES >> 30} GB")
        return path.read_text(encoding="utf-8").removeprefix("\ufeff")
    except UnicodeDecodeError as error:
        raise InputError(path, f"not UTF-8 text: {error.reason} at byte {error.start}") from error
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}") from error


def _read(path: Path, kind: str, parse: Callable[[str], Any]) -> Any:
    text = read_text(path)
    try:
        document = parse(text)
    except RecursionError:
        raise InputError(path, f"not valid {kind}: nested more than {DEEPEST} deep") from None
    except ValueError as error:
        raise InputError(path, f"not valid {kind}: {error}") from error
    _check(document, path, "", 0)
    return document


_NUMBERS = {int, float}  # truth values are others


def _plain(value: list[Any]) -> bool:
    """Whether all are numbers, none beyond :data:`LARGEST`: most lists are such, and long."""
    if not set(map(type, value)) <= _NUMBERS:
        return False
    return -LARGEST <= min(value, default=0) and max(value, default=0) < LARGEST


def _check(value: Any, path: Path, key: str, depth: int) -> None:
    if depth > DEEPEST:
        raise InputError(path, f"nested more than {DEEPEST} deep")
    if isinstance(value, dict):
        for name, item in value.items():
            _check(item, path, f"{key}.{name}" if key else str(name), depth + 1)
    elif isinstance(value, list):
        if depth < DEEPEST and _plain(value):
            return
        for k, item in enumerate(value):
            if not (depth + 1 < DEEPEST and type(item) is list and _plain(item)):
                _check(item, path, f"{key}[{k}]", depth + 1)
    elif isinstance(value, int) and not -LARGEST <= value < LARGEST:
        digits = len(str(abs(value))) if abs(value) < 10**4000 else "thousands of"
        raise InputError(f"{path}: {key}"[:200], f"a whole number of {digits} digits")
