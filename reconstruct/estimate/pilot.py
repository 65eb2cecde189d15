"""Cells freed of stray light and of their views' errors of scale, and the pilot fits that found both."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from photogonio.reconstruct.estimate.binning_error import blur, displaced
from photogonio.reconstruct.estimate.lobe_search import (
    SEARCH_CELLS,
    Fitted,
    search_lobes,
    starting_shape,
    thinned,
)
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.model_selection import Prior
from photogonio.reconstruct.estimate.narrow_gloss import evenly
from photogonio.reconstruct.estimate.outlier_views import apart, contradiction, discordant
from photogonio.reconstruct.estimate.weights import FREE, STRAY_DOUBT, ViewScales, error_model, view_scales
from photogonio.reconstruct.lobes.families import (
    Family,
    blinn_phong_lobe,
    families,
    retro_lobe,
    round_lobe,
    second_lobe,
    tail_lobe,
)
from photogonio.reconstruct.table.cells import Cells

PILOT_ORDER = 4
PILOT_PRIOR = Prior(strength=0.1, decay=1.0)
PILOT_TOLERANCE = 3e-3  # of the logarithms of lobe shapes
ROUNDS = 3  # stray light from a model of the surface, and the model without it
ROUNDS_OF_PEAKS = 8  # likewise, of what blurs a narrow peak
SETTLED = 0.05  # rms over the cells, of their errors
SETTLED_SCALE = 1e-3  # of a view's scale
START = 0.25  # roughness
LIKELIEST = 4  # pilots with one lobe that are tried further
TWO_TOLD = 0.02  # of mean log likelihood a value: by which photos tell two lobes from one
TELLING = 0.1  # relative error of a cell that can contradict others
ENOUGH = 0.05  # share of the cells
BLUR_DOUBT = 0.05  # of what was removed as a narrow peak's blur, which is known better than to second order
MOST_DISCORDANT = 0.3  # of the views; more cannot be the odd ones out

NARROWEST = 0.045  # roughness of a peak said in modes; modes of the highest order leave a twentieth of it out

StrayLightOn = Callable[[Cells, Model], np.ndarray]  # (n, c) 1/sr that stray light adds to the cells' values
Progress = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Cleaned:
    """Cells to fit, and candidate lobes."""

    cells: (
        Cells  # stray light, binning error and the lamps' size removed, freed views divided by their scales
    )
    deviation: np.ndarray  # (n, c) error model, up to a factor
    stray: np.ndarray  # (n, c) stray light removed, 1/sr
    scales: ViewScales
    pilots: tuple[Fitted, ...]  # on thinned cells
    binning: np.ndarray | None = None  # (n, c) binning error and the lamps' size removed, 1/sr
    contradiction: float = (
        np.nan
    )  # of the views that are left: photogonio.reconstruct.estimate.outlier_views.contradiction
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
    kinds: Sequence[LobeSet] | None = None,
    free_peaks: bool = False,
    rounds: int = ROUNDS,
    stray: StrayLightOn | None = None,
    progress: Progress = lambda stage: None,
) -> Cleaned:
    """Remove stray light, binning error, the lamps' size and errors of scale, by turns with pilot fits of every lobe.

    ``view_errors`` (g,) are relative standard errors of the views' scales; ``lobes`` is how many were asked for,
    None for any; ``kinds`` are the lobes to try, None for the isotropic ones, with peaks that only modes can
    say if ``free_peaks``.
    """
    progress("pilot fits")
    kinds = _kinds(lobes, absolute, binned=seen.binned, free_peaks=free_peaks) if kinds is None else kinds
    left_out, doubt = np.zeros(len(seen.groups), bool), seen.doubt
    scales = ViewScales.none(view_errors)
    light = added = doubted = np.zeros_like(seen.value)
    work = _piloted(seen, added, doubted, scales, kinds)
    if stray is not None:
        likelier = _with_its_own_light(seen, work, scales, stray)
        if likelier is not None:
            light = added = doubted = likelier.stray
            work = _piloted(seen, added, doubted, scales, _with(kinds, likelier))
    many_views = len(np.unique(seen.group)) > 1
    turns = rounds if many_views or stray is not None or seen.binned else 0
    if seen.peaked:  # what blurs a peak depends on its core and its tails
        work = _with_second_lobe(work, lobes, absolute)
    if stray is not None:
        progress("stray light")
    for _ in range(max(turns, ROUNDS_OF_PEAKS) if seen.peaked else turns):
        reference = work.reference.model
        if stray is not None:
            light = stray(work.cells, reference)
        blurred = blur(seen, reference)
        if seen.peaked and not reference.turning:
            told = 0.0 if doubt is None else doubt
            seen = replace(seen, doubt=np.hypot(told, displaced(seen, reference)))
        added, before = light + blurred, (added, scales.factor)
        doubted = light + _doubted(seen, blurred)
        if many_views:
            believed = np.where(scales.freed, FREE, view_errors)  # a view found wrong pulls no more
            scales = _scales(seen.with_value(seen.value - added), doubted, reference, view_errors, believed)
        if _settled(added - before[0], scales.factor - before[1], work.deviation):
            break
        work = _piloted(seen, added, doubted, scales, [reference.lobes], anew=False)
        odd = discordant(*_few(work))
        if (left_out | odd).sum() <= MOST_DISCORDANT * len(np.unique(seen.group)) and odd.any():
            left_out |= odd
            keep = ~odd[seen.group]
            doubt = None if doubt is None else doubt[keep]
            seen, light, added, doubted = (
                seen.take(keep),
                light[keep],
                added[keep],
                doubted[keep],
            )
            work = _piloted(seen, added, doubted, scales, _with(kinds, work))
    if turns:
        work = _piloted(seen, added, doubted, scales, _with(kinds, work))
    work, single = _with_second_lobe(work, lobes, absolute), work.reference.cost
    for _ in range(turns if seen.peaked or work.reference.cost < single - TWO_TOLD else 0):
        blurred = blur(seen, work.reference.model)
        added, doubted = light + blurred, light + _doubted(seen, blurred)
        work = _piloted(seen, added, doubted, scales, [one.model.lobes for one in work.pilots], anew=False)
    return replace(
        work,
        stray=light,
        binning=added - light,
        contradiction=contradiction(*_few(work)),
        discordant=tuple(np.array(seen.groups)[left_out]),
    )


def _with(kinds: Sequence[LobeSet], work: Cleaned) -> list[LobeSet]:
    """``kinds`` and the likeliest lobe so far, which is not dropped for having been found another way; two lobes are
    found again from one."""
    likeliest = work.reference.model.lobes
    known = len(likeliest.families) != 1 or any(one.families == likeliest.families for one in kinds)
    return [*kinds] if known else [*kinds, likeliest]


def _with_its_own_light(
    seen: Cells, work: Cleaned, scales: ViewScales, stray: StrayLightOn
) -> Cleaned | None:
    """The likeliest interface and the light of the surroundings that it sends on, where the likeliest pilot is a peak
    that is as high at any incidence, and is no longer so once each has its own light taken off; None elsewhere.

    Of a metal ball a paper lights more than half as much as the lamp does. Such a peak sends on a third of that, and
    what it leaves makes it the likelier.
    """
    first, *others = _by_cost(work.pilots)
    interfaces = [one for one in others if one.model.lobes.families and not _is_peak(one)]
    if not _is_peak(first) or not interfaces:
        return None
    rivals = first, interfaces[0]
    lights = [stray(seen, one.model) for one in rivals]
    deviation = error_model(seen, np.maximum(*lights))  # the same, so that likelihoods compare
    found = []
    for one, light in zip(rivals, lights, strict=True):
        freed = Cleaned(seen.with_value(seen.value - light), deviation, light, scales, ())
        found.append(replace(freed, pilots=(_pilot(freed, one.model.lobes, 0),)))
    return found[1] if found[1].reference.cost < found[0].reference.cost else None


def _is_peak(pilot: Fitted) -> bool:
    """Whether its one gloss is a peak about the mirror direction or the normal, of no interface."""
    return any(family.peak and not family.retro for family in pilot.model.lobes.families)


def _doubted(cells: Cells, blurred: np.ndarray) -> np.ndarray:
    """(n, c) stray light that would be as little known as the blur removed."""
    return BLUR_DOUBT / STRAY_DOUBT * blurred if cells.peaked else blurred


def _settled(added: np.ndarray, factor: np.ndarray, deviation: np.ndarray) -> bool:
    """Whether changes (n, c) of what is removed and (g,) of the views' scales are nothing beside the errors."""
    return bool(np.mean((added / deviation) ** 2) < SETTLED**2 and np.abs(factor).max() < SETTLED_SCALE)


