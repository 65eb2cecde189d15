"""Rules for the values of a TOML file, and the reader that applies a table of them.

A rule is a function ``(value, where) -> converted value`` that raises :class:`InputError` with the rule and
the offending value. It knows nothing of photo sets.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from photogonio.capture.errors import InputError

Rule = Callable[[object, str], Any]


@dataclass(frozen=True, slots=True)
class Key:
    """One key of a table: its rule, and whether it must be there."""

    rule: Rule
    required: bool = False


def read_table(table: object, keys: Mapping[str, Key], where: str) -> dict[str, Any]:
    """The converted values of a table's keys; unknown and missing ones are refused.

    ``where`` names the file and the table, such as ``set/photoset.toml: [sample]``.
    """
    of = where.removesuffix(":")  # of a file's own keys
    if not isinstance(table, dict):
        raise InputError(of, f"expected a table, found {shown(table)}")
    for name in table:
        if name not in keys:
            raise InputError(of, f"unknown key {name!r}{did_you_mean(name, keys)}")
    for name, key in keys.items():
        if key.required and name not in table:
            raise InputError(of, f"the key {name!r} is required")
    return {name: keys[name].rule(value, f"{where} {name}") for name, value in table.items()}


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """``; did you mean 'x'?`` where some known name is near, else the known names."""
    known = list(known)
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    return f"; did you mean {near[0]!r}?" if near else f"; known here: {', '.join(known)}"


def shown(value: object) -> str:
    """A value as one short piece of a message."""
    text = repr(value) if not isinstance(value, dict) else "a table"
    return text if len(text) <= 60 else text[:57] + "..."


def text(value: object, where: str) -> str:
    if not isinstance(value, str) or not value.strip():
        raise InputError(where, f"expected text, found {shown(value)}")
    return value


def boolean(value: object, where: str) -> bool:
    if not isinstance(value, bool):
        raise InputError(where, f"expected true or false, found {shown(value)}")
    return value


def choice(*options: str) -> Rule:
    def rule(value: object, where: str) -> str:
        if value not in options or not isinstance(value, str):
            expected = ", ".join(f'"{option}"' for option in options)
            hint = did_you_mean(value, options) if isinstance(value, str) else ""
            hint = hint if "did you mean" in hint else ""
            raise InputError(where, f"expected one of {expected}, found {shown(value)}{hint}")
        return value

    return rule


def number(
    *, above: float = -math.inf, low: float = -math.inf, high: float = math.inf, below: float = math.inf
) -> Rule:
    """A finite number in (above, below) and in [low, high]."""

    def rule(value: object, where: str) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise InputError(where, f"expected a number, found {shown(value)}")
        if not (math.isfinite(value) and above < value < below and low <= value <= high):
            raise InputError(where, f"expected {interval(above, low, high, below)}, found {shown(value)}")
        return float(value)

    return rule


def interval(above: float, low: float, high: float, below: float) -> str:
    bounds = [(above, "above"), (low, "of at least"), (high, "of at most"), (below, "below")]
    limits = " and ".join(f"{word} {bound:g}" for bound, word in bounds if math.isfinite(bound))
    return f"a finite number {limits}".rstrip()


def integer(*, low: int | None = None, high: int | None = None) -> Rule:
    def rule(value: object, where: str) -> int:
        if isinstance(value, bool) or not isinstance(value, int):
            raise InputError(where, f"expected a whole number, found {shown(value)}")
        if (low is not None and value < low) or (high is not None and value > high):
            limits = " and ".join(
                f"{word} {bound}"
                for word, bound in (("at least", low), ("at most", high))
                if bound is not None
            )
            raise InputError(where, f"expected a whole number of {limits}, found {value}")
        return value

    return rule


def listed(rule: Rule, *, least: int = 1, most: int | None = None) -> Rule:
    """A list of values that keep ``rule``, as a tuple."""

    def read(value: object, where: str) -> tuple[object, ...]:
        if not isinstance(value, list) or len(value) < least or (most is not None and len(value) > most):
            count = (
                str(least) if most == least else f"at least {least}" if most is None else f"{least} to {most}"
            )
            raise InputError(where, f"expected a list of {count} values, found {shown(value)}")
        return tuple(rule(item, f"{where}[{k}]") for k, item in enumerate(value))

    return read


def array(*shape: int | None) -> Rule:
    """Nested lists of finite numbers as a float array; ``None`` leaves a length open."""

    def rule(value: object, where: str) -> np.ndarray:
        result = _of_shape(value, shape)
        if result is None:
            wanted = " x ".join("n" if size is None else str(size) for size in shape)
            raise InputError(where, f"expected {wanted} finite numbers, found {shown(value)}")
        return result

    return rule


def _of_shape(value: object, shape: tuple[int | None, ...]) -> np.ndarray | None:
    if not numbers_only(value):
        return None
    try:
        result = np.array(value, float)
    except ValueError:  # ragged
        return None
    fits = result.ndim == len(shape) and all(
        n is None or n == m for n, m in zip(shape, result.shape, strict=True)
    )
    return result if fits and np.isfinite(result).all() else None


def numbers_only(value: object) -> bool:
    if isinstance(value, list):
        return all(type(item) is float or numbers_only(item) for item in value)
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def per_channel(*, above: float = 0.0, high: float = math.inf) -> Rule:
    """One number, or a list with one a channel; always a tuple."""
    one = number(above=above, high=high)

    def rule(value: object, where: str) -> tuple[float, ...]:
        return listed(one)(value, where) if isinstance(value, list) else (one(value, where),)

    return rule


def table(keys: Mapping[str, Key], build: Callable[[dict[str, Any], str], object]) -> Rule:
    """A sub-table, read by its keys and built by ``build(values, where)``."""
    return lambda value, where: build(read_table(value, keys, where), where)


def tables(keys: Mapping[str, Key], build: Callable[[dict[str, Any], str], object]) -> Rule:
    """An array of tables, as a tuple."""

    def rule(value: object, where: str) -> tuple[object, ...]:
        if not isinstance(value, list) or not value:
            raise InputError(where, f"expected tables in double brackets, found {shown(value)}")
        return tuple(table(keys, build)(item, f"{where}[{k}]") for k, item in enumerate(value))

    return rule
