"""``photogonio fit``."""

from __future__ import annotations

import argparse
from pathlib import Path

from photogonio.commands.asked import options_of, told_of
from photogonio.report.budget import budget_numbers
from photogonio.report.summary import closing_lines, numbers
from photogonio.report.trust import verdict_lines
from photogonio.system.progress import Reporter
from photogonio.tabulated import fit


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    out = Path(args.out) if args.out else Path(Path(args.table).stem + "-brdf")
    result = fit(args.table, out, options_of(args), told=told_of(args), reporter=reporter)
    reporter.distrust(verdict_lines(result.faults))
    reporter.say(closing_lines(result))
    reporter.say(f"written to {out}: coefficients.json, table.npz, report.html and pictures")
    return numbers(result) | {"budget": budget_numbers(result.brdf), "out": str(out)}
