"""What matplotlib does as it is imported, as far as a program can do without it."""

from __future__ import annotations

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