def _few(work: Cleaned) -> tuple[Cells, np.ndarray]:
    """Some of the cells, and what the likeliest pilot says of them: of those that are surer than :data:`TELLING`, if
    there are enough, since what is all but black agrees with nothing."""
    chosen = evenly(work.cells, SEARCH_CELLS)
    few, deviation = work.cells.take(chosen), work.deviation[chosen]
    predicted = work.reference.model.evaluate(few)
    sure = deviation.mean(1) <= TELLING * np.abs(predicted).mean(1)
    return (few.take(sure), predicted[sure]) if sure.mean() > ENOUGH else (few, predicted)


def _kinds(lobes: int | None, absolute: bool, *, binned: bool, free_peaks: bool) -> list[LobeSet]:
    """Lobes to start from, and peaks that the file says in modes, which no microfacets follow toward grazing: one round
    about the mirror direction, and for photos a cosine power of the half vector (averages of models do without)."""
    if lobes == 0:
        return [LobeSet()]
    kinds = [*families(absolute=absolute), retro_lobe(absolute=absolute)]
    if free_peaks:
        kinds += [blinn_phong_lobe(absolute=absolute)] if binned else []
        kinds.append(round_lobe(absolute=absolute).with_beckmann)
    single = [_alone(family) for family in kinds]
    return single if lobes else [LobeSet(), *single]


