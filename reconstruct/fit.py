"""From a facet-pair table to a BRDF: everything is chosen from the data, and every choice says why.

Stages: pilot fits of each kind of lobe -> stray light and view scales, found with the pilot and removed -> choice of
order, prior and lobes on folds (:mod:`reconstruct.model_choice`) -> robust fit of the choice -> covariance -> the
coefficient file's terms (:mod:`reconstruct.fit_result`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.estimate.lobe_search import search_lobes
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.model_selection import Candidate
from photogonio.reconstruct.estimate.narrow_gloss import PeakShown, fewer, half_angles, shown_by
from photogonio.reconstruct.estimate.pilot import Cleaned, Progress, StrayLightOn, clean
from photogonio.reconstruct.fit_result import FitResult, result_of
from photogonio.reconstruct.model_choice import (
    AUTOMATIC,
    FitOptions,
    asks_for_average,
    beaten,
    predicting_alike,
    rivals,
    select,
)
from photogonio.reconstruct.paper_fit import fit_as_paper
from photogonio.reconstruct.rows.row_average import Average
from photogonio.reconstruct.rows.row_models import best_average, fitted_of, uncertainty_of_average
from photogonio.reconstruct.rows.row_noise import with_noise
from photogonio.reconstruct.symmetry.row_turns import judge_rows
from photogonio.reconstruct.symmetry.verdict import Verdict, asked, direct, judge, turning_kinds
from photogonio.reconstruct.table.cells import LEAST_SAMPLES, Cells, cells_of, tells
from photogonio.reconstruct.table.facet_table import FacetTable, in_parts, of_parts
from photogonio.reconstruct.table.refinement import NEAR, coarsened
from photogonio.reconstruct.uncertainty.blur_left import with_blur_left
from photogonio.reconstruct.uncertainty.budget import uncertainty_of

MOST_CELLS = (
    24_000  # of photos, evenly taken: a view counts as few independent ones, and more say nothing new
)
AT_ONCE = 40_000  # cells of a table, about, that are looked at together
ROWS_ENOUGH = 2500  # evenly taken of more, to tell whether an average is what they are fitted by
VIEW_ERROR = 0.003  # of a view's scale, at least


@dataclass(frozen=True, slots=True)
class PhotoErrors:
    """What is known of a table's photos besides their cells."""

    view_errors: np.ndarray | None = None  # (g,) relative standard errors of the views' scales
    scale_error: float = 0.0  # that of the scale which all share
    lamps: np.ndarray | None = None  # (g,) variances, radians^2, of the lamps' directions
    # cosines (n,) of the angle between lamp and camera where cells are, if they turn together over a cell
    phase: Callable[[Cells], np.ndarray] | None = None
    stray: StrayLightOn | None = None  # what stray light adds to cells, given a model of the surface
    # standard error (n, c), 1/sr, of cells' values by what of it is not known
    doubt: Callable[[Cells], np.ndarray] | None = None
    # variances (n, 2), radians^2, of turns as ``Cells.turn`` has them, by what a pixel sees of the sample
    footprint: Callable[[Cells], np.ndarray] | None = None
    # changes (n, k, c), 1/sr, of cells' values by k things that all photos share, each one standard deviation
    shared: Callable[[Cells, Model], np.ndarray] | None = None
    # relative standard errors (g,) of views' scales that only a model tells, beside ``view_errors``
    doubted: Callable[[Cells, Model], np.ndarray] | None = None
    # changes as ``shared`` has them, of things of which cells are not to tell
    considered: Callable[[Cells, Model], np.ndarray] | None = None


