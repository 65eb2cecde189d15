"""Rows worked on by a few threads: each once, in whatever order."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from photogonio.reconstruct.modes import basis as m
from photogonio.reconstruct.modes.parallel import CHUNK, cores, over_rows


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


def test_same_bytes_for_any_number_of_threads():
    rng = np.random.default_rng(4)
    theta_i, theta_r, dphi = rng.uniform(0, 1.5, (3, 3 * CHUNK + 77))
    modes = m.isotropic_modes(8)
    values = rng.normal(size=(len(modes), 3))
    alone = m.evaluate_isotropic(modes, values, theta_i, theta_r, dphi, threads=1)
    for threads in (2, 5, None):
        assert np.array_equal(
            m.evaluate_isotropic(modes, values, theta_i, theta_r, dphi, threads=threads), alone
        )
    # nor does it matter which pairs stand beside one another
    assert np.array_equal(m.evaluate_isotropic(modes, values, theta_i[5:], theta_r[5:], dphi[5:]), alone[5:])


def test_ten_million_pairs_in_bounded_memory():
    count = 10_000_000
    theta = np.linspace(0, np.pi / 2, count, dtype=np.float32)
    modes = m.isotropic_modes(2)
    values = np.random.default_rng(5).normal(size=(len(modes), 1))
    tracemalloc.start()
    result = m.evaluate_isotropic(modes, values, theta, 0.5, 1.0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < result.nbytes + 20e6
    some = np.arange(0, count, 999_983)
    assert np.array_equal(result[some], m.evaluate_isotropic(modes, values, theta[some], 0.5, 1.0))
