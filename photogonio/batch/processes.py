"""Sets worked on several at a time, in processes that stay: one start-up for many sets.

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
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import connection, parent_process
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any

from photogonio.batch.ledger import FAILED, SetEntry
from photogonio.batch.work import Job, processed
from photogonio.system.memory import collect_seldom, keep_freed

STOP = 3.0  # seconds in which a process ends that is told to


def in_processes(
    jobs: Sequence[Job], workers: int, work: Callable[[Job], SetEntry] = processed
) -> Generator[SetEntry, None, None]:
    """The entries of jobs as they are done, ``workers`` at a time. Sets that are under way when a process dies are
    tried once more, each alone: so it is known whose fault it was."""
    left, suspects = {job.place.name: job for job in jobs}, list[str]()
    while left:
        alone = bool(suspects)
        chosen = [left[suspects.pop()]] if alone else list(left.values())
        under_way: set[str] = set()
        for entry in _until_broken(chosen, 1 if alone else workers, work, under_way):
            del left[entry.set]
            yield entry
        died = sorted(under_way & set(left), reverse=True)
        if alone and died:
            job = left.pop(died[0])
            yield SetEntry(
                job.place.name, job.key, FAILED, "its process died, twice: is there memory enough?"
            )
        elif died:
            suspects = died


def _until_broken(
    jobs: Sequence[Job], workers: int, work: Callable[[Job], SetEntry], under_way: set[str]
) -> Iterator[SetEntry]:
    """Entries until all jobs are done or a process dies; ``under_way`` then names what was being done."""
    queue, waiting = deque(jobs), dict[Future[SetEntry], str]()
    started, heard = _Started(), _Heard()
    pool = ProcessPoolExecutor(min(workers, len(jobs)), started, _on_its_own)
    try:
        while queue or waiting:
            while queue and len(waiting) < workers:
                job = queue.popleft()
                under_way.add(job.place.name)
                future = pool.submit(work, job)
                waiting[future] = job.place.name
                future.add_done_callback(heard.tell)
            if heard.died(started.processes):
                return
            for future in [one for one in waiting if one.done()]:
                entry = future.result()
                under_way.discard(waiting.pop(future))
                yield entry
    except BrokenProcessPool:
        return
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


def _on_its_own() -> None:
    """Stops are the parent's business, which ends its workers. They do not outlive it, however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    keep_freed()
    collect_seldom()
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
