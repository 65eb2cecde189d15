"""Results of photos whose table is there: after it was reduced, or of what ``process`` left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from photogonio.calib.remarks import LeftOut
from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.errors import InputError
from photogonio.finished import announce
from photogonio.options import Options
from photogonio.reconstruct.fit_result import FitResult
from photogonio.reconstruct.table.facet_table import FacetTable
from photogonio.report.summary import contradicted_photos, fit_choices, spoilt_warnings
from photogonio.report.trust import faults_of
from photogonio.result import Result
from photogonio.run.circumstances import Circumstances
from photogonio.run.colours import in_colours
from photogonio.run.fit_photos import fitted_photos
from photogonio.run.surroundings import LightAround
from photogonio.system.progress import Reporter
from photogonio.system.provenance import Provenance


def fit_again(
    known: Circumstances, table: FacetTable, options: Options, provenance: Provenance, reporter: Reporter
) -> Result:
    """The result of photos that were calibrated and reduced before.

    Raises:
        InputError: what was asked cannot be done.
    """
    if known.space != "camera" and options.channels:
        raise InputError("--channels", "all are needed, since the colours are mixed of them")
    reporter.tell(*known.diagnoses)
    found, beside = fitted_photos(table, known, options, reporter)
    return of_photos(known, table, found, beside, provenance, reporter)


def of_photos(
    known: Circumstances,
    table: FacetTable,
    found: FitResult,
    beside: LightAround,
    provenance: Provenance,
    reporter: Reporter,
) -> Result:
    """What a fit of photos gives back, and told to the user."""
    left_out = (*known.left_out, *contradicted_photos(found))
    _announce_photos(found, table, left_out, beside, reporter)
    coloured = None
    if known.space != "camera" and known.matrix is not None:
        coloured = in_colours(found.brdf, known.matrix, known.space)
    result = Result(
        name=known.name,
        setup=replace(known.setup, source=provenance.to_dict()),
        table=table,
        fit=found,
        choices=(known.level, *fit_choices(found)),
        left_out=(*known.setup.left_out, *left_out),
        diagnoses=tuple(reporter.diagnoses),
        provenance=provenance,
        beside=beside,
        coloured=coloured,
        known=known,
    )
    return replace(result, faults=faults_of(result))


def _announce_photos(
    fit: FitResult,
    table: FacetTable,
    left_out: Sequence[LeftOut],
    beside: LightAround,
    reporter: Reporter,
) -> None:
    for photo in left_out:
        message = f"{photo.name}: left out, {photo.reason}"
        reporter.tell(Diagnosis("photo-left-out", message, views=(photo.name,)))
    reporter.tell(*spoilt_warnings(beside))
    announce(fit, table, reporter)
