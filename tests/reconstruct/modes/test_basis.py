"""Bases on pairs: orthonormal, complete as counted, symmetric as named, and the same however they are summed."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.modes import basis as m
from photogonio.reconstruct.modes.quadrature import azimuth_rule, elevation_rule
from tests import oracles

COUNTS = {0: 1, 2: 5, 4: 14, 6: 30, 8: 55, 16: 285}


def pairs(count: int, seed: int = 0) -> np.ndarray:
    """(4, count) theta_i, phi_i, theta_r, phi_r, with the pole, the horizon and equal directions among them."""
    rng = np.random.default_rng(seed)
    angles = rng.uniform(0, 1, (4, count)) * np.array([[np.pi / 2], [20.0], [np.pi / 2], [20.0]]) - [
        [0],
        [7],
        [0],
        [7],
    ]
    angles[0, :3], angles[2, 1:4] = 0.0, 0.0
    angles[0, 4:7], angles[2, 5:8] = np.pi / 2, np.pi / 2
    angles[2:, 8:10] = angles[:2, 8:10]
    return angles


def coefficients(modes: np.ndarray, channels: int = 2, seed: int = 5) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(len(modes), channels))


# --- lists --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", COUNTS)
def test_isotropic_list(order):
    modes = m.isotropic_modes(order)
    assert len(modes) == COUNTS[order]
    assert set(map(tuple, modes.tolist())) == set(oracles.isotropic_list(order))


def test_pair_lists_count_as_they_must():
    for order in range(5):
        single = (order + 1) * (order + 2) // 2
        assert len(m.general_modes(order)) == single**2
        assert len(m.reciprocal_modes(order)) == single * (single + 1) // 2
        for modes in (m.general_modes(order), m.reciprocal_modes(order)):
            assert len(np.unique(modes, axis=0)) == len(modes)
    # isotropy leaves of the reciprocal modes the isotropic and the chiral ones
    assert len(m.chiral_modes(8)) == sum(1 for n, k, l in oracles.isotropic_list(8) if n > k and l > 0)


@pytest.mark.parametrize("make", [m.isotropic_modes, m.chiral_modes, m.reciprocal_modes, m.general_modes])
def test_lower_orders_come_first(make):
    whole = make(6)
    for order in range(7):
        part = make(order)
        assert np.array_equal(whole[: len(part)], part)


def test_indices_of_pairs_go_both_ways():
    modes = m.general_modes(4)
    j, k = m.pair_indices(modes)
    assert np.array_equal(np.sort(j * 15 + k), np.arange(225))
    reciprocal = m.pair_indices(m.reciprocal_modes(4))
    assert (reciprocal[0] >= reciprocal[1]).all()


# --- values -------------------------------------------------------------------------------------------------------


def test_isotropic_values_against_the_oracle():
    theta_i, phi_i, theta_r, phi_r = pairs(12)
    design = m.isotropic_design(6, theta_i, theta_r, phi_r - phi_i)
    for row, angles in zip(design, np.stack([theta_i, theta_r, phi_r - phi_i], axis=1), strict=True):
        exact = [oracles.isotropic(*mode, *map(float, angles)) for mode in m.isotropic_modes(6).tolist()]
        assert np.abs(row - exact).max() < 1e-13


def test_general_and_reciprocal_values_against_the_oracle():
    angles = pairs(6, seed=3)
    general, reciprocal = m.pair_design("general", 2, angles), m.pair_design("reciprocal", 2, angles)
    for at, (theta_i, phi_i, theta_r, phi_r) in enumerate(angles.T):
        one = {tuple(k): float(oracles.hemisphere(*k, theta_i, phi_i)) for k in HEMISPHERE}
        two = {tuple(k): float(oracles.hemisphere(*k, theta_r, phi_r)) for k in HEMISPHERE}
        for value, (n, l, k, p) in zip(general[at], m.general_modes(2).tolist(), strict=True):
            assert value == pytest.approx(one[n, l] * two[k, p], abs=1e-14)
        for value, (n, l, k, p) in zip(reciprocal[at], m.reciprocal_modes(2).tolist(), strict=True):
            both = (one[n, l] * two[k, p] + one[k, p] * two[n, l]) / np.sqrt(2)
            assert value == pytest.approx(both / (np.sqrt(2) if (n, l) == (k, p) else 1), abs=1e-14)


HEMISPHERE = [(0, 0), (1, -1), (1, 1), (2, -2), (2, 0), (2, 2)]


def test_isotropic_gram_matrix_to_order_32():
    order = 32
    theta, weight = elevation_rule(order + 1)
    dphi, share = azimuth_rule(order + 1)  # even in dphi: half a turn is enough
    count = len(m.isotropic_modes(order))
    gram = np.zeros((count, count))
    for theta_i, w in zip(theta, weight, strict=True):
        grid = np.broadcast_arrays(theta_i, theta[:, None], dphi[None, :])
        design = m.isotropic_design(order, *[g.ravel() for g in grid])
        design *= np.sqrt(w * np.outer(weight, share).ravel() * 4 * np.pi)[:, None]
        gram += design.T @ design
    assert np.abs(gram - np.eye(count)).max() <= 1e-11


def test_chiral_family_is_orthonormal_and_orthogonal_to_the_isotropic():
    order = 6
    theta, weight = elevation_rule(order + 1)
    half, share = azimuth_rule(order + 1)
    grid = np.meshgrid(theta, theta, np.concatenate([half, -half]), indexing="ij")
    weights = np.einsum("i,r,p->irp", weight, weight, np.concatenate([share, share])).ravel() * 2 * np.pi
    angles = [g.ravel() for g in grid]
    both = np.hstack([m.isotropic_design(order, *angles), m.chiral_design(order, *angles)])
    gram = both.T @ (weights[:, None] * both)
    assert np.abs(gram - np.eye(len(gram))).max() < 1e-12


def test_what_leaving_the_chiral_family_out_assumes():
    """It is isotropic and reciprocal as the paper asks, and yet no isotropic mode: it changes in a mirror."""
    theta_i, phi_i, theta_r, phi_r = pairs(400)
    dphi = phi_r - phi_i
    chiral = m.chiral_design(4, theta_i, theta_r, dphi)
    assert np.abs(chiral - m.chiral_design(4, theta_r, theta_i, -dphi)).max() < 1e-12  # i and r change places
    assert np.abs(chiral + m.chiral_design(4, theta_i, theta_r, -dphi)).max() < 1e-12  # reflection: odd
    assert np.abs(chiral).max() > 0.1
    mirrored = m.isotropic_design(4, theta_i, theta_r, -dphi)
    assert np.abs(m.isotropic_design(4, theta_i, theta_r, dphi) - mirrored).max() < 1e-12  # the others: even
    # nothing in the isotropic modes can stand for it, where pairs and their mirror images are both seen
    design = m.isotropic_design(8, np.tile(theta_i, 2), np.tile(theta_r, 2), np.concatenate([dphi, -dphi]))
    odd = np.concatenate([chiral[:, 0], -chiral[:, 0]])
    assert np.abs(np.linalg.lstsq(design, odd, rcond=None)[0]).max() < 1e-11 * np.linalg.norm(odd)


# --- sums ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [0, 1, 3, 8, 16])
@pytest.mark.parametrize("channels", [1, 2, 3, 4, 7])
def test_sum_equals_design_times_coefficients(order, channels):
    theta_i, phi_i, theta_r, phi_r = pairs(100)
    modes = m.isotropic_modes(order)
    values = coefficients(modes, channels)
    summed = m.evaluate_isotropic(modes, values, theta_i, theta_r, phi_r - phi_i)
    design = m.isotropic_design(order, theta_i, theta_r, phi_r - phi_i)
    bound = 1e-14 * (np.abs(design) @ np.abs(values)).max() * (order + 1)
    assert np.abs(summed - design @ values).max() <= bound


def test_pair_sums_equal_design_times_coefficients():
    angles = pairs(200)
    for symmetry, modes in (("general", m.general_modes(4)), ("reciprocal", m.reciprocal_modes(4))):
        values = coefficients(modes)
        summed = m.evaluate_pairs(symmetry, modes, values, angles)
        assert np.abs(summed - m.pair_design(symmetry, 4, angles) @ values).max() < 1e-12


def test_any_list_of_modes_in_any_order():
    angles = pairs(50)
    modes = m.isotropic_modes(7)[::-3]
    values = coefficients(modes)
    full = m.isotropic_modes(7)
    placed = np.zeros((len(full), 2))
    for mode, value in zip(modes, values, strict=True):
        placed[(full == mode).all(1)] = value
    dphi = angles[3] - angles[1]
    one = m.evaluate_isotropic(modes, values, angles[0], angles[2], dphi)
    assert np.abs(one - m.evaluate_isotropic(full, placed, angles[0], angles[2], dphi)).max() < 1e-12
    assert np.array_equal(m.evaluate_isotropic(modes[:0], values[:0], 0.1, 0.2, 0.3), np.zeros((1, 2)))


def test_reciprocal_and_isotropic_as_named():
    theta_i, phi_i, theta_r, phi_r = pairs(2000)
    modes = m.isotropic_modes(12)
    values = coefficients(modes)
    f = m.evaluate_isotropic(modes, values, theta_i, theta_r, phi_r - phi_i)
    scale = np.abs(f).max()
    assert (
        np.abs(f - m.evaluate_isotropic(modes, values, theta_r, theta_i, phi_i - phi_r)).max()
        <= 1e-12 * scale
    )
    modes = m.reciprocal_modes(6)
    values = coefficients(modes)
    g = m.evaluate_pairs("reciprocal", modes, values, (theta_i, phi_i, theta_r, phi_r))
    other = m.evaluate_pairs("reciprocal", modes, values, (theta_r, phi_r, theta_i, phi_i))
    assert np.abs(g - other).max() <= 1e-12 * np.abs(g).max()


@pytest.mark.parametrize("quantity", ["brdf_cos", "brdf_cos_cos"])
def test_quantities_divide_by_their_cosines(quantity):
    angles = [a[10:] for a in pairs(40)]
    cos = np.cos(angles[0]) * (np.cos(angles[2]) if quantity == "brdf_cos_cos" else 1)
    dphi = angles[3] - angles[1]
    for plain, divided in (
        (
            m.isotropic_design(3, angles[0], angles[2], dphi),
            m.isotropic_design(3, angles[0], angles[2], dphi, quantity),
        ),
        (m.pair_design("general", 2, angles), m.pair_design("general", 2, angles, quantity)),
        (m.pair_design("reciprocal", 2, angles), m.pair_design("reciprocal", 2, angles, quantity)),
    ):
        assert np.abs(divided * cos[:, None] - plain).max() < 1e-13
    with pytest.raises(ValueError, match="quantity is 'brdfcos'"):
        m.isotropic_design(2, 0.1, 0.2, 0.3, "brdfcos")


# --- hard arguments -----------------------------------------------------------------------------------------------


def test_poles_and_horizon_exactly():
    modes = m.isotropic_modes(16)
    values = np.ones((len(modes), 1))
    right = np.pi / 2
    for theta_i, theta_r, dphi in [
        (0, 0, 0),
        (0, 0, 2),
        (right, right, 0),
        (right, right, np.pi),
        (0, right, 1),
        (right, 0, 1),
    ]:
        exact = sum(oracles.isotropic(*mode, theta_i, theta_r, dphi) for mode in modes.tolist())
        got = m.evaluate_isotropic(modes, values, theta_i, theta_r, dphi)[0, 0]
        assert got == pytest.approx(exact, rel=1e-12, abs=1e-12)
        assert (m.isotropic_design(16, theta_i, theta_r, dphi) @ values)[0, 0] == pytest.approx(
            got, rel=1e-12
        )


def test_azimuths_wrap():
    modes = m.isotropic_modes(8)
    values = coefficients(modes)
    dphi = np.linspace(-np.pi, np.pi, 41)
    plain = m.evaluate_isotropic(modes, values, 0.7, 0.9, dphi)
    scale = np.abs(plain).max()
    for turns in (-1, 1, 3, 1000):
        wrapped = m.evaluate_isotropic(modes, values, 0.7, 0.9, dphi + turns * 2 * np.pi)
        rounding = np.finfo(float).eps * 2 * np.pi * (abs(turns) + 1)  # of dphi + 2 pi turns
        assert (
            np.abs(wrapped - plain).max() < 8 * 10 * scale * rounding
        )  # the slope is at most order times a sum


def test_single_precision_and_integers():
    theta = np.linspace(0, 1.5, 20)
    modes = m.isotropic_modes(6)
    values = coefficients(modes)
    single = m.evaluate_isotropic(modes, values.astype(np.float32), *[theta.astype(np.float32)] * 3)
    assert single.dtype == np.float64
    exact = m.evaluate_isotropic(
        modes, values.astype(np.float32), *[theta.astype(np.float32).astype(float)] * 3
    )
    assert np.array_equal(single, exact)
    assert np.array_equal(m.isotropic_design(4, 1, 0, 2), m.isotropic_design(4, 1.0, 0.0, 2.0))


def test_nothing_in_nothing_out():
    none = np.empty(0)
    modes = m.isotropic_modes(4)
    assert m.isotropic_design(4, none, none, none).shape == (0, 14)
    assert m.evaluate_isotropic(modes, coefficients(modes), none, none, none).shape == (0, 2)
    general = m.general_modes(2)
    assert m.evaluate_pairs("general", general, coefficients(general), [none] * 4).shape == (0, 2)


def test_shapes_broadcast_and_strides_do_not_matter():
    modes = m.isotropic_modes(5)
    values = coefficients(modes)
    theta_i, theta_r, dphi = np.random.default_rng(0).uniform(0, 1.5, (3, 5, 6))
    flat = m.evaluate_isotropic(modes, values, theta_i.ravel(), theta_r.ravel(), dphi.ravel())
    assert np.array_equal(m.evaluate_isotropic(modes, values, theta_i, theta_r, dphi), flat)
    backward = m.evaluate_isotropic(modes, values, *[a.ravel()[::-1] for a in (theta_i, theta_r, dphi)])
    assert np.array_equal(backward[::-1], flat)
    spread = m.evaluate_isotropic(modes, values, theta_i[:, :1], theta_r[:1], 0.3)
    assert spread.shape == (30, 2)


@pytest.mark.parametrize("place", range(4))
def test_not_a_number_stays_where_it_is(place):
    """Even in the first mode, which depends on no angle."""
    angles = np.full((4, 70), 0.5)
    angles[place, 33] = np.nan
    dphi = angles[3] - angles[1]
    lost = np.arange(70) == 33
    for order in (0, 6):
        modes = m.isotropic_modes(order)
        results = [
            m.evaluate_isotropic(modes, coefficients(modes), angles[0], angles[2], dphi),
            m.isotropic_design(order, angles[0], angles[2], dphi),
            m.pair_design("general", order // 3, angles),
            m.pair_design("reciprocal", order // 3, angles),
        ]
        for result in results:
            assert np.array_equal(np.isnan(result).all(1), lost) and np.isfinite(result[~lost]).all()


def test_shapes_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match=r"\(m, 3\) and \(m, c\)"):
        m.evaluate_isotropic(m.isotropic_modes(2), np.zeros(5), 0.1, 0.2, 0.3)
    with pytest.raises(ValueError, match=r"\(m, 4\)"):
        m.evaluate_pairs("general", m.isotropic_modes(2), np.zeros((5, 1)), (0.1, 0.2, 0.3, 0.4))


def test_few_incident_directions_of_many_pairs_give_what_each_pair_gives_alone():
    rng = np.random.default_rng(3)
    modes = m.reciprocal_modes(13)
    coefficients = rng.normal(size=(len(modes), 2))
    theta_i, phi_i = rng.uniform(0, 1.5, 5)[rng.integers(5, size=90)], np.full(90, 0.3)
    theta_r, phi_r = rng.uniform(0, 1.5, 90), rng.uniform(-3, 3, 90)
    together = m.evaluate_pairs("reciprocal", modes, coefficients, (theta_i, phi_i, theta_r, phi_r))
    for k in range(0, 90, 17):
        alone = m.evaluate_pairs(
            "reciprocal", modes, coefficients, (theta_i[k], phi_i[k], theta_r[k], phi_r[k])
        )
        np.testing.assert_allclose(together[k], alone[0], rtol=1e-10, atol=1e-11 * np.abs(together).max())
