"""The process's peak memory, where the system tells."""

from __future__ import annotations

from pathlib import Path

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
