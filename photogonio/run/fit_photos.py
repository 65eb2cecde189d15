"""The fit of reduced photos, with what calibration is not sure of."""

from __future__ import annotations

from photogonio.options import Options
from photogonio.reconstruct.fit import FitResult, PhotoErrors
from photogonio.reconstruct.lighting.lamp_errors import doubted_views
from photogonio.reconstruct.lighting.tone_errors import by_tone
from photogonio.reconstruct.table.facet_table import FacetTable
from photogonio.run.circumstances import (
    Circumstances,
    footprints,
    lamp_variances,
    phase_of,
    scale_error,
    shared_by_photos,
    view_errors,
)
from photogonio.run.fit_cells import fitted
from photogonio.run.photo_choices import symmetry_of
from photogonio.run.surroundings import LightAround, light_of
from photogonio.system.progress import Reporter


def fitted_photos(
    table: FacetTable, known: Circumstances, options: Options, reporter: Reporter
) -> tuple[FitResult, LightAround]:
    """The fit of photos' cells, with what calibration is not sure of; and what shone on the sample beside the lamp."""
    setup, beside = known.setup, light_of(known.shown, known.setup, table)
    found = fitted(
        table,
        options,
        symmetry_of(options, known.symmetry, setup.sample),
        setup.scale,
        reporter,
        PhotoErrors(
            view_errors=view_errors(setup, table),
            scale_error=scale_error(setup, table),
            lamps=lamp_variances(setup, table),
            phase=phase_of(setup),
            stray=beside.known,
            doubt=beside.unknown,
            footprint=footprints(setup, table),
            shared=shared_by_photos(setup),
            doubted=doubted_views(setup),
            considered=by_tone(setup),
        ),
    )
    return found, beside
