"""Models that may turn, judged by what they were not shown."""

from dataclasses import replace

import numpy as np

from photogonio.reconstruct.symmetry.trials import shuffled
from photogonio.reconstruct.table.cells import cells_of
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.tables import TURNED_PLANE, simulate


def test_shuffled_views_are_the_same_of_an_isotropic_surface():
    cells = cells_of(simulate(make_brdf("plastic"), replace(TURNED_PLANE, views=8)))
    other = shuffled(cells, np.random.default_rng(3))
    np.testing.assert_array_equal(other.theta_r, cells.theta_r)
    wave = np.exp(1j * (cells.phi_r - cells.phi_i))
    np.testing.assert_allclose(np.exp(1j * (other.phi_r - other.phi_i)), wave, atol=1e-12)
    turn = np.exp(1j * (other.phi_i - cells.phi_i))
    for view in range(8):
        rows = cells.group == view
        np.testing.assert_allclose(turn[rows], turn[rows][0], atol=1e-12)
    assert np.abs(turn - 1.0).max() > 0.1
