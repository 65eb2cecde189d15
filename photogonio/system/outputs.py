"""Outputs that appear whole or not at all: staged beside their place, then renamed."""

from __future__ import annotations

import json
import math
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from photogonio.capture.errors import InputError


@contextmanager
def staged_folder(target: Path) -> Iterator[Path]:
    """A folder to write in that becomes ``target`` when the block ends well, and vanishes when it does not.

    A target that already holds files keeps those that the new ones do not replace.

    Raises:
        InputError: ``target`` is a file, or its place cannot be written.
    """
    if target.exists() and not target.is_dir():
        raise InputError(target, "is a file; expected a folder to write to")
    with _stage(target) as stage:
        stage.mkdir()
        yield stage
        _publish_folder(stage, target)


@contextmanager
def staged_file(target: Path) -> Iterator[Path]:
    """A path to write to that becomes ``target`` when the block ends well. It keeps the suffix.

    Raises:
        InputError: ``target`` is a folder, or its place cannot be written.
    """
    if target.is_dir():
        raise InputError(target, "is a folder; expected a file to write")
    with _stage(target) as stage:
        yield stage
        os.replace(stage, target)


@contextmanager
def _stage(target: Path) -> Iterator[Path]:
    target = Path(os.path.abspath(target))
    made = _make_parents(target)
    stage = target.with_name(f".part-{os.getpid()}-{target.name}")
    try:
        yield stage
        made = []
    finally:
        if stage.is_dir():
            shutil.rmtree(stage)
        else:
            stage.unlink(missing_ok=True)
        for folder in made:
            folder.rmdir()


def _make_parents(target: Path) -> list[Path]:
    """Make the folders above ``target``; those made, innermost first."""
    missing = [folder for folder in target.parents if not folder.exists()]
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise InputError(target, "a part of this path is a file") from None
    except PermissionError:
        raise InputError(target, "cannot be written here: permission denied") from None
    if not os.access(target.parent, os.W_OK | os.X_OK):
        raise InputError(target, "cannot be written here: permission denied")
    return missing


def _publish_folder(stage: Path, target: Path) -> None:
    if not target.exists() or not any(target.iterdir()):
        os.rename(stage, target)
        return
    for source in sorted(path for path in stage.rglob("*") if path.is_file()):
        place = target / source.relative_to(stage)
        place.parent.mkdir(parents=True, exist_ok=True)
        os.replace(source, place)


def plain(value: object) -> object:
    """``value`` as plain JSON: arrays as lists, tuples as lists, non-finite numbers as None."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    return str(value)


def to_json(value: object) -> str:
    """Strict JSON text, keys in the order given."""
    return json.dumps(plain(value), indent=1, allow_nan=False, ensure_ascii=False) + "\n"
