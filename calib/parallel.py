"""Photos worked on side by side: several in memory at once, results in their order."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Found = TypeVar("Found")


def abreast(task: Callable[[Item], Found], items: Iterable[Item], workers: int) -> Iterator[Found]:
    """``task`` of each item, ``workers`` of them at once; results in the items' order, of which few have to wait."""
    if workers < 2:
        yield from map(task, items)
        return
    pool = ThreadPoolExecutor(workers)
    waiting: deque[Future[Found]] = deque()
    try:
        for item in items:
            waiting.append(pool.submit(task, item))
            if len(waiting) > workers:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        pool.shutdown(cancel_futures=True)