def _can_be_said(pilot: Fitted) -> bool:
    """Whether no peak is too narrow for modes that must say it."""
    lobes = pilot.model.lobes
    return all(
        family.about == "light" or shape[0] >= NARROWEST
        for family, shape in zip(lobes.families, lobes.shapes, strict=True)
    )


def _alone(family: Family) -> LobeSet:
    return LobeSet((family,), (starting_shape(family, START),))


def _without_tails(work: Cleaned, pilots: Sequence[Fitted]) -> list[Fitted]:
    """Pilots of Beckmann's form of the likeliest lobe and, if that is likelier, of the likeliest of the other kind of
    Fresnel's term: where tails are wrong, which of the kinds with tails does best says little. Measured rows, which
    may hold next to nothing but tails, are tried with both."""
    single = sorted((one for one in pilots if len(one.model.lobes.families) == 1), key=lambda one: one.cost)
    tried: list[Fitted] = []
    for one in single:
        family = one.model.lobes.families[0]
        if family.distribution != "ggx" or any(
            family.fresnel == other.model.lobes.families[0].fresnel for other in tried
        ):
            continue
        tried.append(_pilot(work, _alone(family.with_beckmann), None))
        if work.cells.binned and tried[0].cost >= single[0].cost:
            break
    return tried


def _scales(
    cells: Cells, doubted: np.ndarray, reference: Model, view_errors: np.ndarray, believed: np.ndarray
) -> ViewScales:
    deviation = error_model(cells, doubted)
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
    return view_scales(cells, predicted, deviation * fitted.scale, fitted.weight, view_errors, apart)


