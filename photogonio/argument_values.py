"""What a word of the command line says: numbers, names, pairs. Imports nothing heavy."""

from __future__ import annotations

import argparse
import math


def executor(text: str) -> str:
    """ "local:N" or "dask://HOST:PORT"."""
    kind, _, rest = text.partition(":")
    host, _, port = rest.removeprefix("//").rpartition(":")
    if kind == "local" and rest.isdecimal() and int(rest) >= 1:
        return f"local:{int(rest)}"
    if kind == "dask" and rest.startswith("//") and host and port.isdecimal() and 0 < int(port) < 65536:
        return text
    raise argparse.ArgumentTypeError(f"expected local:N or dask://HOST:PORT, found {text!r}")


def positive(text: str) -> int:
    """A whole number of 1 or more."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"expected a whole number of 1 or more, got {text!r}")
    return int(text)


def auto_or_whole(text: str) -> int | str:
    """ "auto", or a whole number."""
    if text == "auto":
        return text
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"expected auto or a whole number, got {text!r}")
    return int(text)


def whole(text: str) -> int:
    """A whole number."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"expected a whole number, got {text!r}")
    return int(text)


def lobes(text: str) -> int | str:
    """How many lobes: "auto", "none", or a whole number."""
    return 0 if text == "none" else auto_or_whole(text)


def length(text: str) -> float:
    """A length above 0."""
    try:
        found = float(text)
    except ValueError:
        found = 0.0
    if not 0.0 < found < math.inf:
        raise argparse.ArgumentTypeError(f"expected a length above 0, got {text!r}")
    return found


def mask(text: str) -> float:
    """An angle in degrees, up to 90."""
    try:
        angle = float(text)
    except ValueError:
        angle = 0.0
    if not 0.0 < angle <= 90.0:
        raise argparse.ArgumentTypeError(f"expected an angle between 0 and 90 degrees, got {text!r}")
    return angle


def names(text: str) -> tuple[str, ...]:
    """Different names, with commas between."""
    found = tuple(name.strip() for name in text.split(","))
    if not all(found) or len(set(found)) != len(found):
        raise argparse.ArgumentTypeError(f"expected different names with commas between, got {text!r}")
    return found


def pairs(text: str) -> dict[str, str]:
    """NAME=VALUE, with commas between."""
    found: dict[str, str] = {}
    for part in text.split(","):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if not (name and equals and value) or name in found:
            raise argparse.ArgumentTypeError(f"expected NAME=VALUE, each name once, got {part!r}")
        found[name] = value
    return found
