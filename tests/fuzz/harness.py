"""One input through one reader: it is read, or refused in one line; nothing else may happen, nor take long."""

from __future__ import annotations

import contextlib
import io
import random
import signal
import threading
import traceback
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from photogonio.capture.errors import InputError

LONGEST = 10  # seconds, of one input


@dataclass(frozen=True, slots=True)
class Target:
    """A reader, files that it reads, and the ways to make them wrong."""

    name: str
    file: str  # its name in the folder; "" : the input is no file
    make: Callable[[Path], list[Callable[[random.Random], bytes]]]  # in a folder that it may furnish
    read: Callable[[Path], object]
    share: int = 1  # of the inputs of a long run


class TooLong(Exception):
    """An input took longer than it may."""


@dataclass(slots=True)
class Fuzzed:
    """A target in its own folder; call it with a generator for one input."""

    target: Target
    folder: Path
    ways: list[Callable[[random.Random], bytes]]
    there: frozenset[str]
    accepted: int = 0
    refused: int = 0
    longest: int = LONGEST

    @classmethod
    def of(cls, target: Target, folder: Path, longest: int = LONGEST) -> Fuzzed:
        folder.mkdir(parents=True, exist_ok=True)
        ways = target.make(folder)
        (folder / target.file).write_bytes(b"") if target.file else None
        return cls(target, folder, ways, frozenset(_names(folder)), longest=longest)

    def __call__(self, rng: random.Random) -> str:
        """What is wrong with how one input was taken; empty: nothing."""
        content = rng.choice(self.ways)(rng)
        path = self.folder / self.target.file
        if self.target.file:
            path.write_bytes(content)
        else:
            path = Path(content.decode("utf-8", "surrogateescape"))
        try:
            with _limited(self.longest), _silent():
                self.target.read(path)
            self.accepted += 1
        except InputError as error:
            self.refused += 1
            if "\n" in str(error):
                return f"a message of several lines: {error}"
        except TooLong:
            return f"longer than {self.longest} s"
        except Exception:  # whatever else a reader raises is what is sought
            return traceback.format_exc(limit=-6)
        more = _names(self.folder) - self.there
        return f"files left: {sorted(more)}" if more else ""


def _names(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*")}


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        with contextlib.redirect_stderr(io.StringIO()):
            yield


@contextlib.contextmanager
def _limited(seconds: int) -> Iterator[None]:
    """Raises TooLong in the main thread of a system that has alarms."""
    if not hasattr(signal, "SIGALRM") or threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, frame: object) -> None:
        raise TooLong

    former = signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, former)
