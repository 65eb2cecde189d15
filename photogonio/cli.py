"""The command ``photogonio``: arguments are parsed before anything heavy is imported."""

from __future__ import annotations

import argparse
import errno
import io
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
from photogonio.system.drawing import without_docstrings
from photogonio.system.memory import collect_seldom, keep_freed
from photogonio.system.outputs import to_json
from photogonio.system.progress import Reporter
from photogonio.system.stops import ask, ask_again, is_asked, stop_heard

_DONE, _FAILED, _BAD_INPUT, _DISTRUSTED, _INTERRUPTED = 0, 1, 2, 3, 130

# what only the names and rights of files that were given can lead to
_OF_PATHS = {errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.EACCES, errno.EPERM, errno.ELOOP}
_OF_PATHS |= {errno.ENAMETOOLONG, errno.EROFS, errno.EXDEV, errno.ENXIO, errno.EINVAL}
_DRAWING = ("process", "fit")  # commands whose reports have pictures
AGAIN = 0.2  # seconds after which a stop that somebody swallowed is asked for again


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; its exit status: 0 done, 2 bad input, 3 written but not to be trusted, 130 stopped by the user,
    1 anything else."""
    words = sys.argv[1:] if arguments is None else list(arguments)
    parser = build_parser()
    if any("\0" in word for word in words):  # no name of a file
        parser.error("an argument has a zero byte")
    args = parser.parse_args(words)
    if isinstance(
        sys.stdout, io.TextIOWrapper
    ):  # names of files may be no text; standard error escapes them by itself
        sys.stdout.reconfigure(errors="backslashreplace")
    reporter = Reporter(quiet=args.quiet, json=args.json)
    try:
        with _stoppable():
            return _run(args, reporter)
    except KeyboardInterrupt as stop:
        return _stopped(reporter, str(stop))
    except Exception as error:
        if is_asked():  # what a library made of it
            return _stopped(reporter)
        if not isinstance(error, BrokenPipeError):
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _FAILED


def _run(args: argparse.Namespace, reporter: Reporter) -> int:
    keep_freed()
    if args.command in _DRAWING:
        without_docstrings()
    command = import_module(f"photogonio.commands.{args.command}")
    try:
        numbers = command.run(args, reporter)
        if args.json and numbers is not None:  # None: it wrote its lines itself
            sys.stdout.write(to_json(numbers))
            sys.stdout.flush()
    except InputError as error:
        return _fail(reporter, str(error), _BAD_INPUT)
    except OSError as error:
        if isinstance(error, BrokenPipeError):
            raise
        named = f"{os.fsdecode(error.filename)}: " if isinstance(error.filename, str | bytes) else ""
        told = f"{named}{error.strerror.lower()}" if error.strerror else str(error)
        return _fail(reporter, told, _BAD_INPUT if error.errno in _OF_PATHS else _FAILED)
    except MemoryError:
        return _fail(reporter, "there is not memory enough for this", _FAILED)
    if reporter.failed:
        return _FAILED
    return _DISTRUSTED if reporter.distrusted else _DONE


def _stopped(reporter: Reporter, done: str = "") -> int:
    reporter.clear()
    print(f"photogonio: stopped; {done or 'nothing was written'}", file=sys.stderr)
    return _INTERRUPTED


def _fail(reporter: Reporter, message: str, status: int) -> int:
    if is_asked():  # nothing else failed
        return _stopped(reporter)
    reporter.clear()
    print("photogonio: " + " ".join(message.split()), file=sys.stderr)
    return status


@contextmanager
def _stoppable() -> Iterator[None]:
    """SIGTERM stops the work as Ctrl-C does, in a thread that may catch signals.

    A stop that comes while a library calls back from compiled code is printed and forgotten there; so it is asked for
    again until it arrives.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    stop_heard()  # one of an earlier call
    numbers = [signal.SIGINT, signal.SIGTERM, *([signal.SIGALRM] if hasattr(signal, "SIGALRM") else [])]
    # who was started with interrupts ignored, as jobs in the background are, goes on ignoring them
    numbers = [number for number in numbers if signal.getsignal(number) is not signal.SIG_IGN]
    former, hook = {number: signal.signal(number, _interrupt) for number in numbers}, sys.unraisablehook
    sys.unraisablehook = lambda told: None if told.exc_type is KeyboardInterrupt else hook(told)
    try:
        yield
    finally:
        ask_again(0.0)
        sys.unraisablehook = hook
        for number, handler in former.items():
            signal.signal(number, handler)


def _interrupt(signum: int, frame: object) -> None:
    if isinstance(sys.exc_info()[1], KeyboardInterrupt):
        return  # on its way, and cleaning up
    ask(AGAIN)
    raise KeyboardInterrupt


def only_own_lines() -> None:
    """What libraries print by themselves (libpng, libjpeg, libtiff, LibRaw) goes nowhere: they write to the system's
    standard error, and ``sys.stderr`` to where that led. In the processes that are started too."""
    try:
        sys.stderr.flush()
        own = os.dup(sys.stderr.fileno())
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stderr.fileno())
        os.close(nowhere)
    except (AttributeError, OSError, ValueError):  # it was closed
        return
    encoding = sys.stderr.encoding
    sys.stderr = open(own, "w", buffering=1, encoding=encoding, errors="backslashreplace")


def program() -> NoReturn:
    """:func:`main` as a program of its own, which ends at once: the system frees a process's memory faster than the
    interpreter takes its objects apart one by one, a third of a second after photos were processed."""
    collect_seldom()
    only_own_lines()
    status = main()
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:
        status = status or _FAILED
    os._exit(status)


if __name__ == "__main__":
    program()