def _piloted(
    seen: Cells,
    added: np.ndarray,
    doubted: np.ndarray,
    scales: ViewScales,
    starts: Sequence[LobeSet],
    *,
    anew: bool = True,
) -> Cleaned:
    cells = seen.with_value((seen.value - added) / scales.factor[seen.group, None])
    deviation = error_model(cells, doubted)
    work = Cleaned(cells, deviation, added, scales, ())
    pilots = [_pilot(work, lobes, None if anew else 0) for lobes in starts]
    if anew:
        pilots = [one for one in pilots if _can_be_said(one)]
        pilots += _without_tails(work, pilots)
    return replace(work, pilots=tuple(pilots))


def _pilot(work: Cleaned, lobes: LobeSet, free: int | None) -> Fitted:
    few, deviation = thinned(work.cells, work.deviation)
    basis = Basis("isotropic", PILOT_ORDER)
    return search_lobes(
        few,
        deviation,
        basis,
        PILOT_PRIOR,
        lobes,
        free=free,
        tolerance=PILOT_TOLERANCE,
        view_errors=work.scales.error,
    )


def _with_second_lobe(work: Cleaned, lobes: int | None, absolute: bool) -> Cleaned:
    """The pilots that are worth trying, and the likeliest lobe with each kind of second one."""
    first = work.reference.model.lobes
    pilots = _likeliest(work.pilots)
    if len(first.families) == 1 and lobes in (None, 2):
        for family in _seconds(first.families[0], absolute):
            both = LobeSet((*first.families, family), (*first.shapes, starting_shape(family, START)))
            pilots.append(_pilot(work, both, 1))
        coats = [one.model.lobes for one in _by_cost(work.pilots) if _is_coat(one.model.lobes)]
        told = min(one.cost for one in pilots) < work.reference.cost - TWO_TOLD and work.cells.binned
        # though Fresnel's term be another's, which a few views hardly tell
        if coats and (work.cells.peaked or told):
            pilots.append(_pilot(work, _core_and_tails(coats[0], absolute), 1))
    return replace(work, pilots=tuple(one for one in pilots if not _hides(one)))


def _hides(pilot: Fitted) -> bool:
    """Whether one of two lobes of a whole interface reflects nothing straight down: the other is the gloss, and what
    is left of this one is its rise toward grazing, made so narrow that no cell sees it."""
    families = pilot.model.lobes.families
    ends = np.cumsum([len(family.upper_bounds()) for family in families])
    return len(families) > 1 and any(
        family.absolute and not family.has_ground and not own.any()
        for family, own in zip(families, np.split(pilot.model.lobe_coefficients, ends[:-1]), strict=True)
    )


def _by_cost(pilots: Sequence[Fitted]) -> list[Fitted]:
    return sorted(pilots, key=lambda one: one.cost)


def _is_coat(lobes: LobeSet) -> bool:
    """Whether it is one lobe of a dielectric over a ground, alike along all axes."""
    return len(lobes.families) == 1 and lobes.families[0].has_ground and not lobes.turning


def _core_and_tails(lobes: LobeSet, absolute: bool) -> LobeSet:
    """A gloss of one interface whose slopes are of two kinds, each a part of the surface."""
    core, tail = replace(lobes.families[0], absolute=False), tail_lobe(absolute=absolute)
    return LobeSet((core, tail), (lobes.shapes[0][:1], starting_shape(tail, START)))


def _seconds(first: Family, absolute: bool) -> tuple[Family, ...]:
    mirror = second_lobe(absolute=absolute)
    return (mirror,) if first.retro else (mirror, retro_lobe(absolute=absolute))


def _likeliest(pilots: Sequence[Fitted]) -> list[Fitted]:
    """The pilot without a lobe and the :data:`LIKELIEST` with one, in the order in which they were tried."""
    plain = [one for one in pilots if not one.model.lobes.families]
    single = [one for one in pilots if one.model.lobes.families]
    kept = sorted(single, key=lambda one: one.cost)[:LIKELIEST]
    return plain + [one for one in single if any(one is other for other in kept)]
