"""``python -m photogonio``, and the command: a stop while its modules load ends it in one line, as later ones do."""

from __future__ import annotations

import os
import signal
import sys
from typing import NoReturn

INTERRUPTED = 130


def program() -> NoReturn:
    """:func:`photogonio.cli.program`, and what goes before it is loaded."""
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _stopped)
    from photogonio.cli import program as begun

    begun()


def _stopped(signum: int, frame: object) -> None:
    os.write(sys.stderr.fileno(), b"photogonio: stopped; nothing was written\n")
    os._exit(INTERRUPTED)


if __name__ == "__main__":
    program()
