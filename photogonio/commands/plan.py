"""``photogonio plan``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.design.places import Step, best_photos, candidates
from photogonio.reconstruct.design.spots import Spot
from photogonio.survey.checker import Checker
from photogonio.survey.folder import SetFolder
from photogonio.survey.plan_page import plan_page
from photogonio.survey.plan_words import instruction, lowered, percent
from photogonio.survey.planning import (
    Aim,
    aim_of_nothing,
    aim_of_result,
    aim_of_set,
    held_still,
    is_result,
    with_lamps,
)
from photogonio.survey.words import spot_numbers
from photogonio.system.outputs import check_place, staged_file
from photogonio.system.progress import Reporter
from photogonio.system.provenance import Provenance, canonical_command

UNIT = "mm"
MOST = 100  # photos that are planned at once


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    out = None if args.out is None else Path(args.out)
    if out is not None:
        if out.suffix.lower() not in (".html", ".htm"):
            raise InputError(args.out, "expected a name that ends in .html")
        check_place(out, folder=False)
    if args.add > MOST:
        raise InputError("--add", f"expected at most {MOST}")
    aim = with_lamps(_aim(args, reporter), args.lamp)
    if args.still:
        aim = held_still(aim)
    places = candidates(aim.feasible, aim.piece, turning=aim.belief.turning)
    steps = best_photos(
        aim.belief,
        places,
        aim.piece.pairs,
        args.add,
        lambda done: reporter.progress("planning", done, args.add),
    )
    if not steps:
        raise InputError(args.source or "plan", "no place for a camera and a lamp shows the sample")
    verdict = _verdict(aim, steps)
    reporter.say(f"{aim.what}: f is known to {percent(steps[0].before)} (typical, up to 80 degrees)")
    for k, step in enumerate(steps, start=1):
        idle = "" if step.worth else " (hardly)"
        reporter.say(f"{k}. {instruction(step, aim.piece, UNIT)}; {lowered(step)}{idle}")
    reporter.say(verdict)
    if out is not None:
        name = Path(args.source).name if args.source else ""
        source = Provenance(canonical_command("plan", name, {}), {}).to_text()
        with staged_file(out) as stage:
            stage.write_text(plan_page(aim, steps, verdict, source, UNIT), encoding="utf-8")
        reporter.say(f"written to {out}")
    return _numbers(aim, steps, verdict) | ({} if out is None else {"out": str(out)})


def _aim(args: argparse.Namespace, reporter: Reporter) -> Aim:
    if args.source is None:
        return aim_of_nothing(args.material or "satin", ball=args.shape == "ball")
    if args.shape is not None:
        raise InputError("--shape", "photos and results say themselves what shape the sample has")
    path = Path(args.source)
    if is_result(path):
        if args.material is not None:
            raise InputError("--material", "a result says itself what is known of it")
        return aim_of_result(path)
    folder = SetFolder.of(path)
    checker, photos = Checker.of(folder), folder.photos()
    looked = []
    for k, photo in enumerate(photos):
        looked.append(checker.look(photo))
        reporter.progress("looking at the photos", k + 1, len(photos))
    return aim_of_set(folder, args.material or "satin", looked, checker)


def _verdict(aim: Aim, steps: Sequence[Step]) -> str:
    first = steps[0]
    if not first.worth:
        share = aim.belief.floor / first.before
        why = f"; {100 * share:.0f} % of the variance is what all photos miss alike" if share > 0.3 else ""
        return f"More photos would not help: the best would lower the error from {lowered(first)}{why}."
    many = max(k for k, step in enumerate(steps, start=1) if step.worth)
    change = f"{percent(first.before)} to {percent(steps[many - 1].after)}"
    text = f"{many} photos lower" if many > 1 else "One photo lowers"
    end = "; after these more would not help." if many < len(steps) else "."
    return f"{text} the typical error of f from {change}{end}"


def _numbers(aim: Aim, steps: Sequence[Step], verdict: str) -> dict[str, object]:
    return {
        "what": aim.what,
        "verdict": verdict,
        "helps": steps[0].worth,
        "mean_variance": steps[0].before,
        "floor": aim.belief.floor,
        "taken": len(aim.taken),
        "photos": [
            {
                "camera": _place(step.stance.camera, aim),
                "lamp": _place(step.stance.lamp, aim),
                "flash": step.stance.flash,
                "mean_variance_before": step.before,
                "mean_variance_after": step.after,
                "worth": step.worth,
            }
            for step in steps
        ],
    }


def _place(spot: Spot, aim: Aim) -> dict[str, object]:
    """Angles and distance from the sample's middle, and the place in the board's frame."""
    found: dict[str, object] = dict(spot_numbers(spot) or {})
    return found | {"position": np.round(aim.middle + spot.place, 2)}
