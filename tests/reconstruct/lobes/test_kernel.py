"""Compiled columns of mirror lobes: against the formula from vectors, and apart from their company."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.lobes.interface import FINE, coat_albedo, cubic_piece, dielectric_fresnel
from photogonio.reconstruct.lobes.kernel import mirror_parts, stretched_parts
from photogonio.reconstruct.modes.kernel import LANES
from tests import oracles

NONE, UNTURNED, NO_COAT = np.empty(0), np.empty((2, 0)), np.empty((0, 4))


def parts(angles, *, separable=False, beckmann=False, roughness=0.3, f0=-1.0, albedo=NO_COAT):
    result = np.empty((2, angles.shape[1]))
    mirror_parts(angles, separable, beckmann, roughness, f0, albedo, NONE, UNTURNED, result)
    return result


def pairs(n: int = 200) -> np.ndarray:
    rng = np.random.default_rng(0)
    return np.vstack([rng.uniform(0.0, 1.45, (2, n)), rng.uniform(0.0, np.pi, n)])


def half_cosine(angles: np.ndarray) -> np.ndarray:
    """<i, h>: half the angle between the two directions."""
    i, r, d = angles
    between = np.cos(i) * np.cos(r) + np.sin(i) * np.sin(r) * np.cos(d)
    return np.cos(0.5 * np.arccos(np.clip(between, -1.0, 1.0)))


def test_the_parts_of_schlicks_formula_are_those_of_the_oracle():
    angles = pairs(40)
    whole, miss = parts(angles, roughness=0.25)
    for k, (i, r, d) in enumerate(angles.T):
        assert whole[k] == pytest.approx(oracles.ggx(i, r, d, 0.25, 1.0), rel=1e-10)
        for f0 in (0.04, 0.6):
            said = f0 * whole[k] + (1.0 - f0) * miss[k]
            assert said == pytest.approx(oracles.ggx(i, r, d, 0.25, f0), rel=1e-10)


@pytest.mark.parametrize("beckmann", [False, True])
@pytest.mark.parametrize("separable", [False, True])
def test_every_kind_is_the_same_when_incidence_and_exit_are_exchanged(separable, beckmann):
    angles = pairs()
    there = parts(angles, separable=separable, beckmann=beckmann)
    back = parts(angles[[1, 0, 2]], separable=separable, beckmann=beckmann)
    np.testing.assert_allclose(back, there, rtol=1e-12, atol=1e-300)


def test_a_coat_reflects_by_fresnel_and_lets_the_rest_in_twice():
    angles, f0 = pairs(), 0.05
    table = coat_albedo(False, False, 0.3, f0, FINE)
    plain = parts(angles)[0]
    lobe, ground = parts(angles, f0=f0, albedo=table)
    np.testing.assert_allclose(lobe, plain * dielectric_fresnel(half_cosine(angles), f0), rtol=1e-9)
    entered = [np.prod([1.0 - cubic_piece(table, np.cos(one)) for one in pair]) for pair in angles[:2].T]
    np.testing.assert_allclose(ground, np.array(entered) / np.pi, rtol=1e-12)


@pytest.mark.parametrize("count", [1, LANES - 1, LANES + 1])
def test_a_pairs_value_does_not_depend_on_its_company(count):
    angles = pairs(3 * LANES)
    np.testing.assert_array_equal(parts(angles[:, :count].copy()), parts(angles)[:, :count])


def test_stretched_slopes_are_those_of_vectors_in_units_of_the_roughness():
    """sin^2 of the half vector as x M^-1 x, and the roughness along a direction as sqrt(x M x), of M = exp(2 E)."""
    rng, stretch = np.random.default_rng(1), np.array([[1.7, 0.4], [0.4, 0.9]])
    size, turn = rng.uniform(0.1, 0.99, (2, 50)), rng.uniform(0.0, 2.0 * np.pi, (2, 50))
    toward = size * np.array([np.cos(turn), np.sin(turn)])
    up = np.sqrt(1.0 - size**2)
    half = np.concatenate([toward.sum(1), up.sum(0)[None]])
    sine2, rough = np.empty(50), np.empty((2, 50))
    longer, shorter = ((m[0, 0], m[1, 1], 2.0 * m[0, 1]) for m in (stretch, np.linalg.inv(stretch)))
    stretched_parts(toward, size**2, np.sum(half**2, axis=0), longer, shorter, 0.3, sine2, rough)
    half = half[:2] / np.linalg.norm(half, axis=0)
    np.testing.assert_allclose(
        sine2, np.einsum("an,ab,bn->n", half, np.linalg.inv(stretch), half), rtol=1e-12
    )
    for k in range(2):
        unit = toward[:, k] / size[k]
        along = np.sqrt(np.einsum("an,ab,bn->n", unit, stretch, unit))
        np.testing.assert_allclose(rough[k], 0.3 * along, rtol=1e-12)
