"""Tables of measurements to coefficients."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from photogonio.finished import announce, write_result
from photogonio.options import Options
from photogonio.reconstruct.goniometer.told import Told
from photogonio.report.summary import fit_choices
from photogonio.report.trust import faults_of
from photogonio.result import Result
from photogonio.run.fit_cells import fitted
from photogonio.run.tables import quantity_developed, read_table, take_channels
from photogonio.system.outputs import check_result_place
from photogonio.system.progress import Reporter
from photogonio.system.provenance import Provenance, canonical_command, hash_inputs


def fit(
    table: str | Path,
    out: str | Path | None = None,
    options: Options | None = None,
    *,
    told: Told | None = None,
    reporter: Reporter | None = None,
) -> Result:
    """Coefficients of tabulated measurements, read as ``told``, or of a facet table (.npz) that ``process`` left: of
    that the same ones, with the same options.

    Raises:
        InputError: the table cannot be used, or what was asked cannot be done. Nothing is written then.
    """
    options, reporter = options or Options(), reporter or Reporter(quiet=True)
    if out is not None:
        check_result_place(Path(out))
    path = Path(table)
    told = told or Told()
    options = replace(options, quantity=quantity_developed(path, options, told))
    read = read_table(path, options, told, reporter)
    cells = take_channels(read.table, options)
    wanted = told.to_dict() | options.to_dict()
    provenance = Provenance(canonical_command("fit", path.name, wanted), hash_inputs(path))
    if read.known is not None:
        from photogonio.refit import fit_again  # with all that photos need

        result = fit_again(read.known, cells, options, provenance, reporter)
    else:
        found = fitted(cells, options, options.symmetry, read.scale, reporter)
        announce(found, cells, reporter)
        result = Result(
            name=path.stem,
            setup=None,
            table=cells,
            fit=found,
            choices=fit_choices(found),
            left_out=(),
            diagnoses=tuple(reporter.diagnoses),
            provenance=provenance,
        )
        result = replace(result, faults=faults_of(result))
    if out is not None:
        write_result(result, Path(out), with_setup=False)
    return result
