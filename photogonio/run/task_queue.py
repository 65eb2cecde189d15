"""Which photos a cluster's worker is asked for at once."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from concurrent.futures import CancelledError, Future
from typing import Any

import numpy as np

TASK = 0.5  # a processor's seconds of a task: each costs scheduler, network, client and worker some 10 ms besides
LEAST = 0.06  # the same toward the end, when tasks grow smaller
MOST = 32  # photos a task


class TaskQueue:
    """Photos that are to be done, in their order, so many a task that its own cost is little beside them."""

    def __init__(self, photos: int):
        self.left = list(range(photos))[::-1]
        self.alone = set[int]()  # of tasks that failed: one of their photos kills workers
        self.each = TASK  # a processor's seconds a photo, as far as is known

    def task(self, abreast: int, most: int = MOST) -> list[int]:
        """The next photos, at most so many; fewer toward the end, so that all workers end together."""
        size = 1
        if self.left[-1] not in self.alone:
            size = min(max(min(self._in(TASK), len(self.left) // abreast), self._in(LEAST)), most)
        numbers = [self.left.pop()]
        while len(numbers) < size and self.left and self.left[-1] not in self.alone:
            numbers.append(self.left.pop())
        return numbers

    def found(self, future: Future[np.ndarray], numbers: Sequence[int]) -> list[Any] | None:
        """What a worker gave; None where it could not: then photos of a task of several are to be done again, each
        alone."""
        from distributed import KilledWorker

        try:
            found, seconds = pickle.loads(future.result().data)
        except (KilledWorker, CancelledError, OSError, TimeoutError):
            if len(numbers) > 1:
                self.left += reversed(numbers)
                self.alone.update(numbers)
            return None
        self.each = seconds / len(numbers)
        return found

    def _in(self, seconds: float) -> int:
        """Photos that are done in so many seconds."""
        return int(np.clip(seconds / max(self.each, 1e-6), 1, MOST))
