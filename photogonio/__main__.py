"""``python -m photogonio``, and the command: a stop while its modules load ends it in one line, as later ones do.

Until an interrupt is quiet nothing is imported but ``os`` and ``sys``, which are there: to load a handler takes longer
than a finger.
"""

import os
import sys

TYPE_CHECKING = False  # as ``typing`` has it
if TYPE_CHECKING:
    from types import TracebackType
    from typing import NoReturn

INTERRUPTED = 130


def program() -> "NoReturn":
    """:func:`photogonio.cli.program`, and what goes before it is loaded."""
    sys.excepthook = _failed
    import signal

    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _stopped)
    from photogonio.cli import program as begun

    begun()


def _stopped(signum: int, frame: object) -> None:
    os.write(sys.stderr.fileno(), b"photogonio: stopped; nothing was written\n")
    os._exit(INTERRUPTED)


def _failed(kind: type[BaseException], error: BaseException, trace: "TracebackType | None") -> None:
    """Of an interrupt before there is a handler of it."""
    if issubclass(kind, KeyboardInterrupt):
        _stopped(0, None)
    sys.__excepthook__(kind, error, trace)


if __name__ == "__main__":
    program()
