"""Photos side by side: results in order, few in flight, and an error stops the rest."""

import threading
import time

import pytest

from photogonio.calib.parallel import abreast


@pytest.mark.parametrize("workers", [1, 2, 5])
def test_results_come_in_order(workers):
    def task(k):
        time.sleep(0.002 * (k % 3))
        return k * k

    assert list(abreast(task, range(20), workers)) == [k * k for k in range(20)]


def test_no_more_run_ahead_than_there_are_workers():
    begun, lock = [], threading.Lock()

    def task(k):
        with lock:
            begun.append(k)
        return k

    for done, _ in enumerate(abreast(task, range(30), 2)):
        assert len(begun) <= done + 4  # the one yielded, two that run and one that waits


def test_an_error_reaches_who_asked_and_ends_the_work():
    begun = []

    def task(k):
        begun.append(k)
        if k == 3:
            raise ValueError("three")
        return k

    with pytest.raises(ValueError, match="three"):
        list(abreast(task, range(100), 2))
    assert len(begun) < 10
