"""What a fit works with: sets of lobes, and models of modes and lobes."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.lobes.families import families, lobe_columns, retro_lobe
from photogonio.reconstruct.table.cells import Cells

COAT = next(family for family in families(absolute=True) if family.has_ground)
BRUSHED = families(absolute=False, turning=True)[0]
RETRO = retro_lobe(absolute=True)
EVERY = LobeSet((COAT, BRUSHED, RETRO), (np.array([0.3, 0.04]), np.array([0.2, 1.3, 0.8]), np.array([0.1])))


def cells(n: int = 50) -> Cells:
    rng = np.random.default_rng(0)
    theta, phi = rng.uniform(0.0, 1.4, (2, n)), rng.uniform(-np.pi, np.pi, (2, n))
    return Cells.of_directions(theta[0], phi[0], theta[1], phi[1])


def test_shapes_come_back_from_their_logarithms():
    back = EVERY.with_flat(EVERY.flat())
    assert back.families == EVERY.families
    for one, other in zip(back.shapes, EVERY.shapes, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-15)
    assert LobeSet().with_flat(LobeSet().flat()) == LobeSet()


def test_columns_of_several_lobes_stand_side_by_side_and_fixed_parts_add():
    fixed, columns = EVERY.columns(cells())
    assert columns.shape == (50, len(EVERY.upper_bounds()))
    alone = [LobeSet((f,), (s,)).columns(cells()) for f, s in zip(EVERY.families, EVERY.shapes, strict=True)]
    np.testing.assert_array_equal(columns, np.hstack([one[1] for one in alone]))
    np.testing.assert_allclose(fixed, sum(one[0] for one in alone), rtol=1e-15)
    i, r, d = cells().theta_i, cells().theta_r, cells().dphi
    np.testing.assert_array_equal(alone[0][1], lobe_columns(COAT, EVERY.shapes[0], i, r, d)[1])


def test_what_turns_is_known_as_such():
    assert EVERY.turning and not LobeSet((COAT,), (EVERY.shapes[0],)).turning
    none = np.empty((0, 1))
    for symmetry, lobes, turning in (
        ("isotropic", LobeSet(), False),
        ("reciprocal", LobeSet(), True),
        ("isotropic", LobeSet((BRUSHED,), (EVERY.shapes[1],)), True),
    ):
        assert Model(Basis(symmetry, 0), none, lobes, none).turning == turning
    assert LobeSet().name == "none" and EVERY.name.count(" + ") == 2


def test_a_model_is_linear_in_its_coefficients_beside_what_is_fixed():
    basis, rng = Basis("isotropic", 2), np.random.default_rng(2)
    one, other = (
        (rng.normal(size=(len(basis.modes), 2)), rng.uniform(size=(len(EVERY.upper_bounds()), 2)))
        for _ in range(2)
    )
    f, g, both = (
        Model(basis, a, EVERY, b).evaluate(cells())
        for a, b in (one, other, [p + q for p, q in zip(one, other, strict=True)])
    )
    fixed = EVERY.columns(cells())[0][:, None]
    np.testing.assert_allclose(both + fixed, f + g, atol=1e-12)
