"""Which photo sets a batch is of, and what each is called."""

from __future__ import annotations

import glob
import os
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from photogonio.capture.errors import InputError
from photogonio.capture.photoset import MANIFEST


@dataclass(frozen=True, slots=True)
class SetPlace:
    """One photo set."""

    name: str  # of its result, a path without "..", unique in the batch
    folder: Path


def find_sets(given: Sequence[str], warn: Callable[[str], None] = lambda text: None) -> list[SetPlace]:
    """The photo sets of folders and patterns, in the order of their names.

    A folder stands for itself, if it has a manifest, and for the sets below it, also behind links; a set that several
    paths lead to counts once, by one without a link if there is such. Hidden folders are passed over, and so are those
    that cannot be read, of which ``warn`` is told.

    Raises:
        InputError: something given leads to no set.
    """
    found: dict[str, Path] = {}  # by where it is
    for links in (False, True):
        for word in given:
            matches = [word] if os.path.exists(word) else sorted(glob.glob(word, recursive=True))
            tell = warn if links else lambda text: None
            if matches == [word] and not os.path.isdir(word):
                raise InputError(word, f"is a file; expected folders with a {MANIFEST}, or above such")
            folders = [os.path.abspath(match) for match in matches if os.path.isdir(match)]
            inside = [one for folder in folders for one in _below(folder, links, tell)]
            if links and not inside:
                raise InputError(
                    word, f"leads to no photo set; expected folders with a {MANIFEST}, or above such"
                )
            for folder in inside:
                where = os.path.realpath(folder)
                if where not in found or folder == where:
                    found[where] = Path(folder)
    places = sorted(found.values())
    common = Path(os.path.commonpath([place.parent for place in places]))
    return [SetPlace(place.relative_to(common).as_posix(), place) for place in places]


def check_apart(places: Sequence[SetPlace], out: Path, files: Collection[str]) -> None:
    """Whether results can be written to ``out``, which has ``files`` of its own, without touching a set.

    Raises:
        InputError: a result, or what is told of all, would lie among photos; or a result has the name of one of the
            files.
    """
    sets = {os.path.realpath(place.folder) for place in places}
    if os.path.realpath(out) in sets:
        raise InputError(out, "is one of the photo sets; expected another folder")
    for place in places:
        if os.path.realpath(out / place.name) in sets:
            raise InputError(out, f"results of {place.name} would lie among photos; expected another folder")
        if place.name.partition("/")[0] in files:
            raise InputError(place.folder, f"is called as a file that {out} will have; rename it")


def _below(top: str, links: bool, warn: Callable[[str], None]) -> Iterator[str]:
    """Folders with a manifest from ``top`` on, through links or not, each once."""
    seen = set()

    def passed_over(error: OSError) -> None:
        warn(f"{error.filename}: passed over, {(error.strerror or 'cannot be read').lower()}")

    for folder, inside, files in os.walk(top, onerror=passed_over, followlinks=links):
        where = os.path.realpath(folder)
        inside[:] = [] if where in seen else sorted(name for name in inside if not name.startswith("."))
        if where not in seen and MANIFEST in files:
            yield folder
        seen.add(where)
