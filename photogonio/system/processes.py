"""Jobs worked on several at a time, in processes that stay: one start-up for many; a process that dies is seen at once.

An executor that starts a process for each first job (Python 3.11) wakes its manager before it starts the process. Where
starting takes long, the manager waits for the others alone: this one dies unseen, and its result is awaited for ever.
So the system is asked here, which tells of each at once. The others end then too: it may have held a lock of theirs.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import connection, parent_process
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any, TypeVar

STOP = 3.0  # seconds in which a process ends that is told to

Job = TypeVar("Job")
Done = TypeVar("Done")


class ProcessDied(RuntimeError):
    """A process ended in the midst of its work; ``under_way`` are the places of the jobs begun and not done."""

    def __init__(self, under_way: Sequence[int]):
        super().__init__("a process died: is there memory enough?", tuple(under_way))
        self.under_way = tuple(under_way)


def as_done(
    work: Callable[[Job], Done], jobs: Sequence[Job], workers: int, begin: Callable[[], object]
) -> Generator[tuple[int, Done]]:
    """Place and result of each job as they are done, ``workers`` at a time; each process first calls ``begin``.

    Processes are spawned, so that the libraries' threads are not copied in the midst of something.

    Raises:
        ProcessDied: a process ended that was not told to.
        Exception: whatever ``work`` raises.
    """
    queue, waiting, under_way = deque(enumerate(jobs)), dict[Future[Done], int](), set[int]()
    started, heard = _Started(), _Heard()
    pool = ProcessPoolExecutor(min(workers, len(jobs)), started, _on_its_own, (begin,))
    try:
        while queue or waiting:
            while queue and len(waiting) < workers:
                place, job = queue.popleft()
                under_way.add(place)
                future = pool.submit(work, job)
                waiting[future] = place
                future.add_done_callback(heard.tell)
            if heard.died(started.processes):
                raise ProcessDied(sorted(under_way))
            for future in [one for one in waiting if one.done()]:
                found = future.result()
                place = waiting.pop(future)
                under_way.discard(place)
                yield place, found
    except BrokenProcessPool:
        raise ProcessDied(sorted(under_way)) from None
    finally:
        # waited for: else what it holds of the system is told to have leaked; but a process that died while it waited
        # for work keeps the others from hearing that there is none
        closing = threading.Thread(target=pool.shutdown, kwargs={"cancel_futures": True})
        closing.start()
        _end(started.processes, 0.0 if waiting else STOP)
        closing.join()
        heard.close()


class _Started(SpawnContext):
    """Starts processes anew, and knows which."""

    def __init__(self) -> None:
        self.processes: list[SpawnProcess] = []

    def Process(self, *args: Any, **words: Any) -> SpawnProcess:  # type: ignore[override]
        process = SpawnProcess(*args, **words)
        self.processes.append(process)
        return process


class _Heard:
    """Waits for whatever comes first: a result, or a process that dies."""

    def __init__(self) -> None:
        self._ear, self._mouth = connection.Pipe(duplex=False)

    def tell(self, _: object) -> None:
        """That there is a result; asked for in any thread."""
        self._mouth.send_bytes(b".")

    def died(self, processes: Sequence[SpawnProcess]) -> bool:
        """Whether it was a process; if both, a result."""
        if self._ear in connection.wait([self._ear, *(one.sentinel for one in processes)]):
            self._ear.recv_bytes()
            return False
        return True

    def close(self) -> None:
        self._ear.close()
        self._mouth.close()


def _end(processes: Sequence[SpawnProcess], patience: float) -> None:
    """Ends processes that do not end by themselves within so many seconds."""
    begun, until = [one for one in processes if one.pid is not None], time.monotonic() + patience
    for one in begun:
        one.join(max(0.0, until - time.monotonic()))
        one.terminate()
    for one in begun:
        one.join(STOP)
        one.kill()


def _on_its_own(begin: Callable[[], object]) -> None:
    """Stops are the parent's business, which ends its workers. They do not outlive it, however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    begin()
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
