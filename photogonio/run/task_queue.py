"""Which photos a cluster's worker is asked for at once."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from concurrent.futures import CancelledError, Future
from typing import Any

import numpy as np

TASK = 0.25  # a processor's seconds of a task: each costs scheduler, network and client some 15 ms besides
MOST = 16  # photos a task


class TaskQueue:
    """Photos that are to be done, in their order, so many a task that its own cost is little beside them."""

    def __init__(self, photos: int):
        self.left = list(range(photos))[::-1]
        self.alone = set[int]()  # of tasks that failed: one of their photos kills workers
        self.size = 1  # photos a task

    def task(self, abreast: int, *, single: bool) -> list[int]:
        """The next photos; fewer toward the end, so that all workers end together."""
        size = (
            1 if single or self.left[-1] in self.alone else max(1, min(self.size, len(self.left) // abreast))
        )
        numbers = [self.left.pop()]
        while len(numbers) < size and self.left[-1] not in self.alone:
            numbers.append(self.left.pop())
        return numbers

    def found(self, future: Future[bytes], numbers: Sequence[int]) -> list[Any] | None:
        """What a worker gave; None where it could not: then photos of a task of several are to be done again, each
        alone."""
        from distributed import KilledWorker

        try:
            found, seconds = pickle.loads(future.result())
        except (KilledWorker, CancelledError, OSError, TimeoutError):
            if len(numbers) > 1:
                self.left += reversed(numbers)
                self.alone.update(numbers)
            return None
        self.size = int(np.clip(TASK * len(numbers) / max(seconds, 1e-3), 1, MOST))
        return found
