"""What every fit ends with: its choices told to the user, its files written."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from photogonio.reconstruct.fit_result import FitResult
from photogonio.reconstruct.table.facet_table import FacetTable
from photogonio.reconstruct.table.table_file import save_table
from photogonio.report.summary import clipped, doubts, fit_choices, physics_warnings, rescaled_photos
from photogonio.report.trust import DISTRUSTED
from photogonio.result import Result
from photogonio.system.outputs import staged_folder
from photogonio.system.progress import Reporter


def announce(found: FitResult, table: FacetTable, reporter: Reporter) -> None:
    """What a fit chose, and what it had to put right."""
    reporter.tell(*rescaled_photos(found), *physics_warnings(found), *clipped(table), *doubts(found))
    for choice in fit_choices(found):
        reporter.say(f"{choice.what} {choice.value}: {choice.reason}")


def write_result(result: Result, out: Path, *, with_setup: bool = True) -> None:
    """Coefficients, setup, table, report and pictures, all or none of them."""
    from photogonio.report import page  # with all that draws: not before there is something to draw

    source = {"name": result.name} | result.provenance.to_dict()
    told = json.dumps(source | {"scale": result.brdf.scale})
    with staged_folder(out) as stage, ThreadPoolExecutor(1) as pool:
        saved = pool.submit(  # while pictures are drawn
            save_table,
            result.table,
            stage / "table.npz",
            source=told,
            beside=_packed(result),
        )
        distrust = {DISTRUSTED: [one.code for one in result.faults]} if result.faults else {}
        brdf = replace(result.brdf, source=result.brdf.source | source, fit=result.brdf.fit | distrust)
        brdf.save(stage / "coefficients.json")
        if result.setup is not None and with_setup:
            from photogonio.calib.setup_file import save_setup

            told_all = replace(result.setup, warnings=result.warnings, diagnoses=result.diagnoses)
            save_setup(told_all, stage / "setup.json")
        pictures = page.draw_pictures(result, source=result.provenance.to_text())
        for picture in pictures:
            (stage / f"{picture.name}.png").write_bytes(picture.png)
        (stage / "report.html").write_text(page.report_html(result, pictures), encoding="utf-8")
        saved.result()


def _packed(result: Result) -> dict[str, np.ndarray] | None:
    """What a table of photos carries beside it."""
    if result.known is None:
        return None
    from photogonio.run.circumstances import packed

    return packed(result.known)
