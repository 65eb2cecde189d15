"""The process's memory: its peak, where the system tells, and what becomes of what is freed."""

from __future__ import annotations

import ctypes
import gc
import sys
from pathlib import Path

_M_TRIM_THRESHOLD, _M_MMAP_MAX, _M_ARENA_MAX = -1, -4, -8  # malloc.h of glibc
_MOST = 2**31 - 1

# net new containers before Python looks for dead circles among them, and how many times more before older ones are
# looked at
_NEW, _OLDER = 300_000, 10

_RESET, _STATUS = Path("/proc/self/clear_refs"), Path("/proc/self/status")


def reset_peak() -> None:
    """Begin anew; without effect where the system has no such thing."""
    try:
        _RESET.write_text("5")
    except OSError:
        return


def peak_megabytes() -> float:
    """Peak resident memory since :func:`reset_peak` (else since the start), NaN where the system does not tell."""
    try:
        lines = _STATUS.read_text().splitlines()
    except OSError:
        return float("nan")
    peaks = [int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM")]
    return peaks[0] if peaks else float("nan")


def keep_freed() -> bool:
    """Freed memory stays with this process, to be taken again; whether the C library could be told so.

    A photo's arrays are taken and freed many times over. glibc gives each back to the system at once, which then clears
    every page anew: a third of the time that it took to decode a TIFF, half of that of an EXR. For programs, not for
    libraries: the setting holds for all that runs in the process.
    """
    if not sys.platform.startswith("linux"):
        return False
    try:
        mallopt = ctypes.CDLL(None).mallopt  # musl has none
    except (AttributeError, OSError):
        return False
    settings = ((_M_MMAP_MAX, 0), (_M_TRIM_THRESHOLD, _MOST), (_M_ARENA_MAX, 1))
    return all(mallopt(name, value) == 1 for name, value in settings)


def give_back() -> None:
    """Freed memory goes back to the system, where the C library can be told so.

    Between stages of a program that runs after :func:`keep_freed`: the pieces that one stage left are mostly of no
    use to the next, and would be counted beside what this takes.
    """
    try:
        ctypes.CDLL(None).malloc_trim(0)  # musl, macOS and Windows have none
    except (AttributeError, OSError, TypeError):
        return


def collect_seldom() -> None:
    """Let Python look for circles of dead objects some hundred times more seldom than by default.

    Modules and compiled code are some half a million objects that never die, looked through again and again while they
    are made and after. Arrays hang in no circles and are freed at once. For programs, as :func:`keep_freed`.
    """
    gc.freeze()
    gc.set_threshold(_NEW, _OLDER, _OLDER)
