"""From a facet-pair table to a BRDF: everything is chosen from the data, and every choice says why.

Stages: pilot fits of each kind of lobe -> stray light and view scales, found with the pilot and removed -> choice of
order, prior and lobes on folds -> robust fit of the choice -> covariance -> the coefficient file's terms.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.estimate.lobe_search import Fitted, common_error, search_lobes, thinned
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.model_averaging import believed, rivals_of
from photogonio.reconstruct.estimate.model_discrepancy import Misfit, misfit_of
from photogonio.reconstruct.estimate.model_selection import (
    NO_PRIOR,
    PRIORS,
    Candidate,
    Prior,
    choose,
    crosses,
    try_all,
)
from photogonio.reconstruct.estimate.pilot import PILOT_PRIOR, Cleaned, Progress, StrayLightOn, clean
from photogonio.reconstruct.estimate.weights import ViewScales, independence, level
from photogonio.reconstruct.represent.as_found import lobes_of
from photogonio.reconstruct.represent.bounds import enforced, held_pairs, violated
from photogonio.reconstruct.represent.bounds_anisotropic import enforced_turning, violated_turning
from photogonio.reconstruct.rows.row_average import Average
from photogonio.reconstruct.rows.row_models import (
    beats,
    best_average,
    fitted_of,
    loss_of,
    losses_of,
    uncertainty_of_average,
)
from photogonio.reconstruct.rows.row_noise import with_noise
from photogonio.reconstruct.rows.well_determined import close_to_rows
from photogonio.reconstruct.symmetry.verdict import Verdict, asked, direct, judge, turning_kinds
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.reconstruct.table.facet_table import FacetTable
from photogonio.reconstruct.uncertainty.budget import Rival, Uncertainty, uncertainty_of
from photogonio.reconstruct.uncertainty.in_file import in_file
from photogonio.reconstruct.uncertainty.validity import Region, region_of

HIGHEST_AUTO = 8  # order that is tried on photos: the paper's own limit for practical work
HIGHEST_AUTO_TABLE = 12
HIGHER_AUTO_TABLE = (16, 20, 24)  # on, while the one before predicts best: for odd glosses
HIGHEST_AUTO_TURNING = 4  # of a surface that is not isotropic: 120 modes
HIGHEST_ASKED, HIGHEST_ASKED_TURNING = 48, 16  # 5525 modes; of others, more than MOST_MODES from 8 on
MOST_MODES = 1300  # of those asked for
MOST_CELLS = (
    24_000  # of photos, evenly taken: a view counts as few independent ones, and more say nothing new
)
TOLERATED = 0.0015  # relative misfit of photos that buys no finer model
ROWS_A_MODE = 1.9  # so many tell orders beyond those of averages
ORDERS_BESIDE = (2, 6, 12, 16, 20, 24)  # of single models that are held against an average
PRIORS_BESIDE = tuple(Prior(strength, 1.0) for strength in (0.01, 0.1, 1.0))
MOST_CHANNELS = 6  # of more each order tried costs seconds, and each beyond the usual ones gigabytes
ORDERS_OF_SPECTRA = (0, 2, 4, 8)
FEWEST_ROWS = 20  # of a table, for an average of models
VIEW_ERROR = 0.003  # of a view's scale, at least
KNOWN = 1.6  # a departure that is known is as many standard errors: an interval of 95 % just holds it
MOST_MOVED = 4.0  # standard errors, a bound: data that must move further contradict physics, and are not bent


@dataclass(frozen=True, slots=True)
class FitOptions:
    """What the user asks for; None leaves the choice to the data."""

    order: int | None = None
    symmetry: str = "auto"
    lobes: int | None = None
    theta_max: float = np.radians(80.0)  # cells beyond are not used
    absolute: bool = True  # the table's scale
    physics: str = "auto"  # "auto": where the plain fit is unphysical by more than its error | "on" | "off"
    robust: bool = True  # single cells that contradict the others lose their say
    smooth: bool = True  # a prior of smooth modes; False: least squares alone


@dataclass(frozen=True, slots=True)
class FitResult:
    """A BRDF and what led to it."""

    brdf: Brdf
    model: Model  # as fitted, before it is held to physics
    cells: Cells  # used, with stray light removed and view scales applied
    predicted: np.ndarray  # (n, c) by ``brdf`` at the cells
    weight: np.ndarray  # (n, c) robust weights, about 1 and less
    stray: np.ndarray  # (n, c) removed from the cells' values, 1/sr
    scales: ViewScales
    uncertainty: Uncertainty
    misfit: Misfit
    symmetry: Verdict
    region: Region  # what is determined, seen and extrapolated
    diagnostics: dict[str, Any]  # plain JSON values

    def standard_error(self, cells: Cells) -> np.ndarray:
        """Of ``brdf`` (n, c) at the directions of ``cells``, 1/sr: of the model, of what it misses systematically,
        and of its being held to physics."""
        said = self.brdf.evaluate(cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r)
        departed = (said - self.model.evaluate(cells)) / KNOWN
        return np.hypot(error_of(self.model, self.uncertainty, self.misfit, cells), departed)


@dataclass(frozen=True, slots=True)
class PhotoErrors:
    """What is known of a table's photos besides their cells."""

    view_errors: np.ndarray | None = None  # (g,) relative standard errors of the views' scales
    scale_error: float = 0.0  # that of the scale which all share
    lamps: np.ndarray | None = None  # (g,) variances, radians^2, of the lamps' directions
    stray: StrayLightOn | None = None  # what stray light adds to cells, given a model of the surface
    # standard error (n, c), 1/sr, of cells' values by what of it is not known
    doubt: Callable[[Cells], np.ndarray] | None = None


