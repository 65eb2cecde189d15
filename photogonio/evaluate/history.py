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


def load_scores(path: Path) -> dict[str, Row]:
    """The scenes of an ``evaluate.json``, by name.

    Raises:
        InputError: it is none.
    """
    document = read_json(path)
    scenes = document.get("scenes") if isinstance(document, dict) else None
    if not isinstance(scenes, list) or not all(isinstance(row, dict) for row in scenes):
        raise InputError(path, "is no evaluate.json: expected scenes")
    for k, row in enumerate(scenes):
        text(row.get("scene"), f"{path}: scenes[{k}] scene")
        for name in ("error_70", "seconds"):
            number(low=0.0)(row.get(name), f"{path}: scenes[{k}] {name}")
    return {row["scene"]: row for row in scenes}


def regressions(former: Mapping[str, Row], rows: Sequence[Row]) -> list[str]:
    """What has become worse, a line each; scenes that only one of the two has are passed over."""
    lines = []
    for row in rows:
        old = former.get(row["scene"])
        if old is None:
            continue
        error, before = row["error_70"], old["error_70"]
        if error > max(WORSE * before, before + LEAST):
            lines.append(f"{row['scene']}: error {100 * before:.2f} % before, {100 * error:.2f} % now")
        seconds, took = row["seconds"], old["seconds"]
        if seconds > max(SLOWER * took, took + LEAST_SECONDS):
            lines.append(f"{row['scene']}: {took:.1f} s before, {seconds:.1f} s now")
    return lines
