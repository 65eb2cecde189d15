"""The command ``photogonio``: arguments are parsed before anything heavy is imported."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import NoReturn

from photogonio.arguments import build_parser
from photogonio.capture.errors import InputError
from photogonio.system.memory import keep_freed
from photogonio.system.outputs import to_json
from photogonio.system.progress import Reporter

_DONE, _FAILED, _BAD_INPUT, _DISTRUSTED, _INTERRUPTED = 0, 1, 2, 3, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; its exit status: 0 done, 2 bad input, 3 written but not to be trusted, 130 stopped by the user,
    1 anything else."""
    args = build_parser().parse_args(arguments)
    reporter = Reporter(quiet=args.quiet, json=args.json)
    try:
        with _stopped_by(signal.SIGTERM):
            return _run(args, reporter)
    except KeyboardInterrupt:
        reporter.clear()
        print("photogonio: stopped; nothing was written", file=sys.stderr)
        return _INTERRUPTED
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _FAILED


def _run(args: argparse.Namespace, reporter: Reporter) -> int:
    keep_freed()
    command = import_module(f"photogonio.commands.{args.command}")
    try:
        numbers = command.run(args, reporter)
        if args.json:
            sys.stdout.write(to_json(numbers))
            sys.stdout.flush()
    except InputError as error:
        return _fail(reporter, str(error), _BAD_INPUT)
    except OSError as error:
        if isinstance(error, BrokenPipeError):
            raise
        return _fail(reporter, str(error), _FAILED)
    if reporter.failed:
        return _FAILED
    return _DISTRUSTED if reporter.distrusted else _DONE


def _fail(reporter: Reporter, message: str, status: int) -> int:
    reporter.clear()
    print("photogonio: " + " ".join(message.split()), file=sys.stderr)
    return status


@contextmanager
def _stopped_by(number: int) -> Iterator[None]:
    """The signal stops the work as Ctrl-C does, in a thread that may catch signals."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    former = signal.signal(number, _interrupt)
    try:
        yield
    finally:
        signal.signal(number, former)


def _interrupt(signum: int, frame: object) -> NoReturn:
    raise KeyboardInterrupt


def program() -> NoReturn:
    """:func:`main` as a program of its own, which ends at once: the system frees a process's memory faster than the
    interpreter takes its objects apart one by one, a third of a second after photos were processed."""
    status = main()
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:
        status = status or _FAILED
    os._exit(status)


if __name__ == "__main__":
    program()
