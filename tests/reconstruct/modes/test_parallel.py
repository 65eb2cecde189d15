"""Rows worked on by a few threads: each once, in whatever order."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.modes.parallel import cores, over_rows


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("count", [0, 1, 7, 8, 9, 100])
def test_every_row_is_worked_on_once(count, threads):
    seen = np.zeros(count, int)
    widest = []

    def task(start: int, stop: int) -> None:
        seen[start:stop] += 1
        widest.append(stop - start)

    over_rows(task, count, threads=threads, chunk=8)
    assert (seen == 1).all() and max(widest, default=0) <= 8
    assert len(widest) == -(-count // 8)


@pytest.mark.parametrize("threads", [1, 2])
def test_what_a_task_raises_is_not_lost(threads):
    def task(start: int, stop: int) -> None:
        if start == 16:
            raise ValueError("row 16")

    with pytest.raises(ValueError, match="row 16"):
        over_rows(task, 40, threads=threads, chunk=8)


def test_there_is_a_core():
    assert cores() >= 1
