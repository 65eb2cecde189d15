"""An earlier evaluation beside a new one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from photogonio.capture.errors import InputError
from photogonio.capture.files.documents import read_json
from photogonio.capture.manifest.schema import number, text

Row = Mapping[str, Any]  # a scene of an ``evaluate.json``

WORSE = 1.1  # of the former error
LEAST = 0.001  # relative error: smaller changes are nobody's loss
SLOWER = 1.5  # of the former time
LEAST_SECONDS = 1.0


ERRORS = {"scene": "error_70", "table": "fit", "set": "error_70"}  # what is compared, of each kind of row


def load_scores(path: Path, kind: str = "scene") -> dict[str, Row]:
    """The scenes, tables or the suite's sets of an ``evaluate.json``, by name.

    Raises:
        InputError: it is none.
    """
    document = read_json(path)
    rows = document.get(f"{kind}s") if isinstance(document, dict) else None
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise InputError(path, f"is no evaluate.json: expected {kind}s")
    for k, row in enumerate(rows):
        text(row.get(kind), f"{path}: {kind}s[{k}] {kind}")
        for name in () if row.get("refused") else (ERRORS[kind], "seconds"):
            number(low=0.0)(row.get(name), f"{path}: {kind}s[{k}] {name}")
    names = [row[kind] for row in rows]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(
            path, f"has several {kind}s of the same name, which cannot be told apart: {twice[0]}"
        )
    return {row[kind]: row for row in rows}


def regressions(former: Mapping[str, Row], rows: Sequence[Row]) -> list[str]:
    """What has become worse, a line each; rows that only one of the two has are passed over."""
    lines = []
    for row in rows:
        kind = next(one for one in ERRORS if one in row)
        name, measure = row[kind], ERRORS[kind]
        old = former.get(name)
        if old is None or old.get("refused"):
            continue
        if row.get("refused"):
            lines.append(f"{name}: refused now: {row['refused']}")
            continue
        error, before = row[measure], old[measure]
        if error > max(WORSE * before, before + LEAST):
            lines.append(f"{name}: error {100 * before:.2f} % before, {100 * error:.2f} % now")
        seconds, took = row["seconds"], old["seconds"]
        if seconds > max(SLOWER * took, took + LEAST_SECONDS):
            lines.append(f"{name}: {took:.1f} s before, {seconds:.1f} s now")
    return lines
