"""Scores as text: what was found, errors of calibration, time and memory."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from photogonio.evaluate.scenes import Score

COLUMNS: tuple[tuple[tuple[str, str, float, str], ...], ...] = (  # heading, key of to_dict, factor, format
    (
        ("< 70 %", "error_70", 100.0, "8.2f"),
        ("< 80 %", "relative_l2_80", 100.0, "8.2f"),
        ("albedo", "albedo_error_80", 1.0, "9.4f"),
        ("ITP", "delta_e_itp_mean", 1.0, "7.2f"),
        ("order", "order", 1, "7d"),
        ("lobes", "lobes", 1, "7d"),
        ("level", "level", 1, "7d"),
        ("photos", "photos_used", 1, "8d"),
        ("symmetry", "symmetry", 1, ">12"),
    ),
    (
        ("focal %", "calibration_focal", 100.0, "9.3f"),
        ("camera", "calibration_camera", 1.0, "9.3f"),
        ("light deg", "calibration_light", 1.0, "11.3f"),
        ("place %", "calibration_light_place", 100.0, "9.2f"),
        ("scale %", "calibration_strength", 100.0, "9.2f"),
        ("sample", "calibration_sample", 1.0, "9.3f"),
    ),
    (
        ("calibrate s", "seconds_calibrate", 1.0, "13.2f"),
        ("reduce s", "seconds_reduce", 1.0, "10.2f"),
        ("fit s", "seconds_fit", 1.0, "8.2f"),
        ("MB", "megabytes", 1.0, "8.0f"),
    ),
)


def score_table(scores: Sequence[Score]) -> str:
    """The scores as text: what was found, errors of calibration, and time and memory; a line a scene in each."""
    rows = [score.to_dict() for score in scores]
    return "\n".join(line for columns in COLUMNS for line in ("", *_lines(rows, columns))).lstrip()


def _lines(rows: Sequence[dict[str, object]], columns: Sequence[tuple[str, str, float, str]]) -> list[str]:
    head = f"{'scene':24}" + "".join(f"{name:>{_width(form)}}" for name, *_, form in columns)
    return [head] + [
        f"{row['scene']:24}" + "".join(_cell(row.get(key), factor, form) for _, key, factor, form in columns)
        for row in rows
    ]


def _width(form: str) -> int:
    return int(form.lstrip(">").split(".")[0].rstrip("d"))


def _cell(value: Any, factor: float, form: str) -> str:
    """One entry; a dash where there is no such number."""
    if value is None or (isinstance(value, float) and not np.isfinite(value)):
        return "-".rjust(_width(form))
    return format(value if isinstance(value, str) else factor * value, form)
