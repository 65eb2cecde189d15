"""Which jobs use a store just now, so that none of them has its results thrown out.

A job leaves a file in the store, and touches another one every minute. What was used since the first of the live jobs
began is theirs. A job that was killed beats no more, and is soon taken for gone: nobody waits for anybody. Times are
those that the store's own file system gives, so that hosts whose clocks differ may share it.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from photogonio.system.outputs import part_name

FOLDER = "running"
BEAT = 60.0  # seconds
GONE = 10 * BEAT  # without a beat
BEGAN, ALIVE = ".began", ".alive"


@contextmanager
def job_in(folder: Path | None) -> Iterator[None]:
    """While the block runs, what is used of the store in ``folder`` stays there. Without effect where nothing can be
    written."""
    place = None if folder is None else _entered(folder / FOLDER / part_name("job"))
    if place is None:
        yield
        return
    ended, began = threading.Event(), _time_of(place.with_name(place.name + BEGAN))
    beating = threading.Thread(target=_beat, args=(place, began, ended), daemon=True)
    beating.start()
    try:
        yield
    finally:
        ended.set()
        _leave(place)


def used_since(folder: Path) -> float:
    """The time (seconds) since which what was used belongs to a live job; infinite if there is none. Files of jobs that
    are gone are taken away."""
    probe = folder / FOLDER / part_name("now")
    try:
        probe.touch()
        now = probe.stat().st_mtime
        probe.unlink(missing_ok=True)
        jobs = [path for path in probe.parent.iterdir() if path.name.endswith(BEGAN)]
    except OSError:
        return float("inf")
    return min((_began(path, now) for path in jobs), default=float("inf"))


def _began(path: Path, now: float) -> float:
    try:
        began = path.stat().st_mtime
        if now - _alive(path.with_suffix("")).stat().st_mtime <= GONE:
            return began
        _leave(path.with_suffix(""))
    except OSError:  # it ended just now, or could not leave both
        pass
    return float("inf")


def _entered(place: Path) -> Path | None:
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        _alive(place).touch()
        place.with_name(place.name + BEGAN).touch()
    except OSError:
        return None
    return place


def _beat(place: Path, began: float, ended: threading.Event) -> None:
    while not ended.wait(BEAT):
        _revive(place, began)


def _revive(place: Path, began: float) -> None:
    """A beat. Who slept so long that it was taken for gone comes back as it was."""
    try:
        _alive(place).touch()
        beginning = place.with_name(place.name + BEGAN)
        if not beginning.exists():
            beginning.touch()
            os.utime(beginning, (began, began))
    except OSError:  # the next beat may do
        return


def _time_of(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


def _leave(place: Path) -> None:
    for path in (place.with_name(place.name + BEGAN), _alive(place)):
        try:
            path.unlink(missing_ok=True)
        except OSError:
            continue


def _alive(place: Path) -> Path:
    return place.with_name(place.name + ALIVE)
