"""Photos reduced on other machines, through dask.distributed.

A worker reads a photo where it lies, if it finds the same bytes there; else the photo is sent to it. Few photos are
under way at a time, so that neither the scheduler nor this process holds more than those. A worker that dies has its
photos done again by others; where nobody is left to do one, it is done here.
"""

from __future__ import annotations

import errno
import logging
import pickle
import socket
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, TypeGuard

import numpy as np

from photogonio.cache.kept import code_key
from photogonio.calib.remarks import LeftOut
from photogonio.calib.setup import ViewSetup
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import read_image
from photogonio.capture.photoset import View
from photogonio.run.one_photo import PhotoTable, Work, seen_in
from photogonio.run.task_queue import MOST, TaskQueue
from photogonio.system.memory import keep_freed
from photogonio.system.provenance import hash_file

if TYPE_CHECKING:
    from distributed import Client

REACHED = 8.0  # seconds in which a scheduler must take a connection, and greet
NEAR = (
    2.0  # seconds in which a worker must take a connection, else what it found comes by way of the scheduler
)
COMING = 30.0  # seconds in which the first worker must come, or another when all are gone
ASKED = 1.0  # seconds until the scheduler is asked again how many workers there are, which takes 3 ms
SENT = 4 << 20  # bytes of photos in a task, unless one has more
ABREAST = 2  # tasks under way for each thread of a worker: one is done, one waits there


@dataclass(frozen=True, slots=True)
class FileMark:
    """What a file is known by: it is the same where size and time are; else where its bytes are."""

    size: int
    changed: int  # nanoseconds
    digest: str  # SHA-256; empty: not known

    @classmethod
    def of(cls, path: Path, digest: str = "") -> FileMark:
        """Raises OSError if there is none."""
        stat = path.stat()
        return cls(stat.st_size, stat.st_mtime_ns, digest)

    def fits(self, path: Path) -> bool:
        """Whether a file here is the same."""
        try:
            found = FileMark.of(path)
            if found.size != self.size:
                return False
            return found.changed == self.changed or hash_file(path) == self.digest
        except OSError:
            return False


@dataclass(frozen=True, slots=True)
class Ask:
    """One photo to be reduced."""

    view: ViewSetup
    photo: View
    files: Mapping[str, FileMark]
    sent: Mapping[str, bytes] = field(default_factory=dict)  # files that the worker cannot read


@dataclass(frozen=True, slots=True)
class Lacking:
    """The worker does not find the photo's files."""


@dataclass(frozen=True, slots=True)
class Foreign:
    """The worker is of another version."""

    worker: str


Answer = PhotoTable | LeftOut | Lacking | Foreign


