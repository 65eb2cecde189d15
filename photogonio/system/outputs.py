"""Outputs that appear whole or not at all: staged beside their place, then renamed."""

from __future__ import annotations

import errno
import json
import math
import os
import re
import secrets
import shutil
import socket
import tempfile
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

from photogonio.capture.errors import InputError


@contextmanager
def staged_folder(target: Path) -> Iterator[Path]:
    """A folder to write in that becomes ``target`` when the block ends well, and vanishes when it does not.

    A target that already holds files keeps those that the new ones do not replace.

    Raises:
        InputError: ``target`` is a file, or its place cannot be written.
    """
    check_place(target, folder=True)
    target = Path(os.path.realpath(target))  # a link's own place
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
    check_place(target, folder=False)
    target = Path(os.path.realpath(target))
    with _stage(target) as stage:
        yield stage
        os.replace(stage, target)


def staged(target: Path, *, folder: bool) -> AbstractContextManager[Path]:
    """:func:`staged_folder` or :func:`staged_file`."""
    return staged_folder(target) if folder else staged_file(target)


def part_name(name: str) -> str:
    """What a file or folder is called until it is whole: no other run has it, whether on this host or on another, dead
    or alive."""
    end = name.encode()[-80:].decode(errors="ignore")  # with the suffix
    return f".part-{_host()}-{os.getpid()}-{secrets.token_hex(4)}-{end}"


def _host() -> str:
    return re.sub(r"[^A-Za-z0-9-]", "-", socket.gethostname())[:32]


def remove_leftovers(folder: Path) -> None:
    """Take away what runs on this host that are dead, since they were killed, left unfinished below ``folder``."""
    name = re.compile(rf"\.part-{re.escape(_host())}-(\d+)-[0-9a-f]{{8}}-")
    for path in list(folder.rglob(".part-*")):
        found = name.match(path.name)
        if found is None or _is_alive(int(found[1])):
            continue
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


def _is_alive(process: int) -> bool:
    if os.name != "posix":  # there a signal of 0 ends a process
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        pass
    return True


def check_place(target: Path, *, folder: bool) -> None:
    """Whether ``target`` can be written, before the work is done that it is for.

    Raises:
        InputError: a file is in a folder's place or a folder in a file's, or its place cannot be written.
    """
    if folder and target.exists() and not target.is_dir():
        raise InputError(target, "is a file; expected a folder to write to")
    if not folder and target.is_dir():
        raise InputError(target, "is a folder; expected a file to write")
    if not folder and target.exists() and not target.is_file():  # a device would be replaced by a file
        raise InputError(target, "is no ordinary file; expected one to write")
    if os.path.islink(os.path.realpath(target)):
        raise InputError(target, "is a link that leads to itself")
    above = next((one for one in Path(os.path.realpath(target)).parents if one.exists()), None)
    if above is not None and not above.is_dir():
        raise InputError(target, "a part of this path is a file")
    if above is not None and not os.access(above, os.W_OK | os.X_OK):
        raise InputError(target, "cannot be written here: permission denied")
    for place in (above, target) if folder and target.is_dir() else (above,):
        try:  # of places that only pass for folders, or are there to be read
            with tempfile.TemporaryFile(dir=place):
                pass
        except OSError as error:
            why = (error.strerror or str(error)).lower()
            raise InputError(target, f"cannot be written here: {why}") from None


def check_result_place(target: Path) -> None:
    """:func:`check_place` of a folder of results, whose pictures must not come to lie among photos.

    Raises:
        InputError: it cannot be written, or is a photo set's own folder.
    """
    from photogonio.capture.photoset import MANIFEST  # with numpy, for which --help does not wait

    check_place(target, folder=True)
    if (target / MANIFEST).is_file():
        raise InputError(target, "is a photo set; results would lie among its photos: name another folder")


@contextmanager
def _stage(target: Path) -> Iterator[Path]:
    made = _make_parents(target)
    stage = target.with_name(part_name(target.name))
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
        try:
            os.rename(stage, target)
            return
        except OSError as error:
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                raise  # else another run was quicker
    sources = sorted(path for path in stage.rglob("*") if path.is_file())
    places = [target / source.relative_to(stage) for source in sources]
    for place in places:  # all of them before the first is written
        if place.is_dir():
            raise InputError(place, "is a folder; expected a file to write")
        between = [one for one in place.parents if one.is_relative_to(target) and one != target]
        for one in between:
            if one.exists() and not one.is_dir():
                raise InputError(one, "is a file; expected a folder to write to")
    for source, place in zip(sources, places, strict=True):
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


def line_json(value: object) -> str:
    """The same on one line."""
    return json.dumps(plain(value), allow_nan=False, ensure_ascii=False) + "\n"
