"""Coefficients held to physics: the nearest that neither take light away nor make it."""

import numpy as np
import pytest
from scipy.optimize import nnls

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.lobes.lobe import Lobe
from photogonio.reconstruct.represent.bounds import ALBEDO_ANGLES, enforced, held_pairs, raised, violated
from photogonio.reconstruct.represent.in_modes import said_in_modes


def brdf_of(order, coefficients, scale="absolute"):
    coefficients = np.asarray(coefficients, float)
    modes = Basis("isotropic", order).modes
    full = np.zeros((len(modes), coefficients.shape[1]))
    full[: len(coefficients)] = coefficients
    return Brdf(order, ("grey",) * coefficients.shape[1], modes, full, np.zeros_like(full), scale=scale)


def values(brdf):
    pairs = held_pairs()
    return brdf.evaluate(pairs.theta_i, 0.0, pairs.theta_r, pairs.dphi)


def identity(brdf, size=1.0):
    return np.tile(size * np.eye(len(brdf.modes)), (len(brdf.channels), 1, 1))


def test_a_physical_brdf_stays_to_the_last_bit():
    brdf = brdf_of(4, [[0.5], [0.02]])
    assert not violated(brdf, np.full_like(values(brdf), 1e-6))
    found = enforced(brdf, identity(brdf))
    np.testing.assert_array_equal(found.coefficients, brdf.coefficients)
    assert found.active == 0


def test_negative_values_go_and_as_little_as_possible_changes():
    """The conditions of Karush, Kuhn and Tucker: the change is a sum of active rows with no negative weight."""
    brdf = brdf_of(2, [[0.2], [0.5], [0.0], [0.1], [-0.1]])
    assert violated(brdf, np.full_like(values(brdf), 1e-3))
    found = enforced(brdf, identity(brdf))
    held = Brdf(brdf.order, brdf.channels, brdf.modes, found.coefficients, brdf.standard_errors)
    assert values(held).min() >= -1e-8
    assert found.least == pytest.approx(values(brdf).min())
    rows = Basis("isotropic", 2).design(held_pairs())
    active = rows[(rows @ found.coefficients)[:, 0] < 1e-9]
    change = (found.coefficients - brdf.coefficients)[:, 0]
    assert nnls(active.T, change)[1] <= 1e-6 * np.linalg.norm(change)


def test_more_light_than_came_in_is_taken_back_on_an_absolute_scale_alone():
    brdf = brdf_of(0, [[2.4]])
    assert violated(brdf, np.full_like(values(brdf), 1e-3))
    assert not violated(brdf_of(0, [[2.4]], "relative"), np.full_like(values(brdf), 1e-3))
    found = enforced(brdf, identity(brdf))
    held = Brdf(0, brdf.channels, brdf.modes, found.coefficients, brdf.standard_errors)
    np.testing.assert_allclose(held.directional_albedo(ALBEDO_ANGLES), 1.0, rtol=1e-9)
    assert found.albedo == pytest.approx(1.2)


def test_what_the_data_determine_stays_and_what_they_leave_open_gives_way():
    brdf = brdf_of(2, [[0.2], [0.5], [0.0], [0.1], [-0.1]])
    spread = identity(brdf)
    spread[0, 0, 0] = 1e-8  # the first coefficient is known
    found = enforced(brdf, spread)
    assert found.coefficients[0, 0] == pytest.approx(0.2, abs=1e-3)


def test_a_violation_within_its_error_is_none():
    brdf = brdf_of(2, [[0.2], [0.5], [0.0], [0.1], [-0.1]])
    assert not violated(brdf, np.full_like(values(brdf), 1.01 * -values(brdf).min()))


def test_a_trifle_below_zero_is_none():
    brdf = brdf_of(2, [[0.2], [0.5], [0.0], [0.1], [-0.1]])
    lifted = brdf_of(2, [[0.2 - (values(brdf).min() + 1e-4) / brdf_unit()], [0.5], [0.0], [0.1], [-0.1]])
    assert -2e-4 < values(lifted).min() < 0.0
    assert not violated(lifted, np.zeros_like(values(lifted)))
    assert violated(brdf, np.zeros_like(values(brdf)))


def brdf_unit():
    """What the first mode adds to f everywhere."""
    return float(values(brdf_of(0, [[1.0]])).max())


def test_what_modes_cannot_mend_is_said():
    """A negative constant with nothing free to move."""
    brdf = brdf_of(0, [[-0.1]])
    assert enforced(brdf, np.zeros((1, 1, 1))) is None


@pytest.mark.parametrize("power", [8, 20])
def test_a_cosine_power_over_a_dark_ground_is_not_below_zero_in_modes(power):
    """Which ring where both directions graze; below 70 degrees f stays as it was to a hundredth."""
    roughness = np.sqrt(2.0 / (power + 2.0))
    peak = Lobe(roughness, np.ones(1), np.full(1, 0.2), "blinn-phong", distribution="phong")
    brdf = Brdf(
        **{name: getattr(brdf_of(0, [[0.002]]), name) for name in Brdf.__slots__} | {"lobes": (peak,)}
    )
    said, true = said_in_modes(brdf).brdf, values(brdf)
    assert values(said).min() < -0.01 * true.max()
    held = values(raised(said))
    assert held.min() > -1e-6 * true.max()
    pairs = held_pairs()
    below = np.maximum(pairs.theta_i, pairs.theta_r) < np.radians(70)
    weight = (np.sin(2 * pairs.theta_i) * np.sin(2 * pairs.theta_r))[below, None]
    assert np.sqrt((weight * (held - true)[below] ** 2).sum() / (weight * true[below] ** 2).sum()) < 0.01
    assert raised(brdf) is brdf
