"""A fit's errors in the file's terms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ndtri

from photogonio.reconstruct.brdf.parameters import is_shared
from photogonio.reconstruct.brdf.spread import drawn
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model_discrepancy import Misfit
from photogonio.reconstruct.lobes.families import families
from photogonio.reconstruct.represent.as_found import lobe_parameters
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.budget import Uncertainty
from photogonio.reconstruct.uncertainty.in_file import in_file, rounded
from photogonio.reconstruct.uncertainty.lobe_weight import covers_of
from tests.drawn.fits import as_found, model_of

METAL = families(absolute=True)[0]
NONE = Misfit(np.zeros((1, 4)), np.zeros((1, 2)), np.full(2, 1e-3))
MANY = 1e6  # degrees of freedom: as of a normal distribution


@pytest.mark.parametrize("digits", [2, 6, 12])
def test_numbers_are_rounded_to_digits_whatever_their_size(digits):
    rng = np.random.default_rng(0)
    values = rng.choice([-1.0, 1.0], 500) * 10.0 ** rng.uniform(-30.0, 20.0, 500)
    found = rounded(values, digits)
    # half a unit of the last digit, of a number that begins with 1
    assert (np.abs(found / values - 1.0) <= 0.5 * 10.0 ** (1 - digits) * (1.0 + 1e-9)).all()
    np.testing.assert_allclose(rounded(found, digits), found, rtol=1e-15)
    np.testing.assert_array_equal(rounded(np.zeros(3)), 0.0)


def spread_of(model, order: int, size: float = 0.01, freedom: float = MANY) -> Uncertainty:
    """Errors of everything, which know of one another; modes up to ``order``."""
    modes = len(Basis("isotropic", order).modes)
    count = modes + len(model.lobe_coefficients) + len(model.lobes.flat()) + len(covers_of(model))
    root = size * np.random.default_rng(1).normal(size=(2, count, count)) / np.sqrt(count)
    whole = root @ np.swapaxes(root, 1, 2)
    return Uncertainty(Basis("isotropic", order), whole, len(model.lobe_coefficients), freedom, 0.02)


def listed(model, order: int):
    """The BRDF with all modes of the errors, as a fit hands it over."""
    brdf = as_found(model)
    modes = Basis("isotropic", order).modes
    own = np.zeros((len(modes), 2))
    own[: len(brdf.modes)] = brdf.coefficients
    return replace(brdf, order=order, modes=modes, coefficients=own, standard_errors=0.0 * own)


def cells(n: int = 300) -> Cells:
    rng = np.random.default_rng(2)
    theta = np.radians(80.0) * rng.uniform(size=(2, n))
    return Cells.of_angles(*theta, rng.uniform(0.0, np.pi, n))


def told(brdf, where: Cells) -> np.ndarray:
    return brdf.standard_error(where.theta_i, where.phi_i, where.theta_r, where.phi_r)


def test_the_file_says_f_as_sure_as_the_fit_does():
    model = model_of(METAL)
    spread = spread_of(model, 2)
    brdf = in_file(listed(model, 2), model, spread, NONE, 1.6)
    own = spread.standard_error(model, cells())
    # shapes are logarithms there and numbers here, both linearised: to second order in their errors of a hundredth
    np.testing.assert_allclose(told(brdf, cells()), own, rtol=0.05)
    assert brdf.uncertainty.parameters[len(brdf.modes) :] == tuple(lobe_parameters(model))


def test_modes_that_the_file_does_not_list_are_in_its_errors():
    """Models of a higher order predict as well: what they add to the error is said, if not by whom, and by a small
    table, which is above it here and a little below there."""
    model = model_of(METAL)
    spread = spread_of(model, 4)
    brdf = in_file(listed(model, 4), model, spread, NONE, 1.6)
    assert len(brdf.modes) == len(model.basis.modes) and brdf.order == 2
    ratio = told(brdf, cells()) / spread.standard_error(model, cells())
    assert 0.9 < np.median(ratio) < 1.2 and np.mean(ratio > 0.8) > 0.9


def test_what_a_mode_and_a_ground_do_alike_is_not_told_apart():
    """A coat's ground and modes that are not listed say nearly the same together; the little by which a ground differs
    from the modes that are listed has no say of its own."""
    model = model_of(families(absolute=True)[2])
    own, basis = len(model.coefficients), Basis("isotropic", 6)
    modes = len(basis.modes)
    parts = np.hstack([basis.design(cells()), model.lobes.columns(cells())[1]])
    change = np.zeros(spread_of(model, 6).covariance.shape[1])
    change[modes] = 0.5  # of the ground; all modes take it back
    change[:modes] = np.linalg.lstsq(parts[:, :modes], -0.5 * parts[:, modes], rcond=None)[0]
    assert np.abs(change[own:modes]).max() > 0.01 * np.abs(change[0])
    spread = replace(
        spread_of(model, 6), covariance=np.stack([np.outer(change, change)] * 2), scale_error=0.0
    )
    brdf = in_file(listed(model, 6), model, spread, NONE, 1.6)
    said, true = told(brdf, cells()), spread.standard_error(model, cells())
    assert np.sqrt(np.mean(said**2)) < 2.0 * np.sqrt(np.mean(true**2))


def test_errors_of_few_parts_are_wider():
    """By Student's quantile over the normal one; both are of four digits."""
    model = model_of(METAL)
    few, many = (
        in_file(listed(model, 2), model, spread_of(model, 2, freedom=n), NONE, 1.6) for n in (5.0, MANY)
    )
    wider = 2.5706 / ndtri(0.975)
    np.testing.assert_allclose(few.standard_errors, wider * many.standard_errors, rtol=1e-3)