def fit_table(
    table: FacetTable,
    options: FitOptions = FitOptions(),
    known: PhotoErrors = PhotoErrors(),
    progress: Progress = lambda stage: None,
) -> FitResult:
    """Fit modes and lobes to a table, with what is ``known`` of its photos.

    Raises:
        InputError: no cell is left, or what was asked for does not go together.
    """
    seen = with_noise(replace(_usable(cells_of(table).under(known.lamps), options), robust=options.robust))
    if known.doubt is not None:
        seen = replace(seen, doubt=known.doubt(seen))
    stated = 0.0 if known.view_errors is None else known.view_errors
    views = np.maximum(np.broadcast_to(stated, len(seen.groups)), VIEW_ERROR)
    average = best_average(seen) if _by_average(seen, options) else None
    work, verdict = _cleaned(seen, views, options, known.stray, progress, average)
    if not seen.binned:
        verdict = verdict.beside(direct(seen))
    progress("choosing the model")
    if average is not None and verdict.symmetry == "isotropic" and not _beaten(average, work):
        return _averaged(work, average, verdict, options, known.scale_error)
    tried, chosen, best = _select(work, options, verdict.symmetry)
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
        _believed(tried, chosen, work.cells),
        view_errors=work.scales.error,
        scale_error=known.scale_error,
    )
    spread = replace(spread, rivals=_rivals(tried, chosen, work, verdict.symmetry))
    return _result(work, final, spread, verdict, (chosen, best), options)


def _by_average(seen: Cells, options: FitOptions) -> bool:
    """Whether an average of models may be the result: of measured rows, with everything automatic."""
    auto = options.order is None and options.lobes is None and options.smooth
    return auto and not seen.binned and len(seen) >= FEWEST_ROWS and options.symmetry in ("auto", "isotropic")


def _beaten(average: Average, work: Cleaned) -> bool:
    """Whether lobes of searched shapes, beside modes of some order, predict rows left out much better."""
    pilot = work.reference
    weight = (work.deviation * pilot.scale) ** -2.0
    for order in ORDERS_BESIDE:
        if order > average.model.basis.order and len(weight) < ROWS_A_MODE * len(
            Basis("isotropic", order).modes
        ):
            break
        lobes = [one.model.lobes for one in work.pilots]
        tried = try_all(work.cells, weight, "isotropic", (order,), lobes, priors=PRIORS_BESIDE)
        best = min(tried, key=lambda one: one.loss.mean())
        own = losses_of(best, work.cells, average.fold, pilot.scale)
        if beats(own, loss_of(work.cells, average.left_out, average.fold)):
            return True
    return False


