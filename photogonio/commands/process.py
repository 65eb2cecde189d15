"""``photogonio process``."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from photogonio.commands.asked import options_of
from photogonio.pipeline import process
from photogonio.report.budget import budget_numbers
from photogonio.report.summary import closing_lines, numbers
from photogonio.report.trust import verdict_lines
from photogonio.system.progress import Reporter


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    out = Path(args.out) if args.out else Path(os.path.basename(os.path.realpath(args.set)) + "-brdf")
    result = process(args.set, out, options_of(args), reporter)
    reporter.distrust(verdict_lines(result.faults))
    reporter.say(closing_lines(result))
    reporter.say(f"written to {out}: coefficients.json, setup.json, table.npz, report.html and pictures")
    return numbers(result) | {"budget": budget_numbers(result.brdf), "out": str(out)}