def with_shared_shapes(model, order: int) -> Uncertainty:
    """Errors that channels have in common where they have the shapes in common, as of one fit of all; those of modes up
    to ``order`` three times as large in the first channel."""
    spread = spread_of(model, order, 0.003)
    shapes = spread.modes + spread.coefficients + np.arange(len(model.lobes.flat()))
    size = np.ones((2, spread.covariance.shape[1]))
    size[0, : spread.modes] = 3.0
    whole = spread.covariance[:1] * size[:, :, None] * size[:, None, :]
    assert (whole[0][np.ix_(shapes, shapes)] == whole[1][np.ix_(shapes, shapes)]).all()
    return replace(spread, covariance=whole)


@pytest.mark.parametrize("family", [METAL, families(absolute=True)[2]])  # of a metal; of a coat
def test_what_channels_share_has_one_error_and_draws_scatter_as_is_said(family):
    model, draws = model_of(family), 400
    brdf = in_file(listed(model, 6), model, with_shared_shapes(model, 6), NONE, 1.6)
    errors = dict(zip(brdf.uncertainty.parameters, brdf.uncertainty.standard_errors, strict=True))
    shared = [name for name in errors if is_shared(name, brdf.lobes)]
    assert "lobe 0 roughness" in shared and ("lobe 0 f0" in shared) == family.has_ground
    for name in shared:
        assert errors[name][0] == errors[name][1] > 0.0
    alone = replace(brdf, uncertainty=replace(brdf.uncertainty, scale=0.0, misfit=None, unseen=None))
    where = cells(50)
    angles = where.theta_i, where.phi_i, where.theta_r, where.phi_r
    apart = np.array([one.evaluate(*angles) for one in drawn(alone, draws, 3)]) - alone.evaluate(*angles)
    # of as many draws a deviation is known to 1 / sqrt(2 n) of itself, and f bends a little between them
    scatter = np.sqrt(np.mean(apart**2, axis=0)) / told(alone, where)
    np.testing.assert_allclose(scatter, 1.0, atol=5.0 / np.sqrt(2.0 * draws) + 0.03)
