"""Work in several processes: results as they come, and a process that dies is told and never waited for."""

from __future__ import annotations

import os

import pytest

from photogonio.capture.errors import InputError
from photogonio.evaluate.scenes import spread_over_processes
from photogonio.system.processes import ProcessDied, as_done


def squared(number: int) -> int:
    if number < 0:
        os._exit(9)
    return number * number


def begin() -> None:
    os.environ["BEGUN"] = "yes"


def told(_: int) -> str:
    return os.environ.get("BEGUN", "no")


def test_each_job_is_done_once_in_processes_that_begin_as_asked():
    assert dict(as_done(squared, range(5), 2, begin)) == {k: k * k for k in range(5)}
    assert dict(as_done(told, [0], 1, begin)) == {0: "yes"}


def test_a_process_that_dies_is_told_with_what_it_had_begun():
    with pytest.raises(ProcessDied) as died:
        list(as_done(squared, [-1], 1, begin))
    assert died.value.under_way == (0,)


def test_an_evaluation_says_that_a_process_died():
    found = spread_over_processes(squared, [3, -1], 2)
    with pytest.raises(InputError, match=r"^evaluate: a process died at number (1, )?2 of 2"):
        list(found)
