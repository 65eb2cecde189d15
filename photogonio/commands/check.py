"""``photogonio check``."""

from __future__ import annotations

import argparse
import sys
from collections import Counter

from photogonio.calib.detect.gray import compiled_before
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import CharucoBoard, GridBoard, Photo
from photogonio.survey.checker import Checked, Checker
from photogonio.survey.folder import SetFolder
from photogonio.survey.words import line, numbers, problems, seen_line
from photogonio.system.outputs import line_json
from photogonio.system.progress import Reporter
from photogonio.system.stops import stop_heard


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object] | None:
    folder = SetFolder.of(args.set)
    checker = Checker.of(folder)
    if not compiled_before():
        reporter.say("compiling what photos are looked at with, this first time: some seconds")
    if args.watch:
        _watch(args, checker, reporter)
        return None
    photos = folder.photos()
    reporter.say(f"looking at {len(photos)} photos of {folder.path}")
    found = []
    for photo in photos:
        found.append(_told(checker, photo, reporter))
    faults = [one for one in found if one.fault is not None]
    if len(faults) == len(found):
        raise InputError(folder.path / faults[0].photo.file, str(faults[0].fault))
    counts = Counter(code for one in found for code in problems(one))
    reporter.say(_closing(checker, len(found), sum(bool(problems(one)) for one in found)))
    return {
        "set": str(args.set),
        "board": _board(checker),
        "photos": [numbers(one) for one in found],
        "problems": dict(counts),
        "left_open": None if checker.belief is None else checker.belief.mean_variance() ** 0.5,
    }


def _told(checker: Checker, photo: Photo, reporter: Reporter) -> Checked:
    """A photo, and its line; the first one's in two, the first of which does not wait for its lamp."""
    early: list[Checked] = []

    def told(one: Checked) -> None:
        early.append(one)
        reporter.say(seen_line(one))

    one = checker.look(photo, told)
    reporter.say(line(one, said=bool(early)))
    return one


def _watch(args: argparse.Namespace, checker: Checker, reporter: Reporter) -> None:
    """Lines as photos arrive, until Ctrl-C, which is how it is meant to end."""
    reporter.say(f"watching {checker.folder.path}; Ctrl-C ends")
    looked: dict[str, bool] = {}  # by name, whether it is to be looked at
    unread: set[str] = set()  # cut short, as it seems: looked at again if it changes
    try:
        for photo in checker.folder.arriving(again=unread.__contains__):
            one = _told(checker, photo, reporter)
            looked[photo.file] = bool(problems(one))
            (unread.discard if one.fault is None else unread.add)(photo.file)
            if args.json:
                sys.stdout.write(line_json(numbers(one)))
                sys.stdout.flush()
    except KeyboardInterrupt:
        stop_heard()
    reporter.say(_closing(checker, len(looked), sum(looked.values())))


def _closing(checker: Checker, count: int, wrong: int) -> str:
    words = f"{count} photos, {wrong} to be looked at" if wrong else f"{count} photos, none to be looked at"
    if checker.shots and checker.belief is not None:
        words += (
            f"; of a satin surface they would leave {100 * checker.belief.mean_variance() ** 0.5:.1f} % open"
        )
    found = _board(checker)
    if checker.seen_board and found is not None:
        words += f"; the board was found by itself: {found}"
    return words


def _board(checker: Checker) -> str | None:
    board = checker.board
    if isinstance(board, CharucoBoard):
        return f"charuco, {board.squares[0]} x {board.squares[1]} squares, {board.dictionary}"
    if isinstance(board, GridBoard):
        return f"aruco-grid, {board.markers[0]} x {board.markers[1]} markers, {board.dictionary}"
    return None if board is None else "markers"
