"""``photogonio target``."""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from pathlib import Path

from photogonio.capture.errors import InputError
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.manifest.stub import stub_manifest
from photogonio.capture.photoset import MANIFEST, CharucoBoard
from photogonio.capture.target.layout import make_target
from photogonio.capture.target.pdf import pdf_page
from photogonio.system.outputs import staged_file
from photogonio.system.progress import Reporter


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    out = Path(args.out)
    manifest = out.parent / MANIFEST
    target = make_target(paper=args.paper, kind=args.kind, square=args.square, dictionary=args.dictionary)
    kept = manifest.exists()  # somebody's, with what was filled in
    if kept and (told := load_photoset(out.parent, unnamed=True).board) != target.board:
        found = "none" if told is None else told.kind
        raise InputError(
            manifest, f"has another [board] ({found}) than this sheet; choose another folder with -o"
        )
    with ExitStack() as both:
        if not kept:
            both.enter_context(staged_file(manifest)).write_text(stub_manifest(target), encoding="utf-8")
        both.enter_context(staged_file(out)).write_bytes(pdf_page(target))
    beside = f"{manifest} is kept as it is" if kept else f"a stub {manifest} beside it"
    reporter.say(f"written to {out}, {beside}; print at 100 % and measure a square")
    return {
        "paper": target.paper,
        "pattern_mm": target.size,
        "squares": target.board.squares if isinstance(target.board, CharucoBoard) else target.board.markers,
        "square_mm": args.square,
        "out": str(out),
        "manifest": str(manifest),
    }
