"""``photogonio evaluate``."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from photogonio import __version__
from photogonio.cache.kept import code_key
from photogonio.capture.errors import InputError
from photogonio.commands.asked import told_of
from photogonio.evaluate.hard_cases import Outcome, run_battery
from photogonio.evaluate.history import Row, load_scores, regressions
from photogonio.evaluate.measured_tables import TableScore, evaluate_tables
from photogonio.evaluate.scenes import Score, evaluate_scenes, load_scenes, rendered
from photogonio.evaluate.score_table import score_table
from photogonio.evaluate.suite import SetScore, run_suite, suite_line
from photogonio.evaluate.tradeoff import (
    FEW,
    FULL,
    Point,
    Settings,
    tradeoff_figure,
    tradeoff_lines,
    tradeoffs,
)
from photogonio.report.evaluation_report import evaluation_html
from photogonio.report.html import embed, picture_bytes
from photogonio.synthetic.scene.model import Scene
from photogonio.system.drawing import own_style
from photogonio.system.outputs import check_result_place, staged_folder, to_json
from photogonio.system.progress import Reporter
from photogonio.system.provenance import Provenance, canonical_command


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    _check(args)
    out, workers = Path(args.out), args.workers or os.cpu_count() or 1
    sets = Path(args.cache) if args.cache else out / "sets"
    kind = "table" if args.tables else "set" if args.suite else "scene"
    former = load_scores(Path(args.against), kind) if args.against else None
    check_result_place(out)
    if args.hard:
        outcomes = run_battery(args.scenes, sets, workers=workers, reporter=reporter)
        return _finish(args, reporter, outcomes=outcomes)
    if args.tables:
        measured = evaluate_tables(args.scenes, told_of(args), reporter)
        return _compared(_finish(args, reporter, measured=measured), former, "tables", args, reporter)
    if args.suite:
        found = []
        for one in run_suite(args.scenes, sets, workers=workers, reporter=reporter):
            found.append(one)
            reporter.say(suite_line(one))
        return _compared(_finish(args, reporter, suite=found), former, "sets", args, reporter)
    scenes = load_scenes(args.scenes, quick=args.quick)
    scores = evaluate_scenes(scenes, sets, workers=workers, reporter=reporter)
    reporter.say(score_table(scores))
    turn = FEW if args.quick else FULL
    points = _tradeoff(scenes[-1], scores[-1], sets, workers, turn, reporter)
    numbers = _finish(args, reporter, scores=scores, points=points)
    return _compared(numbers, former, "scenes", args, reporter)


def _check(args: argparse.Namespace) -> None:
    """Raises InputError where what is asked for excludes one another."""
    kinds = [f"--{name}" for name in ("hard", "tables", "suite") if getattr(args, name)]
    if len(kinds) > 1:
        raise InputError(" ".join(kinds), "expected one of these")
    if kinds and args.quick:
        raise InputError("--quick", f"is of scenes; {kinds[0]} has no quick mode")
    if args.hard and args.against:
        raise InputError("--against", "compares scenes, tables or the suite; a hard case passes or fails")


def _compared(
    numbers: dict[str, Any],
    former: dict[str, Row] | None,
    kind: str,
    args: argparse.Namespace,
    reporter: Reporter,
) -> dict[str, Any]:
    """The numbers with what has become worse since ``former``, if there is one."""
    if former is not None:
        numbers["regressions"] = regressions(former, numbers[kind])
        for line in numbers["regressions"]:
            reporter.warn(line)
        reporter.say(f"{len(numbers['regressions'])} regressions against {args.against}")
        reporter.failed = bool(numbers["regressions"])
    return numbers


def _tradeoff(
    scene: Scene, score: Score, sets: Path, workers: int, turn: Settings, reporter: Reporter
) -> list[Point]:
    reporter.say(f"error against time on {scene.name}:")
    points = tradeoffs(rendered(scene, sets, workers=workers, reporter=reporter), score, turn, workers)
    for line in tradeoff_lines(points):
        reporter.say("  " + line)
    return points


def _finish(
    args: argparse.Namespace,
    reporter: Reporter,
    *,
    scores: Sequence[Score] = (),
    points: Sequence[Point] = (),
    outcomes: Sequence[Outcome] = (),
    measured: Sequence[TableScore] = (),
    suite: Sequence[SetScore] = (),
) -> dict[str, Any]:
    options = {name: getattr(args, name) or None for name in ("quick", "hard", "tables", "suite")}
    rows = [score.to_dict() for score in scores]
    numbers: dict[str, Any] = {
        "source": {
            "program": "photogonio",
            "version": __version__,
            "command": canonical_command("evaluate", " ".join(args.scenes) or "suite", options),
            "inputs": {"program text": code_key()}
            | {score.scene: "; ".join(score.result.provenance.inputs.values()) for score in scores},
        },
        "scenes": rows,
        "tradeoff": [{name: getattr(point, name) for name in point.__slots__} for point in points],
        "battery": [outcome.to_dict() for outcome in outcomes],
        "tables": [score.to_dict() for score in measured],
        "sets": [score.to_dict() for score in suite],
    }
    name = "hard" if outcomes else "evaluate"
    with staged_folder(Path(args.out)) as stage:
        (stage / f"{name}.json").write_text(to_json(numbers), encoding="utf-8")
        table = rows or numbers["battery"] or numbers["tables"] or numbers["sets"]
        (stage / f"{name}.csv").write_text(_csv(table), encoding="utf-8")
        picture = b""
        if points:
            with own_style():
                figure = tradeoff_figure(points, f"error against time on {scores[-1].scene}")
                picture = picture_bytes(figure)
            (stage / "tradeoff.png").write_bytes(picture)
        source = Provenance(numbers["source"]["command"], numbers["source"]["inputs"])
        shown = {one: numbers[one] for one in ("scenes", "battery", "tables")}
        page = evaluation_html(shown, source, tradeoff=embed(picture))
        (stage / f"{name}.html").write_text(page, encoding="utf-8")
    if outcomes:
        passed = sum(outcome.passed for outcome in outcomes)
        reporter.say(f"{passed} of {len(outcomes)} hard cases pass")
        reporter.failed = passed < len(outcomes)
    reporter.say(
        f"written to {args.out}: {name}.html, {name}.json, {name}.csv" + (", tradeoff.png" if points else "")
    )
    return numbers


def _csv(rows: list[dict[str, object]]) -> str:
    """Rows as CSV; a list is joined by blanks."""
    import csv
    import io

    from photogonio.system.outputs import plain

    text = io.StringIO()
    names = list(dict.fromkeys(name for row in rows for name in row))
    writer = csv.DictWriter(text, names, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        flat = {name: plain(value) for name, value in row.items()}
        writer.writerow(
            {name: " ".join(map(str, v)) if isinstance(v, list) else v for name, v in flat.items()}
        )
    return text.getvalue()
