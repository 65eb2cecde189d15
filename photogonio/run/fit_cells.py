"""The fit of a table, as it was asked for."""

from __future__ import annotations

from photogonio.capture.errors import InputError
from photogonio.options import Options
from photogonio.reconstruct.fit import FitOptions, FitResult, PhotoErrors, fit_table
from photogonio.reconstruct.table.facet_table import FacetTable
from photogonio.system.progress import Reporter


def fitted(
    table: FacetTable,
    options: Options,
    symmetry: str,
    scale: str,
    reporter: Reporter,
    known: PhotoErrors = PhotoErrors(),  # noqa: B008  frozen
) -> FitResult:
    asked = FitOptions(
        order=options.order,
        symmetry=symmetry,
        lobes=options.lobes,
        absolute=scale == "absolute",
        physics=options.physics,
        robust=options.robust,
        smooth=options.prior != "none",
        quantity=options.quantity,
    )
    found = fit_table(table, asked, known, lambda stage: reporter.say(f"fitting: {stage}"))
    if symmetry not in ("auto", found.brdf.symmetry):
        raise InputError(f"--symmetry {symmetry}", f"cannot be fitted here; found {found.brdf.symmetry}")
    return found
