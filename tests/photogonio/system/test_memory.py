"""What a process does with freed memory: asked in a process of its own, since the setting holds for all of it."""

import subprocess
import sys

import pytest

TAKE = """
import resource, sys
import numpy as np
from photogonio.system.memory import keep_freed
told = keep_freed() if sys.argv[1] == "kept" else None
def faults():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt
def take():
    np.full(40_000_000, 1, np.uint8)
take()
before = faults()
for _ in range(10):
    take()
print(told, faults() - before)
"""


def told_and_faults(how: str) -> tuple[str, int]:
    done = subprocess.run([sys.executable, "-c", TAKE, how], check=True, capture_output=True, text=True)
    told, faults = done.stdout.split()
    return told, int(faults)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the C library of Linux is told")
def test_freed_memory_is_taken_again():
    told, faults = told_and_faults("kept")
    if told == "False":
        pytest.skip("a C library without mallopt")
    # ten times 40 MB anew are at least 190 pages of 2 MB; kept, there are none to clear
    assert faults < 20
    assert told_and_faults("given back")[1] > 190


SELDOM = """
import gc, weakref
from photogonio.system.memory import collect_seldom
class Thing: pass
def circle():
    thing = Thing()
    thing.itself = thing
    return weakref.ref(thing)
collect_seldom()
looked = []
gc.callbacks.append(lambda phase, told: looked.append(phase))
alive = [[] for _ in range(100_000)]
times, dead = len(looked), circle()
more = [[] for _ in range(400_000)]
print(times, dead() is None)
"""


def test_dead_circles_are_found_seldom_but_found():
    done = subprocess.run([sys.executable, "-c", SELDOM], check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["0", "True"]
