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


BACK = """
import ctypes
import numpy as np
from photogonio.system.memory import give_back, keep_freed
def resident():
    return int(next(line for line in open("/proc/self/status") if line.startswith("VmRSS")).split()[1])
told = keep_freed()
np.full(100_000_000, 1, np.uint8)
before = resident()
give_back()
print(told and hasattr(ctypes.CDLL(None), "malloc_trim"), before - resident())
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the C library of Linux is told")
def test_what_was_kept_is_given_back():
    done = subprocess.run([sys.executable, "-c", BACK], check=True, capture_output=True, text=True)
    told, less = done.stdout.split()
    if told == "False":
        pytest.skip("a C library without mallopt or malloc_trim")
    assert int(less) > 90_000  # KB, of 97,656


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
