"""Below the horizon a BRDF is 0, whatever its modes and lobes would go on to."""

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf, Lobe

MODES = {"isotropic": [[0, 0, 0], [2, 0, 0]], "general": [[0, 0, 0, 0], [2, 0, 0, 0]]}


@pytest.mark.parametrize("symmetry", MODES)
def test_f_is_zero_below_the_horizon(symmetry):
    lobes = (Lobe(0.3, np.array([0.5]), np.array([1.0])),)
    modes = np.array(MODES[symmetry])
    brdf = Brdf(2, ("Y",), modes, np.ones((2, 1)), np.ones((2, 1)), symmetry=symmetry, lobes=lobes)
    rng = np.random.default_rng(0)
    incident, exit = rng.normal(size=(2, 500, 3))
    above = (incident[:, 2] > 0) & (exit[:, 2] > 0)
    f = brdf(incident, exit)[:, 0]
    assert (f[~above] == 0.0).all()
    assert (f[above] != 0.0).all()
    edge = brdf.evaluate(np.pi / 2, 0.0, np.array([np.pi / 2, 0.3]), 0.0)
    assert np.isfinite(edge).all() and edge[1, 0] != 0.0
    np.testing.assert_array_equal(brdf.directional_albedo(np.array([1.7, -0.1]), 0.0), 0.0)
