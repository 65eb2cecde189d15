"""Beyond rows a surface goes on as it was last seen and is nowhere negative, and what rows determine stays."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.weights import error_model
from photogonio.reconstruct.fit import fit_table
from photogonio.reconstruct.rows.row_average import average_of
from photogonio.reconstruct.rows.row_models import uncertainty_of_average
from photogonio.reconstruct.rows.row_noise import with_noise
from photogonio.reconstruct.rows.unseen import (
    HIGHEST,
    MOST_MOVED,
    TRIFLE,
    raised_unseen,
    steadiness,
    steepest,
    unseen_pairs,
)
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.reconstruct.table.goniometer_csv import samples_table
from tests.drawn.goniometer import SATIN, glossy, matte, measured, scattered

ORDER, TOP = 6, np.radians(70.0)
ROWS = 150


def table(surface, noise: float = 0.02, rows: int = ROWS, seed: int = 1):
    theta_i, theta_r, dphi = scattered(4 * rows, seed)
    low = np.flatnonzero(np.maximum(theta_i, theta_r) < TOP)[:rows]
    return samples_table(measured(surface, (theta_i[low], theta_r[low], dphi[low]), noise=noise, seed=seed))


def beyond(step: float = 3.0, highest: float = 88.0) -> Cells:
    """Pairs of which one is steeper than any row."""
    theta, dphi = np.radians(np.arange(1.0, highest + 0.1, step)), np.radians(np.arange(0.0, 180.1, 5.0))
    i, r, d = (a.ravel() for a in np.meshgrid(theta, theta, dphi, indexing="ij"))
    far = np.maximum(i, r) > TOP
    return Cells.of_angles(i[far], r[far], d[far])


def brdf_of(coefficients: np.ndarray, order: int) -> Brdf:
    return Brdf(
        order=order,
        channels=("Y",),
        modes=Basis("isotropic", order).modes,
        coefficients=coefficients,
        standard_errors=np.zeros_like(coefficients),
        symmetry="isotropic",
        scale="absolute",
    )


def test_steadiness_is_of_what_modes_do_beyond_rows_alone():
    form = steadiness(ORDER, TOP)
    assert np.linalg.eigvalsh(form).min() > -1e-12 * np.abs(form).max()
    assert (form[0] == 0.0).all()  # the Lambertian mode is the same everywhere
    assert (np.diag(form)[1:] > 0.0).all()
    assert not steadiness(ORDER, HIGHEST).any()
    # the nearer to the horizon rows go, the less changes beyond them
    assert np.trace(steadiness(ORDER, np.radians(85.0))) < np.trace(form)


def test_unseen_pairs_are_those_without_rows_beside_them():
    cells = cells_of(table(matte(0.5)))
    found = unseen_pairs(cells, turning=False)
    assert steepest(cells) < TOP < found.theta_i.max() == pytest.approx(HIGHEST)
    pairs = unseen_pairs(found, turning=False)
    assert len(pairs) < 0.1 * len(found)  # rows there, there and nowhere else
    assert len(unseen_pairs(cells, turning=True)) == 4 * len(found)


@pytest.mark.parametrize("seed", range(3))
def test_an_average_goes_on_beyond_the_rows_as_it_was_last_seen(seed):
    """A surface that changes slowly stays within what its noise, 2 %, and the modes' say on it leave: a tenth."""
    cells = with_noise(cells_of(table(glossy(0.4, 0.1, 2.0), seed=seed)))
    average = average_of(cells, error_model(cells), ORDER)
    at = beyond()
    said = average.model.evaluate(at)[:, 0]
    true = glossy(0.4, 0.1, 2.0)(at.theta_i, at.theta_r, at.dphi)
    assert np.sqrt(np.mean((said / true - 1.0) ** 2)) < 0.1
    # it is stated as unseen: its errors there are larger than where rows are
    spread = uncertainty_of_average(average)
    assert (
        spread.standard_error(average.model, at).mean()
        > 3.0 * spread.standard_error(average.model, cells).mean()
    )


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("surface", [SATIN, glossy(0.05, 0.3, 40.0)], ids=["satin", "dark gloss"])
def test_a_fit_is_not_negative_where_nothing_was_seen(surface, seed):
    """To a tenth of the mean, which it may be between the pairs that are held."""
    given = table(surface, noise=0.05, seed=seed)
    fit = fit_table(given)
    at = beyond()
    value = fit.brdf.evaluate(at.theta_i, at.phi_i, at.theta_r, at.phi_r)
    assert value.min() > -0.1 * fit.cells.value.mean()


def test_values_below_zero_are_raised_where_no_row_is_and_rows_stay():
    """Modes that fall below 0 toward the horizon, known by rows to 70 degrees with a standard deviation of 5 %."""
    cells, basis = cells_of(table(matte(0.5))), Basis("isotropic", ORDER)
    design = basis.design(cells)
    at = unseen_pairs(cells, turning=False)
    dark = np.linalg.lstsq(
        np.vstack([design, basis.design(at)]),
        np.concatenate([np.full(len(cells), 0.5), np.where(at.theta_i > np.radians(84.0), -0.3, 0.5)]),
        rcond=None,
    )[0][:, None]
    brdf = brdf_of(dark, ORDER)
    assert brdf.evaluate(at.theta_i, 0.0, at.theta_r, at.dphi).min() < -0.1
    gram = design.T @ design / 0.025**2 + 0.01 * np.eye(len(basis.modes))
    covariance = np.linalg.inv(gram)[None]
    raised, told = raised_unseen(brdf, cells, covariance)
    value = raised.evaluate(at.theta_i, 0.0, at.theta_r, at.dphi)
    assert value.min() > -TRIFLE * np.abs(cells.value).mean()
    assert told is not None and told["least f"] < -0.1 and told["standard errors moved"] <= MOST_MOVED
    change = design @ (raised.coefficients - brdf.coefficients)
    error = np.sqrt(np.einsum("np,pq,nq->n", design, covariance[0], design))
    size = told["standard errors moved"] * np.sqrt(told["bounds"])  # Cauchy and Schwarz
    assert (np.abs(change[:, 0]) <= (1.0 + 1e-6) * size * error).all()
    # modes that are known exactly are not bent, and what is nowhere negative stays
    assert raised_unseen(brdf, cells, 1e-8 * covariance)[0] is brdf
    again, nothing = raised_unseen(raised, cells, covariance)
    assert again is raised and nothing is None