def fit_table(
    table: FacetTable,
    options: FitOptions = AUTOMATIC,
    known: PhotoErrors = PhotoErrors(),
    progress: Progress = lambda stage: None,
) -> FitResult:
    """Fit modes and lobes to a table, with what is ``known`` of its photos.

    Raises:
        InputError: no cell is left, or what was asked for does not go together.
    """
    if options.quantity != "brdf":
        progress("least squares of q")
        # all cells count alike there: finer facets would give one part of the directions most of the say
        return fit_as_paper(replace(cells_of(coarsened(table)), robust=False), options, known.scale_error)
    seen = with_noise(replace(_cells(table, options, known), robust=options.robust))
    if known.doubt is not None:
        seen = replace(seen, doubt=known.doubt(seen))
    stated = 0.0 if known.view_errors is None else known.view_errors
    views = np.maximum(np.broadcast_to(stated, len(seen.groups)), VIEW_ERROR)
    few = seen.take(
        np.arange(0, len(seen), -(-len(seen) // ROWS_ENOUGH))
    )  # of which an average tells as much
    average = best_average(few, finer=len(few) == len(seen)) if asks_for_average(seen, options) else None
    verdict = asked(options.symmetry, seen)
    if verdict is None and average is not None:
        progress("testing isotropy")
        verdict, average = judge_rows(few, average)
    work, verdict = _cleaned(seen, views, options, known.stray, progress, verdict)
    if known.doubted is not None:
        work = _doubted(work, known.doubted(work.cells, work.reference.model))
    if not seen.binned:
        verdict = verdict.beside(direct(seen))
    progress("choosing the model")
    if average is not None and not beaten(average, work):
        if len(average.fold) < len(seen):
            average = best_average(seen, of=average)
        return _averaged(work, average, verdict, options, known.scale_error)
    tried, chosen, best = select(work, options, verdict.symmetry)
    progress("final fit")
    basis = Basis(verdict.symmetry, chosen.order)
    final = search_lobes(
        work.cells,
        work.deviation,
        basis,
        chosen.prior,
        chosen.lobes,
        free=0,
        view_errors=work.scales.error,
    )
    spread = uncertainty_of(
        final,
        work.cells,
        work.deviation,
        predicting_alike(tried, chosen, work.cells),
        view_errors=work.scales.error,
        scale_error=known.scale_error,
        shared=None if known.shared is None else known.shared(work.cells, final.model),
        considered=None if known.considered is None else known.considered(work.cells, final.model),
    )
    own = with_blur_left(spread, final.model, work.cells)
    spread = replace(own, rivals=rivals(tried, chosen, work, verdict.symmetry))
    return result_of(work, final, spread, verdict, (chosen, best), options)


def _doubted(work: Cleaned, errors: np.ndarray) -> Cleaned:
    """With scales of views that are as unsure as ``errors`` (g,) have them besides."""
    return replace(work, scales=replace(work.scales, error=np.hypot(work.scales.error, errors)))


def _averaged(
    work: Cleaned, average: Average, verdict: Verdict, options: FitOptions, scale_error: float
) -> FitResult:
    """The average as a result."""
    final, spread = fitted_of(average, work.cells), uncertainty_of_average(average, scale_error)
    model, first = average.model, average.members[0]
    chosen = Candidate(model.basis.order, first.prior, model.lobes, np.zeros(1))
    return result_of(work, final, spread, verdict, (chosen, chosen), options, average.fresh)


def _cleaned(
    seen: Cells,
    views: np.ndarray,
    options: FitOptions,
    stray: StrayLightOn | None,
    progress: Progress,
    verdict: Verdict | None,
) -> tuple[Cleaned, Verdict]:
    """Cells to fit, with lobes of the symmetry that was asked for or is found; None: to be found."""

    def cleaned(kinds: list[LobeSet] | None) -> Cleaned:
        return clean(
            seen,
            views,
            lobes=options.lobes,
            absolute=options.absolute,
            kinds=kinds,
            free_peaks=options.order is None and options.lobes is None,
            stray=stray,
            progress=progress,
        )

    if verdict is None or verdict.symmetry == "isotropic":
        work = cleaned(None)
        if verdict is not None:
            return work, verdict
        progress("testing isotropy")
        verdict = judge(seen, views, work, absolute=options.absolute)
        if verdict.symmetry == "isotropic":
            return work, verdict
    return cleaned(turning_kinds(options.lobes, options.absolute)), verdict


def _cells(table: FacetTable, options: FitOptions, known: PhotoErrors) -> Cells:
    """The cells to fit: facets finer toward the mirror direction only where a narrow gloss asks for them."""
    parts = in_parts(table, AT_ONCE)
    cells = _usable(parts, options, known)
    if table.finer and not cells.peaked:
        cells = _usable([coarsened(part) for part in parts], options, known)
    if cells.turn is not None and known.footprint is not None:
        cells = replace(cells, turn=cells.turn + known.footprint(cells))
    return cells


def _usable(parts: Sequence[FacetTable], options: FitOptions, known: PhotoErrors) -> Cells:
    """The cells that may be fitted of a table in parts, of a binned one at most :data:`MOST_CELLS`: chosen part by
    part, for the cells of all photos take several times the memory of their table."""
    binned, channels = parts[0].level >= 0, parts[0].channels
    rows, shown, seen = list[np.ndarray](), list[PeakShown](), np.zeros(len(channels), bool)
    for part in parts:
        cells = _cells_of(part, known)
        keep = np.isfinite(cells.value).all(1)
        if binned:
            keep &= (cells.theta_i <= options.theta_max) & (cells.theta_r <= options.theta_max)
            shown.append(shown_by(cells.take(keep), part.finer > 0))
        rows.append(np.flatnonzero(tells(part))[keep])
        seen |= cells.value[keep].any(0)
    if not any(map(len, rows)):
        if any(map(len, parts)) and all((part.count < LEAST_SAMPLES).all() for part in parts):
            few = (
                f"no cell of facets of level {parts[0].level} has {LEAST_SAMPLES} pixels: try a lower --level"
            )
            raise InputError("table", few)
        raise InputError("table", "no cell with samples is left to fit")
    for name in np.array(channels)[~seen]:
        raise InputError(f"table: channel {name}", "is 0 in every cell; leave it out with --channels")
    peaked = False
    if binned:
        some, peaked = fewer(shown, MOST_CELLS)
        ends = np.cumsum([len(one) for one in rows])
        picks = np.split(some, np.searchsorted(some, ends[:-1]))
        rows = [one[pick - end + len(one)] for one, pick, end in zip(rows, picks, ends, strict=True)]
    chosen = of_parts([part.take(one) for part, one in zip(parts, rows, strict=True)])
    return replace(_cells_of(chosen, known), peaked=peaked)


def _cells_of(table: FacetTable, known: PhotoErrors) -> Cells:
    """Cells of a table, with what is known of lamps and of the angle between lamp and camera."""
    cells = cells_of(table).under(known.lamps)
    if known.phase is None or not (cells.canonical and cells.binned):
        return cells
    turned = cells.with_phase(known.phase(cells))
    return _unturned(cells, turned) if table.finer else turned


def _unturned(cells: Cells, turned: Cells) -> Cells:
    """``turned`` with the azimuths of ``cells`` near the mirror direction: there facets are as fine as pixels, and
    small errors of the polar angles would be large ones of an azimuth near half a turn."""
    near = half_angles(cells) < NEAR
    dphi, phi_r = np.where(near, cells.dphi, turned.dphi), np.where(near, cells.phi_r, turned.phi_r)
    return replace(turned, dphi=dphi, phi_r=phi_r)
