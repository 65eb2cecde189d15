"""From a facet-pair table to a BRDF: everything is chosen from the data, and every choice says why.

Stages: pilot fits of each kind of lobe -> stray light and view scales, found with the pilot and removed -> choice of
order, prior and lobes on folds -> robust fit of the choice -> covariance -> the coefficient file's terms.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from capture.errors import InputError
from reconstruct.basis import Basis
from reconstruct.brdf import Brdf
from reconstruct.cells import Cells, cells_of
from reconstruct.microfacet import Family, families
from reconstruct.model import LobeSet, Model
from reconstruct.represent import FILE_FAMILY, Represented, represent
from reconstruct.robust import ViewScales, error_model, level, view_scales
from reconstruct.search import Fitted, search_lobes, starting_shape, thinned
from reconstruct.select import PRIORS, Candidate, Prior, choose, folds_of, losses
from reconstruct.solve import Factors, FoldedDesign
from reconstruct.table import FacetTable
from reconstruct.uncertainty import Uncertainty, uncertainty_of, valid_region

PILOT_ORDER = 4
PILOT_PRIOR = Prior(strength=0.1, decay=1.0)
HIGHEST_AUTO = 8  # order that is tried on photos: the paper's own limit for practical work
HIGHEST_AUTO_TABLE = 12
STRAY_ROUNDS = 2
VIEW_ERROR = 0.003  # of a view's scale, where calibration gives none
CLOSE = 0.005  # relative representation error that needs no finer modes
FINEST = 12  # order of the representation

StrayLight = Callable[[Cells, Model], np.ndarray]  # (n, c) 1/sr that stray light adds to the cells' values


@dataclass(frozen=True, slots=True)
class FitOptions:
    """What the user asks for; None leaves the choice to the data."""

    order: int | None = None
    symmetry: str = "auto"
    lobes: int | None = None
    theta_max: float = np.radians(80.0)  # cells beyond are not used
    absolute: bool = True  # the table's scale


@dataclass(frozen=True, slots=True)
class FitResult:
    """A BRDF and what led to it."""

    brdf: Brdf
    model: Model  # as fitted, before it is said in the file's terms
    cells: Cells  # used, with stray light removed and view scales applied
    predicted: np.ndarray  # (n, c) by ``brdf`` at the cells
    weight: np.ndarray  # (n, c) robust weights, about 1 and less
    stray: np.ndarray  # (n, c) removed from the cells' values, 1/sr
    scales: ViewScales
    uncertainty: Uncertainty
    diagnostics: dict[str, object]  # plain JSON values


def fit_table(
    table: FacetTable,
    options: FitOptions = FitOptions(),
    *,
    view_errors: np.ndarray | None = None,
    stray: StrayLight | None = None,
    progress: Callable[[str], None] = lambda stage: None,
) -> FitResult:
    """Fit modes and lobes to a table.

    ``view_errors`` (g,) are relative standard errors of the views' scales; ``stray`` computes what stray light adds
    to cells, given a model of the surface.

    Raises:
        InputError: no cell is left, or what was asked for does not go together.
    """
    seen = _usable(cells_of(table), options)
    progress("pilot fits")
    views = np.full(len(seen.groups), VIEW_ERROR) if view_errors is None else view_errors
    work = _clean(seen, options, views, stray, progress)
    progress("choosing the model")
    chosen, best, tried = _select(work, options)
    progress("final fit")
    basis = Basis(work.symmetry, chosen.order)
    final = search_lobes(work.cells, work.deviation, basis, chosen.prior, chosen.lobes, free=0)
    return _result(seen, work, final, chosen, best, tried, options)


def _usable(cells: Cells, options: FitOptions) -> Cells:
    keep = (cells.theta_i <= options.theta_max) & (cells.theta_r <= options.theta_max)
    keep |= not cells.binned
    keep &= np.isfinite(cells.value).all(1)
    if not keep.any():
        raise InputError("table", "no cell with samples is left to fit")
    return cells.take(keep)


@dataclass(frozen=True, slots=True)
class _Work:
    """The cells as cleaned, and the pilots that cleaned them."""

    cells: Cells
    deviation: np.ndarray  # (n, c)
    stray: np.ndarray  # (n, c)
    scales: ViewScales
    pilots: tuple[Fitted, ...]  # none first, on thinned cells
    symmetry: str

    @property
    def reference(self) -> Fitted:
        return min(self.pilots, key=lambda one: one.cost)


def _clean(seen: Cells, options: FitOptions, views, stray, progress) -> _Work:
    scales = ViewScales(np.ones(len(seen.groups)), views, views)
    work = _piloted(seen, np.zeros_like(seen.value), scales, options, _kinds(options))
    for _ in range(STRAY_ROUNDS):
        reference = work.reference.model
        if stray is not None:
            progress("stray light")
        added = stray(work.cells, reference) if stray is not None else np.zeros_like(seen.value)
        clean = seen.with_value(seen.value - added)
        deviation = error_model(clean, added)
        if len(np.unique(seen.group)) > 1:
            fitted = search_lobes(clean, deviation, reference.basis, PILOT_PRIOR, reference.lobes, free=0)
            predicted = clean.value - fitted.residual
            scales = view_scales(clean, predicted, deviation * fitted.scale, fitted.weight, views)
        work = _piloted(seen, added, scales, options, _kinds(options))
    return work


def _kinds(options: FitOptions) -> tuple[tuple[Family, ...], ...]:
    if options.lobes == 0:
        return ((),)
    single = tuple((family,) for family in families(absolute=options.absolute))
    return single if options.lobes else ((), *single)


def _piloted(seen: Cells, added, scales: ViewScales, options: FitOptions, kinds) -> _Work:
    cells = seen.with_value((seen.value - added) / scales.factor[seen.group, None])
    deviation = error_model(cells, added)
    few, few_deviation = thinned(cells, deviation)
    basis = Basis("isotropic", PILOT_ORDER)
    pilots = [
        search_lobes(
            few,
            few_deviation,
            basis,
            PILOT_PRIOR,
            LobeSet(kind, tuple(starting_shape(f, 0.25) for f in kind)),
        )
        for kind in kinds
    ]
    if options.lobes is None or options.lobes > 1:
        pilots += _with_second_lobe(few, few_deviation, basis, pilots, options)
    return _Work(cells, deviation, added, scales, tuple(pilots), "isotropic")


def _with_second_lobe(cells, deviation, basis, pilots, options) -> list[Fitted]:
    first = min(pilots, key=lambda one: one.cost).model.lobes
    if len(first.families) != 1:
        return []
    both = LobeSet((*first.families, FILE_FAMILY), (*first.shapes, starting_shape(FILE_FAMILY, 0.25)))
    return [search_lobes(cells, deviation, basis, PILOT_PRIOR, both, free=1)]


def _select(work: _Work, options: FitOptions) -> tuple[Candidate, Candidate, list[Candidate]]:
    cells, reference = work.cells, work.reference
    orders = _orders(options, cells)
    top = Basis(work.symmetry, max(orders))
    again = search_lobes(
        cells, work.deviation, reference.model.basis, PILOT_PRIOR, reference.model.lobes, free=0
    )
    folded = FoldedDesign(
        top.design(cells), again.weight / (work.deviation * again.scale) ** 2, folds_of(cells)
    )
    pilots = [p.model.lobes for p in work.pilots if options.lobes in (None, len(p.model.lobes.families))]
    sums = []
    for lobes in pilots:
        fixed, columns = lobes.columns(cells)
        sums.append(folded.statistics(cells.value - fixed[:, None], columns))
    tried = []
    for order in orders:
        basis = Basis(work.symmetry, order)
        parts = [one.prefix(len(basis.modes)) for one in sums]
        for prior in PRIORS if order else PRIORS[:1]:
            penalty = prior.precision(basis.degree(), level(cells))
            factors = Factors(parts[0].without_each().modes_gram, penalty)
            for lobes, part in zip(pilots, parts, strict=True):
                tried.append(Candidate(order, prior, lobes, losses(part, factors, lobes.upper_bounds())))
    return *choose(tried), tried


def _orders(options: FitOptions, cells: Cells) -> tuple[int, ...]:
    if options.order is not None:
        return (options.order,)
    return tuple(range((HIGHEST_AUTO if cells.binned else HIGHEST_AUTO_TABLE) + 1))


def _said(model: Model, options: FitOptions, values: np.ndarray) -> Represented:
    """In the file's terms, with the fewest modes that say it closely; the order that was asked for is kept."""
    typical = np.sqrt(np.mean(values**2, axis=0))
    order = model.basis.order
    said = represent(model, order)
    while options.order is None and (said.error / typical).max() > CLOSE and order < FINEST:
        order = max(order + 2, 6)
        said = represent(model, order)
    return said


def _result(seen, work: _Work, final: Fitted, chosen, best, tried, options: FitOptions) -> FitResult:
    model, cells = final.model, work.cells
    said = _said(model, options, cells.value)
    spread = uncertainty_of(final, cells, work.deviation, chosen.prior)
    errors = spread.file_errors(model, said)
    basis = Basis(work.symmetry, said.order)
    brdf = Brdf(
        order=said.order,
        channels=cells.channels,
        modes=basis.modes,
        coefficients=said.coefficients,
        standard_errors=errors,
        symmetry=work.symmetry,
        lobes=said.lobes,
        scale="absolute" if options.absolute else "relative",
        valid=valid_region(spread, model, cells),
    )
    predicted = brdf.evaluate(cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r)
    diagnostics = {
        "order": chosen.order,
        "order of best": best.order,
        "lobes": chosen.lobes.name,
        "prior strength": chosen.prior.strength,
        "prior decay": chosen.prior.decay,
        "tried": len(tried),
        "residual scale": final.scale,
        "representation error": said.error.tolist(),
    }
    brdf = replace(brdf, fit=diagnostics)
    return FitResult(
        brdf, model, cells, predicted, final.weight, work.stray, work.scales, spread, diagnostics
    )
