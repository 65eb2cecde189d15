"""Cells freed of stray light and of their views' errors of scale, and the pilot fits that found both."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from reconstruct.basis import Basis
from reconstruct.binning import binning
from reconstruct.cells import Cells
from reconstruct.microfacet import families, second_lobe
from reconstruct.model import LobeSet, Model
from reconstruct.robust import FREE, ViewScales, error_model, level, view_scales
from reconstruct.search import Fitted, search_lobes, starting_shape, thinned
from reconstruct.select import Prior

PILOT_ORDER = 4
PILOT_PRIOR = Prior(strength=0.1, decay=1.0)
ROUNDS = 3  # stray light from a model of the surface, and the model without it
START = 0.25  # roughness
DISCORD = 4.0  # times the misfit of the middle view
WORST = 0.5  # of the largest misfit: the worst go first, since they spoil the pilot for the others
LEAST_DISCORD = 0.02  # relative misfit below which no view is suspected
MOST_DISCORDANT = 0.3  # of the views; more cannot be the odd ones out
FEWEST_TO_JUDGE = 5  # views

StrayLightOn = Callable[[Cells, Model], np.ndarray]  # (n, c) 1/sr that stray light adds to the cells' values
Progress = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Cleaned:
    """Cells to fit, and candidate lobes."""

    cells: Cells  # stray light and binning error removed, freed views divided by their scales
    deviation: np.ndarray  # (n, c) error model, up to a factor
    stray: np.ndarray  # (n, c) stray light removed, 1/sr
    scales: ViewScales
    pilots: tuple[Fitted, ...]  # on thinned cells
    discordant: tuple[str, ...] = ()  # views left out: what they show is not what all others show

    @property
    def reference(self) -> Fitted:
        """The likeliest pilot."""
        return min(self.pilots, key=lambda one: one.cost)


def clean(
    seen: Cells,
    view_errors: np.ndarray,
    *,
    lobes: int | None,
    absolute: bool,
    stray: StrayLightOn | None = None,
    progress: Progress = lambda stage: None,
) -> Cleaned:
    """Remove stray light, binning error and errors of scale, by turns with pilot fits of every kind of lobe.

    ``view_errors`` (g,) are relative standard errors of the views' scales; ``lobes`` is how many were asked for,
    None for any.
    """
    progress("pilot fits")
    discordant = np.zeros(len(seen.groups), bool)
    scales = ViewScales.none(view_errors)
    light = added = np.zeros_like(seen.value)
    work = _piloted(seen, added, scales, _kinds(lobes, absolute))
    many_views = len(np.unique(seen.group)) > 1
    for _ in range(ROUNDS if many_views or stray is not None or seen.binned else 0):
        reference = work.reference.model
        if stray is not None:
            progress("stray light")
            light = stray(work.cells, reference)
        added = light + binning(work.cells, reference)
        if many_views:
            believed = np.where(scales.freed, FREE, view_errors)  # a view found wrong pulls no more
            scales = _scales(seen.with_value(seen.value - added), added, reference, view_errors, believed)
        work = _piloted(seen, added, scales, [reference.lobes], anew=False)
        odd = _discordant(work)
        if (discordant | odd).sum() <= MOST_DISCORDANT * len(np.unique(seen.group)) and odd.any():
            discordant |= odd
            keep = ~odd[seen.group]
            seen, light, added = seen.take(keep), light[keep], added[keep]
            work = _piloted(seen, added, scales, _kinds(lobes, absolute))
    work = _with_second_lobe(_piloted(seen, added, scales, _kinds(lobes, absolute)), lobes, absolute)
    return replace(work, stray=light, discordant=tuple(np.array(seen.groups)[discordant]))


def _discordant(work: Cleaned) -> np.ndarray:
    """(g,) bool: views whose cells miss the likeliest pilot by far more than those of other views, whatever their
    scale: a light or a pose that is wrong, a shadow, a photo of something else."""
    model, cells = work.reference.model, work.cells
    predicted = np.maximum(model.evaluate(cells), 1e-3 * level(cells))
    ratio = cells.value / predicted
    views = np.unique(cells.group)
    typical = np.array([_scatter(ratio[cells.group == view]) for view in views])
    odd = typical > max(DISCORD * float(np.median(typical)), LEAST_DISCORD, WORST * float(typical.max()))
    result = np.zeros(len(cells.groups), bool)
    result[views[odd]] = len(views) >= FEWEST_TO_JUDGE
    return result


def _scatter(ratio: np.ndarray) -> float:
    """Typical departure of the ratios (n, c) of one view from their median, relative."""
    middle = np.maximum(np.median(ratio, axis=0), np.finfo(float).tiny)
    return float(np.median(np.abs(ratio / middle - 1.0).mean(1)))


def _kinds(lobes: int | None, absolute: bool) -> list[LobeSet]:
    single = [LobeSet((f,), (starting_shape(f, START),)) for f in families(absolute=absolute)]
    if lobes == 0:
        return [LobeSet()]
    return single if lobes else [LobeSet(), *single]


def _scales(
    cells: Cells, added: np.ndarray, reference: Model, view_errors: np.ndarray, believed: np.ndarray
) -> ViewScales:
    deviation = error_model(cells, added)
    fitted = search_lobes(
        cells,
        deviation,
        reference.basis,
        PILOT_PRIOR,
        reference.lobes,
        free=0,
        refine=False,
        view_errors=believed,
    )
    predicted = cells.value - fitted.residual
    return view_scales(cells, predicted, deviation * fitted.scale, fitted.weight, view_errors)


def _piloted(
    seen: Cells, added: np.ndarray, scales: ViewScales, starts: Sequence[LobeSet], *, anew: bool = True
) -> Cleaned:
    cells = seen.with_value((seen.value - added) / scales.factor[seen.group, None])
    deviation = error_model(cells, added)
    few, few_deviation = thinned(cells, deviation)
    basis = Basis("isotropic", PILOT_ORDER)
    free = None if anew else 0
    pilots = [
        search_lobes(few, few_deviation, basis, PILOT_PRIOR, lobes, free=free, view_errors=scales.error)
        for lobes in starts
    ]
    return Cleaned(cells, deviation, added, scales, tuple(pilots))


def _with_second_lobe(work: Cleaned, lobes: int | None, absolute: bool) -> Cleaned:
    first = work.reference.model.lobes
    if len(first.families) != 1 or lobes not in (None, 2):
        return work
    family = second_lobe(absolute=absolute)
    both = LobeSet((*first.families, family), (*first.shapes, starting_shape(family, START)))
    few, deviation = thinned(work.cells, work.deviation)
    basis = Basis("isotropic", PILOT_ORDER)
    second = search_lobes(few, deviation, basis, PILOT_PRIOR, both, free=1, view_errors=work.scales.error)
    return Cleaned(work.cells, work.deviation, work.stray, work.scales, (*work.pilots, second))
