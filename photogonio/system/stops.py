"""A stop that was asked for: Ctrl-C or SIGTERM, asked for again until it is heard.

Libraries make of it what they like: numba, while it compiles, an error of its own. So it is kept that it was asked.
"""

from __future__ import annotations

import signal
import threading

_asked = threading.Event()


def ask_again(seconds: float) -> None:
    """Raise the stop again every so many seconds; 0: no more."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, seconds, seconds)


def ask(seconds: float) -> None:
    """A stop is asked for, and again every so many seconds."""
    _asked.set()
    ask_again(seconds)


def is_asked() -> bool:
    """Whether a stop was asked for that nobody has heard."""
    return _asked.is_set()


def stop_heard() -> None:
    """Who ends on a stop as if nothing had been says so, lest it is asked for again."""
    _asked.clear()
    ask_again(0.0)
