"""What comes of a fit: the BRDF in the file's terms, held to physics, how sure it is, and what led to it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import ndtri

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.words import lobe_in_words
from photogonio.reconstruct.estimate.lobe_search import Fitted
from photogonio.reconstruct.estimate.model import Model
from photogonio.reconstruct.estimate.model_discrepancy import Misfit, misfit_of
from photogonio.reconstruct.estimate.model_selection import Candidate
from photogonio.reconstruct.estimate.pilot import Cleaned
from photogonio.reconstruct.estimate.weights import ViewScales
from photogonio.reconstruct.model_choice import FitOptions
from photogonio.reconstruct.represent.as_found import lobes_of
from photogonio.reconstruct.represent.bounds import MOST_MOVED, enforced, held_pairs, raised, violated
from photogonio.reconstruct.represent.bounds_anisotropic import enforced_turning, violated_turning
from photogonio.reconstruct.represent.in_modes import SaidInModes, said_in_modes
from photogonio.reconstruct.rows.noise_told import FreshReading, noise_told
from photogonio.reconstruct.rows.unseen import raised_unseen
from photogonio.reconstruct.symmetry.verdict import Verdict
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.budget import Uncertainty
from photogonio.reconstruct.uncertainty.in_file import in_file
from photogonio.reconstruct.uncertainty.truncation import last_terms
from photogonio.reconstruct.uncertainty.validity import Region, region_of

KNOWN = 1.6  # a departure that is known is as many standard errors: an interval of 95 % just holds it
SAID_ELSEWHERE = ("order", "lobes")  # in the file
REASONS = ("reason", "reciprocity because")  # in words, which the report and --json have
MOST_LEVERAGE = 0.5  # of a row in what is said of it, where it is not known


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
    fresh: FreshReading | None = None  # of measured rows: how far a reading not seen may lie off

    def standard_error(self, cells: Cells) -> np.ndarray:
        """Of ``brdf`` (n, c) at the directions of ``cells``, 1/sr: of the model, of what it misses systematically,
        and of its being held to physics."""
        said = self.brdf.evaluate(cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r)
        departed = (said - self.model.evaluate(cells)) / KNOWN
        return np.hypot(error_of(self.model, self.uncertainty, self.misfit, cells), departed)

    def prediction_interval(self, cells: Cells, level: float = 0.95) -> tuple[np.ndarray, np.ndarray]:
        """Between what and what, (n, c) each, 1/sr, a fresh reading at the directions of ``cells`` lies with
        probability ``level``: of how sure f is, and of the rows' noise.

        Raises TypeError where photos were fitted, whose cells are no single readings.
        """
        if self.fresh is None:
            raise TypeError("photos have no rows, of which to predict another")
        said = self.brdf.evaluate(cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r)
        half = float(ndtri(0.5 + 0.5 * level)) * self.fresh.deviation(cells, said, self.standard_error(cells))
        return said - half, said + half


def result_of(
    work: Cleaned,
    final: Fitted,
    spread: Uncertainty,
    verdict: Verdict,
    candidates: tuple[Candidate, Candidate],
    options: FitOptions,
    fresh: FreshReading | None = None,
) -> FitResult:
    """The result, by the chosen candidate and the best; ``fresh`` is what is known of readings not seen, of an average
    of measured rows."""
    averaged = None if fresh is None else True
    chosen, best = candidates
    model, cells = final.model, work.cells
    last = None if averaged else last_terms(final, cells, work.deviation, chosen.prior)
    misfit = misfit_of(cells, model.evaluate(cells), work.binning, last)
    region = region_of(lambda where, said: error_of(model, spread, misfit, where, said), model, cells)
    plain = Brdf(
        order=spread.basis.order,
        channels=cells.channels,
        modes=spread.basis.modes,
        coefficients=_padded(model.coefficients, spread.modes),
        standard_errors=np.zeros((spread.modes, len(cells.channels))),
        quantity=spread.basis.quantity,
        symmetry=spread.basis.symmetry,
        lobes=lobes_of(model),
        scale="absolute" if options.absolute else "relative",
        valid=region.valid(),
    )
    held, physics = _physical(plain, model, spread, misfit, options.physics)
    raised_by = None
    if not cells.binned and options.physics != "off" and "contradicted" not in physics:
        held, raised_by = raised_unseen(held, cells, spread.of_modes_alone())
    said = _said(in_file(held, model, spread, misfit, KNOWN), options.physics)
    brdf = said.brdf
    if all(family.retro for family in model.lobes.families):
        verdict = verdict.of_matte()
    predicted = brdf.evaluate(cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r)
    if fresh is None and not cells.binned:
        unknowns = len(model.coefficients) + len(model.lobe_coefficients)
        leverage = np.full(len(cells), min(unknowns / len(cells), MOST_LEVERAGE))
        noise = noise_told(cells, predicted, leverage)
        fresh = FreshReading(noise, np.ones(len(cells.channels)))
    own = {
        "physics": physics,
        "raised where unseen": raised_by,
        "fresh reading": None if fresh is None else fresh.plain(),
        "said in modes": _peaks_told(said),
        "averaged": averaged,
        "asked": options.asked(),
    }
    diagnostics = _diagnostics(work, final, verdict, chosen, best) | own
    told = {key: item for key, item in diagnostics.items() if key not in SAID_ELSEWHERE}
    told["symmetry"] = {key: item for key, item in verdict.plain().items() if key not in REASONS}
    brdf = replace(brdf, fit=_told(told))
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
        fresh,
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


def _said(brdf: Brdf, wanted: str) -> SaidInModes:
    """The BRDF with peaks that the file has no lobe for in modes, that end: physics has its say again."""
    said = said_in_modes(brdf)
    return replace(said, brdf=raised(said.brdf)) if said.peaks and wanted != "off" else said


def _peaks_told(said: SaidInModes) -> dict[str, object] | None:
    """Of peaks that the file has no lobe for; None where there are none."""
    if not said.peaks:
        return None
    return {"peaks": [lobe_in_words(peak) for peak in said.peaks], "lost": said.lost}


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


def error_of(
    model: Model, spread: Uncertainty, misfit: Misfit, cells: Cells, said: np.ndarray | None = None
) -> np.ndarray:
    """Standard error (n, c) of ``model`` at the directions of ``cells``, 1/sr, with what it misses systematically;
    ``said`` (n, c) is what it says there, if that is known."""
    said = model.evaluate(cells) if said is None else said
    return np.hypot(spread.standard_error(model, cells, said), misfit.at(cells, said))


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