def _averaged(
    work: Cleaned, average: Average, verdict: Verdict, options: FitOptions, scale_error: float
) -> FitResult:
    """The average as a result."""
    final, spread = fitted_of(average, work.cells), uncertainty_of_average(average, scale_error)
    model, first = average.model, average.members[0]
    chosen = Candidate(model.basis.order, first.prior, model.lobes, np.zeros(1))
    return _result(work, final, spread, verdict, (chosen, chosen), options)


def _cleaned(
    seen: Cells,
    views: np.ndarray,
    options: FitOptions,
    stray: StrayLightOn | None,
    progress: Progress,
    average: Average | None,
) -> tuple[Cleaned, Verdict]:
    """Cells to fit, with lobes of the symmetry that was asked for or is found."""
    verdict = asked(options.symmetry, seen)

    def cleaned(kinds: list[LobeSet] | None) -> Cleaned:
        return clean(
            seen,
            views,
            lobes=options.lobes,
            absolute=options.absolute,
            kinds=kinds,
            stray=stray,
            progress=progress,
        )

    if verdict is None or verdict.symmetry == "isotropic":
        work = cleaned(None)
        if verdict is not None:
            return work, verdict
        progress("testing isotropy")
        left_out = None if average is None else average.left_out
        verdict = judge(seen, views, work, absolute=options.absolute, left_out=left_out)
        if verdict.symmetry == "isotropic":
            return work, verdict
    return cleaned(turning_kinds(options.lobes, options.absolute)), verdict


def _believed(tried: list[Candidate], chosen: Candidate, cells: Cells) -> list[tuple[Candidate, float]]:
    """Models with the chosen lobes that predict as well, with their weights."""
    same = [one for one in tried if one.lobes is chosen.lobes]
    return believed(same, float(independence(cells).sum()))


def _rivals(tried: list[Candidate], chosen: Candidate, work: Cleaned, symmetry: str) -> tuple[Rival, ...]:
    """Models with other lobes that predict as well, on thinned cells; those of more lobes than the chosen with how
    sure they are, which the chosen's own covariance does not tell."""
    cells, deviation = thinned(work.cells, work.deviation)
    errors, rivals = work.scales.error, []
    for one, weight in rivals_of(chosen, tried, float(independence(work.cells).sum())):
        basis = Basis(symmetry, one.order)
        fitted = search_lobes(
            cells, deviation, basis, one.prior, one.lobes, free=0, refine=False, view_errors=errors
        )
        spread = None
        if len(one.lobes.families) > len(chosen.lobes.families):
            spread = uncertainty_of(fitted, cells, deviation, [(one, 1.0)], view_errors=errors)
        rivals.append(Rival(fitted.model, weight, spread))
    return tuple(rivals)


def _usable(cells: Cells, options: FitOptions) -> Cells:
    keep = (cells.theta_i <= options.theta_max) & (cells.theta_r <= options.theta_max)
    keep |= not cells.binned
    keep &= np.isfinite(cells.value).all(1)
    if not keep.any():
        raise InputError("table", "no cell with samples is left to fit")
    for name in np.array(cells.channels)[~cells.value[keep].any(0)]:
        raise InputError(f"table: channel {name}", "is 0 in every cell; leave it out with --channels")
    if cells.binned and keep.sum() > MOST_CELLS:
        evenly = np.linspace(0, keep.sum(), MOST_CELLS, endpoint=False).astype(int)
        return cells.take(np.flatnonzero(keep)[evenly])
    return cells.take(keep)


