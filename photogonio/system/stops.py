"""A stop that was asked for: Ctrl-C or SIGTERM, asked for again until it is heard."""

from __future__ import annotations

import signal


def ask_again(seconds: float) -> None:
    """Raise the stop again every so many seconds; 0: no more."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, seconds, seconds)


def stop_heard() -> None:
    """Who ends on a stop as if nothing had been says so, lest it is asked for again."""
    ask_again(0.0)
