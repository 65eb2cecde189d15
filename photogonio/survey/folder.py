"""The photos of a folder that may have no manifest yet, as they are or as they arrive."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from photogonio.capture.errors import InputError
from photogonio.capture.files.formats import PROMISED, by_name
from photogonio.capture.manifest.draft import of_result, role_of
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.photoset import MANIFEST, Photo, PhotoSet

POLL = 0.25  # seconds between looks at a folder that is watched
SETTLED = 0.5  # seconds for which a file must not have changed, to be whole


@dataclass(frozen=True, slots=True)
class SetFolder:
    """A folder, and its manifest if there is one."""

    path: Path
    photoset: PhotoSet | None

    @classmethod
    def of(cls, folder: str | Path) -> SetFolder:
        """Raises InputError if there is no such folder, or if its manifest cannot be used."""
        path = Path(folder)
        if path.name == MANIFEST and path.is_file():
            path = path.parent
        if not path.is_dir():
            raise InputError(path, "no such folder")
        photoset = load_photoset(path, unnamed=True) if (path / MANIFEST).is_file() else None
        return cls(path, photoset)

    def photos(self) -> list[Photo]:
        """Those that the manifest names, else all there are, in order of their paths.

        Raises InputError if there is none."""
        if self.photoset is not None and self.photoset.photos:
            return list(self.photoset.photos)
        found = [self.photo(name) for name in self.names()]
        if not found:
            raise InputError(self.path, f"no photo here ({PROMISED})")
        return found

    def names(self) -> list[str]:
        """Files that are photos by their names, by path."""
        found = []
        for path in sorted(self.path.rglob("*")):
            inner = path.relative_to(self.path)
            hidden = any(part.startswith(".") for part in inner.parts)
            if not hidden and by_name(path) is not None and path.is_file() and not of_result(path):
                found.append(inner.as_posix())
        return found

    def photo(self, name: str) -> Photo:
        """As the manifest has it; else with the role of its name."""
        known = () if self.photoset is None else self.photoset.photos
        return next((p for p in known if p.file == name), Photo(name, role_of(name)))

    def arriving(
        self,
        stop: Callable[[], bool] = lambda: False,
        clock: Callable[[], float] = time.monotonic,
        again: Callable[[str], bool] = lambda name: False,
    ) -> Iterator[Photo]:
        """Photos as they are there and whole, each once, or once more if it changes and ``again`` wants that of its
        name; it ends when ``stop`` says so."""
        given: dict[str, tuple[int, int]] = {}
        state: dict[str, tuple[tuple[int, int], float]] = {}
        first = True
        while True:
            ready = []
            for name in self.names():
                try:
                    stat = (self.path / name).stat()
                except OSError:
                    continue
                now, seen = clock(), (stat.st_size, stat.st_mtime_ns)
                if name in given and (given[name] == seen or not again(name)):
                    continue
                old = first and time.time() - stat.st_mtime > SETTLED
                if old and stat.st_size:
                    ready.append((name, seen))
                elif state.get(name, (None, 0.0))[0] != seen:
                    state[name] = seen, now
                elif now - state[name][1] >= SETTLED and stat.st_size:
                    ready.append((name, seen))
            first = False
            for name, seen in ready:
                given[name] = seen
                yield self.photo(name)
            if stop():
                return
            if not ready:
                time.sleep(POLL)
