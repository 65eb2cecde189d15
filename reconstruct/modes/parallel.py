"""Rows worked on in chunks by a few threads: bounded memory, and the same bytes for any number of threads."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

CHUNK = 1 << 15  # rows of one task: an array of them stays in the second cache


def over_rows(
    task: Callable[[int, int], None], count: int, threads: int | None = None, chunk: int = CHUNK
) -> None:
    """Call ``task(start, stop)`` for consecutive ranges of ``chunk`` that cover ``count`` rows.

    The kernels inside release the interpreter's lock; each row is computed alone and written once, so the
    result does not depend on ``threads`` (default: the cores this process may use).
    """
    ranges = [(start, min(start + chunk, count)) for start in range(0, count, chunk)]
    threads = threads or cores()
    if len(ranges) < 2 or threads < 2:
        for start, stop in ranges:
            task(start, stop)
        return
    with ThreadPoolExecutor(min(threads, len(ranges))) as pool:
        list(pool.map(lambda limits: task(*limits), ranges))


def cores() -> int:
    """Cores that this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1
