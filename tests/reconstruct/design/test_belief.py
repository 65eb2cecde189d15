"""What photos leave of what is not known: bounds and symmetries that hold whatever the surface."""

import numpy as np
import pytest

from photogonio.reconstruct.design.belief import noise, places, updated
from photogonio.reconstruct.design.materials import MATERIALS, of_material
from photogonio.reconstruct.design.pairs import SeenPairs
from photogonio.reconstruct.design.spots import Piece, Spot, Stance

FLAT = Piece(False, (35.0, 28.0))


def stance(camera, lamp):
    return Stance(Spot(*camera, 600.0), Spot(*lamp, 400.0))


def test_an_update_is_the_conditional_normal():
    rng = np.random.default_rng(0)
    root, rows = rng.normal(size=(6, 6)), rng.normal(size=(3, 6))
    prior, error = root @ root.T, np.diag([0.1, 0.2, 0.3])
    plain = np.linalg.inv(np.linalg.inv(prior) + rows.T @ np.linalg.inv(error) @ rows)
    np.testing.assert_allclose(updated(prior, rows, error), plain, rtol=1e-9)


@pytest.mark.parametrize("name", MATERIALS)
def test_photos_never_add_variance_and_their_order_does_not_count(name):
    one, other = (FLAT.pairs(stance((60, -90), lamp)) for lamp in ((40, 90), (20, 0)))
    start = of_material(name)
    before, first = start.mean_variance(), start.seen(one).mean_variance()
    both = [start.seen(a).seen(b).mean_variance() for a, b in ((one, other), (other, one))]
    assert before > first > both[0]
    assert both[0] == pytest.approx(both[1], rel=1e-9)


def test_reciprocal_twins_and_turned_pairs_are_one_place():
    pairs = SeenPairs(*np.radians([[30.0, 10.0], [5.0, -40.0], [60.0, 70.0], [100.0, 200.0]]))
    twin = SeenPairs(pairs.theta_r, pairs.phi_r, pairs.theta_i, pairs.phi_i)
    turned = SeenPairs(pairs.theta_i, pairs.phi_i + 1.0, pairs.theta_r, pairs.phi_r + 1.0)
    np.testing.assert_allclose(places(twin, False), places(pairs, False), atol=1e-12)
    np.testing.assert_allclose(places(twin, True)[:, 2:], places(pairs, True)[:, 2:], atol=1e-12)
    np.testing.assert_allclose(places(turned, False), places(pairs, False), atol=1e-12)
    assert np.abs(places(turned, True) - places(pairs, True)).max() > 0.1


def test_readings_of_one_photo_share_the_lamps_strength():
    pairs = FLAT.pairs(stance((60, -90), (45, 60)))
    found = noise(pairs)
    assert np.linalg.eigvalsh(found)[0] > 0
    assert np.unique(found[~np.eye(len(found), dtype=bool)]).size == 1
