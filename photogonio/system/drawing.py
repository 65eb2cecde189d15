"""What of matplotlib a program that draws does without, or otherwise than it is set up for people at a prompt."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from importlib import import_module

_WRITTEN = "_update_set_signature_and_docstring"


def without_docstrings() -> None:
    """Let matplotlib's classes of artists go without the signatures and docstrings of their ``set``.

    For each of some hundred classes it gathers them from the docstrings of all its setters: a third of its import.
    They are for people at a prompt. For programs that draw, before anything else of matplotlib is imported.
    """
    artist = import_module("matplotlib.artist").Artist
    if hasattr(artist, _WRITTEN):
        setattr(artist, _WRITTEN, classmethod(lambda cls: None))


@contextmanager
def own_style() -> Iterator[None]:
    """Whatever is drawn and written inside is so in matplotlib's own style, and not in that of a user's `matplotlibrc`
    or session: the same input gives the same bytes for all."""
    matplotlib = import_module("matplotlib")
    with matplotlib.rc_context(_style() | {"svg.hashsalt": "photogonio"}):
        yield


@lru_cache(maxsize=1)
def _style() -> dict[str, object]:
    default = import_module("matplotlib").rcParamsDefault
    return {name: value for name, value in dict(default).items() if name != "backend"}
