"""Which photo sets a batch is of, and what each is called."""

from __future__ import annotations

import glob
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from photogonio.capture.errors import InputError
from photogonio.capture.photoset import MANIFEST


@dataclass(frozen=True, slots=True)
class SetPlace:
    """One photo set."""

    name: str  # of its result, a path without "..", unique in the batch
    folder: Path


def find_sets(given: Sequence[str]) -> list[SetPlace]:
    """The photo sets of folders and patterns, in the order of their names.

    A folder with a manifest is a set; any other stands for the sets below it.

    Raises:
        InputError: something given leads to no set.
    """
    found: dict[Path, None] = {}
    for word in given:
        matches = [Path(word)] if os.path.exists(word) else [Path(path) for path in sorted(glob.glob(word))]
        inside = [folder.resolve() for match in matches for folder in _below(match)]
        if not inside:
            raise InputError(
                word, f"leads to no photo set; expected folders with a {MANIFEST}, or above such"
            )
        found |= dict.fromkeys(inside)
    folders = sorted(found)
    common = Path(os.path.commonpath([folder.parent for folder in folders]))
    return [SetPlace(folder.relative_to(common).as_posix(), folder) for folder in folders]


def _below(folder: Path) -> list[Path]:
    if (folder / MANIFEST).is_file():
        return [folder]
    return sorted(path.parent for path in folder.rglob(MANIFEST)) if folder.is_dir() else []