def _select(
    work: Cleaned, options: FitOptions, symmetry: str
) -> tuple[list[Candidate], Candidate, Candidate]:
    """All candidates, the chosen and the best, all weighed with the likeliest pilot's robust weights."""
    cells, pilot = work.cells, work.reference.model
    errors = work.scales.error
    again = search_lobes(
        cells, work.deviation, pilot.basis, PILOT_PRIOR, pilot.lobes, free=0, refine=False, view_errors=errors
    )
    weight = independence(cells) * again.weight / (work.deviation * again.scale) ** 2
    common = common_error(cells, cells.value - again.residual, errors)
    wanted = [p.model.lobes for p in work.pilots if options.lobes in (None, len(p.model.lobes.families))]
    tolerated, thrifty = _tolerated(cells, work.deviation * again.scale), crosses(cells)
    alone = options.order is not None and options.lobes == 0 and not cells.binned
    priors = (*(PRIORS if options.smooth else ()), *((NO_PRIOR,) if alone or not options.smooth else ()))
    tried = try_all(cells, weight, symmetry, _orders(options, cells, symmetry), wanted, common, priors)
    if alone:
        tried = close_to_rows(tried, cells, weight, symmetry)
    chosen, best = choose(tried, tolerated, thrifty=thrifty)
    for order in HIGHER_AUTO_TABLE if _may_be_finer(options, cells, symmetry) else ():
        tried += try_all(cells, weight, symmetry, (order,), wanted, common, priors)
        chosen, best = choose(tried, tolerated, thrifty=thrifty)
        if best.order < order:
            break
    return tried, chosen, best


def _may_be_finer(options: FitOptions, cells: Cells, symmetry: str) -> bool:
    """Whether orders beyond the usual ones may be tried: of measured rows, of an isotropic surface."""
    few = len(cells.channels) <= MOST_CHANNELS
    return options.order is None and not cells.binned and symmetry == "isotropic" and few


def _tolerated(cells: Cells, deviation: np.ndarray) -> float:
    """The loss of a misfit of :data:`TOLERATED` throughout; none for measurements that carry their own errors."""
    if not cells.binned:
        return 0.0
    relative = np.median(deviation / np.maximum(np.abs(cells.value), 1e-3 * level(cells)))
    return float((TOLERATED / relative) ** 2)


def _orders(options: FitOptions, cells: Cells, symmetry: str) -> tuple[int, ...]:
    if options.order is not None:
        highest = HIGHEST_ASKED if symmetry == "isotropic" else HIGHEST_ASKED_TURNING
        if options.order > highest:
            raise InputError(
                f"--order {options.order}", f"{symmetry} modes are fitted to order {highest} at most"
            )
        modes = len(Basis(symmetry, options.order).modes)
        if modes > MOST_MODES and symmetry != "isotropic":
            raise InputError(
                f"--order {options.order}",
                f"{symmetry} modes to that order are {modes}; at most {MOST_MODES} are fitted",
            )
        return (options.order,)
    if symmetry != "isotropic":
        return tuple(range(HIGHEST_AUTO_TURNING + 1))
    if len(cells.channels) > MOST_CHANNELS:
        return ORDERS_OF_SPECTRA
    return tuple(range((HIGHEST_AUTO if cells.binned else HIGHEST_AUTO_TABLE) + 1))


def _result(
    work: Cleaned,
    final: Fitted,
    spread: Uncertainty,
    verdict: Verdict,
    candidates: tuple[Candidate, Candidate],
    options: FitOptions,
) -> FitResult:
    """The result, by the chosen candidate and the best."""
    chosen, best = candidates
    model, cells = final.model, work.cells
    misfit = misfit_of(cells, model.evaluate(cells), work.binning)
    region = region_of(lambda where: error_of(model, spread, misfit, where), model, cells)
    plain = Brdf(
        order=spread.basis.order,
        channels=cells.channels,
        modes=spread.basis.modes,
        coefficients=_padded(model.coefficients, spread.modes),
        standard_errors=np.zeros((spread.modes, len(cells.channels))),
        symmetry=verdict.symmetry,
        lobes=lobes_of(model),
        scale="absolute" if options.absolute else "relative",
        valid=region.valid(),
    )
    held, physics = _physical(plain, model, spread, misfit, options.physics)
    brdf = in_file(held, model, spread, misfit, KNOWN)
    predicted = brdf.evaluate(cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r)
    diagnostics = _diagnostics(work, final, verdict, chosen, best) | {"physics": physics}
    brdf = replace(brdf, fit=_told(diagnostics))
    return FitResult(
        brdf,
        model,
        cells,
        predicted,
        final.weight,
        work.stray,
        work.scales,
        spread,
        misfit,
        verdict,
        region,
        diagnostics,
    )


