"""What comes of a fit: a BRDF in the file's terms, held to physics where asked, and errors that own up to it."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np

from photogonio.reconstruct.estimate.lobe_search import Fitted
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.model_discrepancy import Misfit
from photogonio.reconstruct.estimate.model_selection import Candidate, Prior
from photogonio.reconstruct.fit_result import KNOWN, FitResult, error_of, result_of
from photogonio.reconstruct.model_choice import FitOptions
from photogonio.reconstruct.represent.bounds import MOST_MOVED, TRIFLE
from photogonio.reconstruct.symmetry.verdict import Verdict
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.reconstruct.table.goniometer_csv import samples_table
from photogonio.reconstruct.uncertainty.budget import Uncertainty
from tests.drawn.fits import cleaned
from tests.drawn.goniometer import matte, measured, scattered

BASIS = Basis("isotropic", 2)
ROWS = cells_of(samples_table(measured(matte(0.5), scattered(80), noise=0.0)))


def model_of(*coefficients: float) -> Model:
    own = np.zeros((len(BASIS.modes), 1))
    own[: len(coefficients), 0] = coefficients
    return Model(BASIS, own, LobeSet(), np.empty((0, 1)))


def spread(size: float = 0.01) -> Uncertainty:
    return Uncertainty(BASIS, size**2 * np.eye(len(BASIS.modes))[None], 0, 1e6)


def result(model: Model, size: float = 0.01, *, binned: float = 0.0, **options) -> FitResult:
    """Of rows that are just what the model says, whose coefficients have standard errors of ``size``, and to which
    binning had added the share ``binned``."""
    work = cleaned(ROWS.with_value(model.evaluate(ROWS)))
    work = replace(work, binning=binned * work.cells.value)
    none = np.zeros_like(ROWS.value)
    final = Fitted(model, none, none, none + 1.0, 0.12345678, 1.0)
    chosen = Candidate(2, Prior(0.3, 1.0), LobeSet(), np.zeros(1))
    verdict = Verdict("isotropic", "asked for")
    return result_of(work, final, spread(size), verdict, (chosen, chosen), FitOptions(**options))


def test_the_error_of_f_is_of_the_model_and_of_what_it_misses():
    model = model_of(1.0)
    misfit = Misfit(np.zeros((1, 4)), np.full((1, 1), 0.03), np.full(1, 1e-3))
    said = error_of(model, spread(), misfit, ROWS)
    own = spread().standard_error(model, ROWS)
    np.testing.assert_allclose(said, np.hypot(own, 0.03 * model.evaluate(ROWS)), rtol=1e-12)


def test_the_result_says_what_the_model_says():
    model = model_of(1.0, 0.02)
    found = result(model, physics="off")
    np.testing.assert_allclose(found.predicted, model.evaluate(ROWS), rtol=1e-4)
    at = found.brdf.evaluate(ROWS.theta_i, ROWS.phi_i, ROWS.theta_r, ROWS.phi_r)
    np.testing.assert_array_equal(at, found.predicted)
    assert found.brdf.scale == "absolute" and found.brdf.symmetry == "isotropic"
    assert result(model, physics="off", absolute=False).brdf.scale == "relative"


def test_diagnostics_are_plain_and_told_in_four_digits():
    found = result(model_of(1.0), physics="off")
    assert found.diagnostics["order"] == 2 and found.diagnostics["physics"] == {"held": False}
    assert json.loads(json.dumps(found.diagnostics))["residual scale"] == 0.12345678
    assert found.brdf.fit["residual scale"] == 0.1235
    assert "views left out" not in found.brdf.fit  # of nothing found nothing is told


def test_the_binning_error_is_told_relative_to_the_values():
    """Of values that binning had raised by three per cent throughout, in each channel."""
    found = result(model_of(1.0), binned=0.03, physics="off")
    np.testing.assert_allclose(found.diagnostics["binning error"], 0.03, rtol=1e-9)


def dark() -> Model:
    """Below zero where both directions are steep: S_20^0 is least there."""
    return model_of(0.3, 0.0, 0.6)


def least(found: FitResult) -> float:
    theta = np.linspace(0.0, np.radians(80.0), 30)
    i, r = (a.ravel() for a in np.meshgrid(theta, theta))
    return float(found.brdf.evaluate(i, 0.0, r, 1.0).min())


def test_f_is_held_to_physics_if_asked_and_its_error_owns_up_to_that():
    free, held = result(dark(), physics="off"), result(dark(), physics="on")
    trifle = TRIFLE * np.abs(held.predicted).mean()  # between the pairs that are held
    assert least(free) < -0.1 and least(held) > -2.0 * trifle
    assert held.diagnostics["physics"]["held"] and not free.diagnostics["physics"]["held"]
    # what a departure is worth: as many standard errors as an interval of 95 % just holds
    there = Cells.of_angles(*np.radians([[75.0], [75.0], [60.0]]))
    moved = held.brdf.evaluate(there.theta_i, 0.0, there.theta_r, there.dphi) - dark().evaluate(there)
    own = error_of(dark(), spread(), held.misfit, there)
    np.testing.assert_allclose(held.standard_error(there), np.hypot(own, moved / KNOWN), rtol=1e-9)
    assert np.abs(moved) > own


def test_of_itself_f_is_held_where_it_is_unphysical_beyond_its_error_and_need_not_move_far():
    assert result(model_of(1.0)).diagnostics["physics"] == {"held": False}
    unsure, sure, none = (result(dark(), size).diagnostics["physics"] for size in (0.05, 0.005, 1.0))
    assert unsure["held"] and unsure["standard errors moved"] <= MOST_MOVED
    # data that would have to move further contradict physics, and are not bent
    assert sure["contradicted"] and not sure["held"] and sure["standard errors moved"] > MOST_MOVED
    assert none == {"held": False}  # below zero by less than nobody knows


def test_unsure_modes_that_are_not_the_models_are_listed_with_none_of_it():
    found = result(
        replace(model_of(1.0), basis=Basis("isotropic", 1), coefficients=np.full((2, 1), 0.5)), physics="off"
    )
    assert len(found.brdf.modes) == 2 and found.brdf.order == 1
    assert found.uncertainty.modes == len(BASIS.modes)
    np.testing.assert_allclose(found.brdf.coefficients, 0.5)