class Cluster:
    """Workers of a scheduler that all have this version of the program."""

    def __init__(self, client: Client, name: str):
        self.client, self.name = client, name
        self.sending = False  # some worker could not read a file: all photos are sent
        self.sent = 0  # bytes of photos
        self.near = dict[str, bool]()  # by address: whether a worker takes connections from here
        self.made_ready = self._readied(self._of_same_version())

    def answers(
        self, work: Work, asks: Sequence[Ask], here: Callable[[Ask], PhotoTable | LeftOut]
    ) -> Iterator[tuple[int, PhotoTable | LeftOut]]:
        """What each photo gave, with its number, as they are done; ``here`` does those that no worker could.

        Raises:
            InputError: a worker came that is of another version.
        """
        queue, waiting = TaskQueue(len(asks)), dict[Future[np.ndarray], list[int]]()
        pool, shared = self.client.get_executor(pure=False), self._shared(work)
        threads, asked = 0, -ASKED
        try:
            while queue.left or waiting:
                if not threads or time.monotonic() - asked > ASKED:
                    threads, asked = self._threads(), time.monotonic()
                while queue.left and len(waiting) < ABREAST * threads:
                    numbers = queue.task(ABREAST * threads, self._most(asks[queue.left[-1]]))
                    filled = [self._filled(work, asks[number]) for number in numbers]
                    waiting[pool.submit(answers_of, code_key(), shared, filled)] = numbers
                done, _ = wait(waiting, COMING, FIRST_COMPLETED)
                if not done and not self._threads():  # all are gone, and none came
                    break
                for future in done:
                    numbers = waiting.pop(future)
                    found = queue.found(future, numbers)
                    if found is None and len(numbers) == 1:
                        yield numbers[0], here(asks[numbers[0]])
                    for number, answer in zip(numbers, found or (), strict=False):
                        if self._is_final(answer):
                            yield number, answer
                        else:
                            queue.left.append(number)
        finally:
            for future in waiting:
                future.cancel()
        left = sorted([*queue.left, *(number for numbers in waiting.values() for number in numbers)])
        yield from ((number, here(asks[number])) for number in left)

    def _is_final(self, answer: Answer) -> TypeGuard[PhotoTable | LeftOut]:
        """Whether it is; else the photo must be sent.

        Raises:
            InputError: a worker came that is of another version.
        """
        if isinstance(answer, Foreign):
            raise InputError(self.name, _told_foreign([answer.worker]))
        self.sending = self.sending or isinstance(answer, Lacking)
        return not isinstance(answer, Lacking)

    def _most(self, ask: Ask) -> int:
        """Photos that may go in one task: where they are sent, the scheduler holds them all."""
        size = sum(mark.size for mark in ask.files.values()) if self.sending else 0
        return max(1, SENT // max(1, size)) if size else MOST

    def _filled(self, work: Work, ask: Ask) -> Ask:
        """With the photo's files, where workers cannot read them."""
        if not self.sending:
            return ask
        files = {name: (work.reader.photoset.folder / name).read_bytes() for name in ask.files}
        self.sent += sum(map(len, files.values()))
        return replace(ask, sent=files)

    def _shared(self, work: Work) -> object:
        """``work`` on the cluster, which makes it anew where it was lost."""
        reader = replace(work.reader, decode=read_image)
        reader = replace(reader, photoset=replace(reader.photoset, folder=reader.photoset.folder.resolve()))
        bare = replace(work, reader=reader, setup=replace(work.setup, views=(), boards=()), threads=1)
        with warnings.catch_warnings():  # of more than 10 MB: it goes once to each worker
            warnings.filterwarnings("ignore", "Sending large graph")
            return self.client.submit(opened, code_key(), pickle.dumps(bare), pure=False)

    def _threads(self) -> int:
        """Of all workers; none where the scheduler is gone."""
        try:
            found = self.client.nthreads() if self.client.status == "running" else {}
        except (OSError, TimeoutError):
            return 0
        self._come_near(found)
        return sum(found.values())

    def _come_near(self, workers: Iterable[str]) -> None:
        """Tables come straight from workers, if all take connections from here: else the scheduler would have to
        receive each and send it on."""
        self.near = {at: self.near[at] if at in self.near else _takes_connections(at) for at in workers}
        self.client.direct_to_workers = all(self.near.values())

    def _readied(self, workers: Iterable[str]) -> list[object]:
        """Workers load what photos are reduced with, while this process still looks at them."""
        return [self.client.submit(as_a_program, workers=[at], pure=False) for at in workers]

    def _of_same_version(self) -> list[str]:
        """Addresses of the workers.

        Raises:
            InputError: there is none, or one of another version.
        """
        from distributed import TimeoutError as NoWorker

        try:
            self.client.wait_for_workers(1, COMING)
        except (NoWorker, TimeoutError):
            raise InputError(self.name, f"has no worker, and none came in {COMING:.0f} s") from None
        names = {
            address: told["name"]
            for address, told in self.client.scheduler_info(n_workers=-1)["workers"].items()
        }
        found = self.client.run(code_key, on_error="return")
        others = [f"{names.get(at, at)} ({at})" for at, key in sorted(found.items()) if key != code_key()]
        if others:
            raise InputError(self.name, _told_foreign(others))
        return sorted(found)


def _takes_connections(address: str) -> bool:
    """Whether a worker at ``tcp://HOST:PORT`` can be reached from here."""
    host, _, port = address.rpartition("://")[2].rpartition(":")
    try:
        with socket.create_connection((host.strip("[]"), int(port)), NEAR):
            return True
    except (OSError, ValueError):
        return False


def _told_foreign(workers: Sequence[str]) -> str:
    return (
        f"worker {', '.join(workers)} is of another version of photogonio or of its libraries, or has none; "
        "install the same there"
    )


def opened(code: str, packed: bytes) -> Work | None:
    """On a worker: what the photos of a set share; None if its version is another."""
    if code != code_key():
        return None
    return pickle.loads(packed)


@lru_cache(maxsize=1)
def as_a_program() -> None:
    """What the command line does as it starts, once in each worker: it may have from another what photos share."""
    keep_freed()


def answers_of(code: str, work: Work | None, asks: Sequence[Ask]) -> np.ndarray:
    """On a worker: what photos give, and the processor's seconds that it took, pickled into one array of bytes: the
    network's messages have a price for each array, and copy what is no array once more."""
    as_a_program()
    start = time.thread_time()
    found = [answer(code, work, ask) for ask in asks]
    return np.frombuffer(pickle.dumps((found, time.thread_time() - start), 5), np.uint8)


def answer(code: str, work: Work | None, ask: Ask) -> Answer:
    """On a worker: what a photo gives. A photo that cannot be used is an answer too."""
    if work is None or code != code_key():
        from distributed import get_worker

        worker = get_worker()
        return Foreign(f"{worker.name} ({worker.address})")
    if not ask.sent and not _has_files(work.reader.photoset.folder, ask.files):
        return Lacking()
    try:
        if not ask.sent:
            return seen_in(work, ask.view, ask.photo)
        with TemporaryDirectory(prefix="photogonio-") as folder:
            return seen_in(work, ask.view, ask.photo, _unpacked(Path(folder), ask.sent))
    except InputError as error:
        return LeftOut(ask.view.name, error.what)


def _has_files(folder: Path, files: Mapping[str, FileMark]) -> bool:
    """Whether they are here, and not others of their names."""
    return all(mark.fits(folder / name) for name, mark in files.items())


def _unpacked(folder: Path, files: Mapping[str, bytes]) -> dict[str, Path]:
    places = {name: folder / f"{k}{Path(name).suffix}" for k, name in enumerate(files)}
    for name, place in places.items():
        place.write_bytes(files[name])
    return places


@contextmanager
def cluster_of(executor: str | None) -> Iterator[Cluster | None]:
    """The workers that ``dask://HOST:PORT`` names; None for workers in this process.

    Raises:
        InputError: there is no such scheduler, it has no worker, or one of another version.
    """
    if executor is None or not executor.startswith("dask://"):
        yield None
        return
    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            f"--executor {executor}", "needs dask.distributed: pip install 'photogonio[cluster]'"
        ) from None
    address = executor.removeprefix("dask://")
    try:
        _greeted(address)
        client = Client("tcp://" + address, set_as_default=False, timeout=COMING)
    except (OSError, TimeoutError, ValueError) as error:
        why = (getattr(error, "strerror", None) or str(error) or "no answer").lower()
        raise InputError(f"--executor {executor}", f"no scheduler can be reached there ({why})") from None
    with client, _hushed():
        yield Cluster(client, f"--executor {executor}")


def _greeted(address: str) -> None:
    """Waits for a scheduler that is just being started, and no longer. A scheduler speaks first; dask itself would ask
    again for half a minute where nobody is, and for ever where something else answers. Raises OSError."""
    host, _, port = address.rpartition(":")
    until = time.monotonic() + REACHED
    while True:
        try:
            with socket.create_connection((host.strip("[]"), int(port)), REACHED) as line:
                if not line.recv(1):
                    raise OSError(errno.EPROTO, "what answers there is no dask scheduler")
                return
        except TimeoutError:
            raise OSError(errno.ETIMEDOUT, "nothing that is there says a word") from None
        except ConnectionRefusedError:
            if time.monotonic() > until:
                raise
            time.sleep(0.2)


@contextmanager
def _hushed() -> Iterator[None]:
    """What dask logs of workers that die is no news: their photos are done again."""
    log = logging.getLogger("distributed")
    level = log.level
    log.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        log.setLevel(level)
