"""Work in several processes: results as they come, and a process that dies is told and never waited for."""

from __future__ import annotations

import gc
import math
import os
from functools import partial

import pytest

from photogonio.capture.errors import InputError
from photogonio.evaluate import scenes
from photogonio.system.processes import ProcessDied, as_done

# work is of the standard library, so that a process that begins loads nothing for it


def test_each_job_is_done_once_in_processes_that_begin_as_asked():
    assert dict(as_done(math.factorial, range(5), 2, gc.collect)) == {0: 1, 1: 1, 2: 2, 3: 6, 4: 24}
    assert dict(as_done(os.umask, [0o22], 1, partial(os.umask, 0o70))) == {0: 0o70}  # gives the one before


def test_a_process_that_dies_is_told_with_what_it_had_begun():
    with pytest.raises(ProcessDied) as died:
        list(as_done(os._exit, [9], 1, gc.collect))
    assert died.value.under_way == (0,)


def test_an_evaluation_says_that_a_process_died(monkeypatch):
    monkeypatch.setattr(scenes, "_keep_nothing", gc.collect)
    found = scenes.spread_over_processes(os._exit, [9, 9], 2)
    with pytest.raises(InputError, match=r"^evaluate: a process died at number [12, ]+ of 2"):
        list(found)