def _diagnostics(
    work: Cleaned, final: Fitted, verdict: Verdict, chosen: Candidate, best: Candidate
) -> dict[str, object]:
    """What was chosen and found, in plain JSON values."""
    return {
        "order": chosen.order,
        "order of best": best.order,
        "symmetry": verdict.plain(),
        "lobes": chosen.lobes.name,
        "prior strength": chosen.prior.strength,
        "prior decay": chosen.prior.decay,
        "residual scale": final.scale,
        "views left out": list(work.discordant),
        "contradiction": None if np.isnan(work.contradiction) else work.contradiction,
        "views rescaled": [work.cells.groups[g] for g in np.flatnonzero(work.scales.freed)],
        "binning error": _binning_error(work),
    }


def _is_empty(item: object) -> bool:
    return isinstance(item, list | tuple | np.ndarray) and len(item) == 0


def _told(value):
    """Diagnostics as the file tells them: four digits, and nothing of what was not asked or found."""
    if isinstance(value, dict):
        known = {key: _told(item) for key, item in value.items() if item is not None and not _is_empty(item)}
        return {key: item for key, item in known.items() if not (isinstance(item, dict) and not item)}
    if isinstance(value, list | tuple):
        return [_told(item) for item in value]
    return float(f"{value:.4g}") if isinstance(value, float) else value


def _binning_error(work: Cleaned) -> list[float]:
    """Root mean square over the cells of what binning had added, over that of the values; (c,)."""
    added = np.zeros_like(work.cells.value) if work.binning is None else work.binning
    size = np.sqrt(np.mean(work.cells.value**2, axis=0))
    return (np.sqrt(np.mean(added**2, axis=0)) / np.maximum(size, np.finfo(float).tiny)).tolist()


def error_of(model: Model, spread: Uncertainty, misfit: Misfit, cells: Cells) -> np.ndarray:
    """Standard error (n, c) of ``model`` at the directions of ``cells``, 1/sr, with what it misses systematically."""
    return np.hypot(spread.standard_error(model, cells), misfit.at(cells, model.evaluate(cells)))


def _padded(coefficients: np.ndarray, modes: int) -> np.ndarray:
    return np.pad(coefficients, ((0, modes - len(coefficients)), (0, 0)))


def _physical(
    brdf: Brdf, model: Model, spread: Uncertainty, misfit: Misfit, wanted: str
) -> tuple[Brdf, dict[str, object]]:
    """The BRDF, held to physics where that is wanted, and what it took. It has all modes that may move: those of
    models that predict as well."""
    if wanted == "off":
        return brdf, {"held": False}
    turning = model.turning
    if wanted == "auto":

        def error(cells: Cells) -> np.ndarray:
            return error_of(model, spread, misfit, cells)

        broken = violated_turning(brdf, error) if turning else violated(brdf, error(held_pairs()))
        if not broken:
            return brdf, {"held": False}
    own = spread.of_modes_alone()
    found = enforced_turning(brdf, own) if turning else enforced(brdf, own)
    if found is None:
        return brdf, {"held": False, "contradicted": True}
    said: dict[str, object] = {
        "least f": found.least,
        "largest albedo": found.albedo,
        "bounds": found.active,
        "standard errors moved": found.distance,
    }
    if wanted == "auto" and found.distance > MOST_MOVED:
        return brdf, {"held": False, "contradicted": True} | said
    if not found.active:
        return brdf, {"held": False} | said
    return replace(brdf, coefficients=found.coefficients), {"held": True} | said
