"""An average of models of measured rows: a model again, whose weights add up and whose errors are those of its rows."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.weights import error_model
from photogonio.reconstruct.lobes.families import second_lobe
from photogonio.reconstruct.modes.angles import spherical_angles, unit_vectors
from photogonio.reconstruct.rows.row_average import Average, Weighed, average_of, between
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.reconstruct.table.goniometer_csv import samples_table
from tests.drawn.goniometer import SATIN, matte, measured, scattered
from tests.drawn.goniometer import glossy as glossy_surface

LOBES = [LobeSet((second_lobe(absolute=False),), (np.array([one]),)) for one in (0.2, 0.4, 0.7)]
NOISE = 0.02
ROWS = 300


def cells(surface, noise: float = NOISE) -> Cells:
    return cells_of(samples_table(measured(surface, scattered(ROWS), noise=noise)))


def average(given: Cells, order: int = 4) -> Average:
    return average_of(given, error_model(given), order, LOBES)


@pytest.fixture(scope="module")
def glossy() -> tuple[Cells, Average]:
    given = cells(SATIN)
    return given, average(given)


def test_weights_add_up_and_the_ridge_is_always_there(glossy):
    _, found = glossy
    weights = [one.weight for one in found.members]
    assert sum(weights) == pytest.approx(1.0, rel=1e-12) and min(weights) > 0.0
    (ridge,) = [one for one in found.members if not one.lobes.families]
    assert ridge.weight >= 1.0 / 3.0
    assert found.name.count("%") == len(found.members)


def test_rows_left_out_are_the_mean_of_what_members_say(glossy):
    _, found = glossy
    mean = sum(one.weight * one.left_out for one in found.members)
    np.testing.assert_allclose(found.left_out, mean, rtol=1e-12)


def test_what_is_said_of_rows_left_out_is_known_before_all_rows_are_fitted(glossy):
    given, found = glossy
    weighed = Weighed.of(given, error_model(given), 4, LOBES)
    np.testing.assert_array_equal(weighed.left_out, found.left_out)
    np.testing.assert_allclose(weighed.weight, [one.weight for one in found.members], rtol=1e-12)


def test_lobes_have_the_share_that_is_asked_for_where_left_out_rows_give_none():
    given = cells(matte(0.5))
    free, held = (average_of(given, error_model(given), 4, LOBES, least) for least in (0.0, 0.4))
    shares = [sum(one.weight for one in found.members if one.lobes.families) for found in (free, held)]
    assert shares[0] < 0.2 < shares[1] < 0.45
    assert sum(one.weight for one in held.members) == pytest.approx(1.0)


def test_a_matte_surface_stays_one():
    """Lobes that may not take light away and modes that are pulled to nothing leave the free constant."""
    given = cells(matte(0.5), noise=0.0)
    found = average(given)
    np.testing.assert_allclose(found.model.evaluate(given), 0.5 / np.pi, rtol=1e-4)
    assert (found.model.lobe_coefficients >= -1e-9).all()


def test_the_noise_of_a_row_is_found():
    """Of rows whose error is the same everywhere: a standard deviation of n rows is known to 1 / sqrt(2 n), and some
    of the rows' freedom is the modes'."""
    given = cells(matte(0.5), noise=NOISE)
    found = average(given)
    said = found.fresh.noise.at(given, found.said).mean(0)
    np.testing.assert_allclose(said, NOISE * 0.5 / np.pi, rtol=5.0 / np.sqrt(2.0 * ROWS))


def test_the_covariance_is_one_and_says_how_far_the_average_is_off():
    """Of a broad gloss that the modes can say, and noise that is the same everywhere."""
    broad, sigma = glossy_surface(0.3, 0.1, 3.0), 0.003
    given, exact = (
        cells_of(samples_table(measured(broad, scattered(ROWS), noise=0.0, constant=constant)))
        for constant in (sigma, 0.0)
    )
    found = average(given, order=8)
    for one in found.covariance:
        np.testing.assert_allclose(one, one.T, atol=1e-12 * np.abs(one).max())
        assert np.linalg.eigvalsh(one).min() > -1e-9 * np.abs(one).max()
    design = np.hstack([found.model.basis.design(given), found.model.lobes.columns(given)[1]])
    error = np.sqrt(np.einsum("np,pq,nq->n", design, found.covariance[0], design))
    off = np.abs(found.model.evaluate(given) - exact.value)[:, 0]
    # at the rows themselves three standard errors hold nearly all, and most are less than the noise of a row
    assert np.mean(off < 3.0 * error) > 0.95
    assert np.median(error) < sigma


def test_between_two_averages_all_is_their_mean_and_the_covariance_holds_what_they_differ_by(glossy):
    given, one = glossy
    other = average_of(given, error_model(given), 4, LOBES[:1])
    both = between(given, one, other, 0.3)
    assert sum(member.weight for member in both.members) == pytest.approx(1.0)
    for name in ("said", "left_out", "leverage"):
        mean = 0.3 * getattr(one, name) + 0.7 * getattr(other, name)
        np.testing.assert_allclose(getattr(both, name), mean, rtol=1e-9, atol=1e-12)

    def variance(found: Average) -> np.ndarray:
        design = np.hstack([found.model.basis.design(given), found.model.lobes.columns(given)[1]])
        return np.einsum("np,pq,nq->n", design, found.covariance[0], design)

    # the law of total variance
    expected = 0.3 * variance(one) + 0.7 * variance(other) + 0.21 * (one.said - other.said)[:, 0] ** 2
    np.testing.assert_allclose(variance(both), expected, rtol=1e-6, atol=1e-12 * expected.max())


def in_rings(count: int, seed: int, first: float = 22.5) -> tuple[np.ndarray, ...]:
    """theta_i, theta_r, dphi (count,) of random directions at a few angles from the lamp, as a camera that moves in
    steps sees them."""
    rng = np.random.default_rng(seed)
    many = 4 * count
    apart = np.radians(rng.choice(np.arange(first, 150.0, 22.5), many))[:, None]
    turn = rng.uniform(0.0, 2.0 * np.pi, many)[:, None]
    theta_i = np.arccos(rng.uniform(np.cos(np.radians(75.0)), 1.0, many))
    along = unit_vectors(theta_i + np.pi / 2, np.zeros(many))
    exit = np.cos(apart) * unit_vectors(theta_i, np.zeros(many))
    exit += np.sin(apart) * (np.cos(turn) * along + np.sin(turn) * [0.0, 1.0, 0.0])
    seen = np.flatnonzero(exit[:, 2] > np.cos(np.radians(75.0)))[:count]
    theta_r, dphi = spherical_angles(exit[seen])
    return theta_i[seen], theta_r, dphi


@pytest.mark.parametrize("exponent", [8.0, 12.0, 20.0])
@pytest.mark.parametrize("seed", [0, 1])
def test_a_retro_reflective_peak_whose_top_no_row_shows_is_no_narrow_one(exponent, seed):
    """From 22 degrees of the lamp on: the foot of a narrow lobe fits the rows as well, and its light would be made up.
    (So it was, fifteen times as high as the peak.)"""
    surface = glossy_surface(0.3, 0.3, exponent, toward=1.0)
    rows = cells_of(samples_table(measured(surface, in_rings(205, seed), noise=0.05)))
    found = average_of(rows, error_model(rows), 12)
    theta = np.radians([10.0, 30.0, 50.0])
    top = found.model.evaluate(Cells.of_angles(theta, theta, np.zeros(3)))[:, 0]
    assert np.all(top < 1.5 * surface(theta, theta, np.zeros(3)))
