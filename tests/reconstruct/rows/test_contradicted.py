"""Which rows of a table lose their say: those that their neighbours contradict, never those that a model misses."""

import numpy as np
import pytest

from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.rows.contradicted import contradiction_of, told_of
from photogonio.reconstruct.rows.row_noise import with_noise
from photogonio.reconstruct.table.cells import cells_of
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples, samples_table
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.goniometer import rows_of, table_of_rows

MATERIALS = {
    "ggx-conductor": {"f0": (0.8,), "roughness": 0.3},
    "plastic": {"albedo": (0.3,), "roughness": 0.2},
    "oren-nayar": {},
    "blinn-phong": {"albedo": (0.3,), "power": 30.0},
}
STEP = 10.0


def rows(value, theta_i, theta_r, phi_r):
    samples = GoniometerSamples(theta_i, 0.0 * theta_i, theta_r, phi_r, value, None, ("Y",))
    return cells_of(samples_table(samples))


def grid(name):
    axes = np.radians(np.arange(0.0, 81.0, STEP)), np.radians(np.arange(0.0, 181.0, 1.5 * STEP))
    theta_i, theta_r, phi_r = (a.ravel() for a in np.meshgrid(axes[0], axes[0], axes[1], indexing="ij"))
    brdf = make_brdf(name, MATERIALS[name])
    value = brdf(unit_vectors(theta_i, 0.0 * theta_i), unit_vectors(theta_r, phi_r))[:, :1]
    return value, theta_i, theta_r, phi_r


@pytest.mark.parametrize("name", MATERIALS)
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_no_row_of_a_surface_is_contradicted_however_odd_its_gloss(name, noise):
    value, *angles = grid(name)
    value = value * (1.0 + noise * np.random.default_rng(0).standard_normal(value.shape))
    cells = rows(value, *angles)
    assert not contradiction_of(cells, 0.02 * value).any()
    deviation = np.sqrt(with_noise(cells).variance)
    np.testing.assert_allclose(deviation, deviation[0, 0], rtol=1e-12)


def test_single_spoilt_rows_of_a_smooth_surface_are_found():
    value, *angles = grid("oren-nayar")
    spoilt = np.random.default_rng(1).choice(len(value), 12, replace=False)
    value[spoilt] *= 4.0
    found = np.flatnonzero(contradiction_of(rows(value, *angles), 0.01 * value)[:, 0])
    assert np.isin(found, spoilt).all()
    assert len(found) >= 6


def test_rows_that_agree_are_never_contradicted():
    """The same spoilt value read twice at one pair may be a peak."""
    value, *angles = grid("oren-nayar")
    k = 500
    value[k] *= 4.0
    value, *angles = (np.concatenate([a, a[k : k + 1]]) for a in (value, *angles))
    assert not contradiction_of(rows(value, *angles), 0.01 * value).any()


def test_rows_that_lost_their_say_are_counted_and_named():
    value, *angles = rows_of("lambert", {"albedo": (0.4,)})
    noisy = value * (1.0 + 0.02 * np.random.default_rng(2).standard_normal(value.shape))
    assert told_of(with_noise(cells_of(table_of_rows(noisy, *angles)))) == []
    noisy[100] *= 10.0
    (told,) = told_of(with_noise(cells_of(table_of_rows(noisy, *angles))))
    assert told.code == "rows-contradicted" and told.amount == 1
    assert f"{noisy[100, 0]:.4g} at ({np.degrees(angles[0][100]):.4g}," in told.message
