import numpy as np

from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.gridded import between, between_rows


def rows(*steps):
    theta_i, theta_r, dphi = (np.radians(one).ravel() for one in np.meshgrid(*steps, indexing="ij"))
    return unit_vectors(theta_i, 0.0), unit_vectors(theta_r, dphi)


STEPS = np.arange(0.0, 86.0, 5.0), np.arange(0.0, 86.0, 5.0), np.arange(0.0, 181.0, 15.0)


def smooth(incident, exit):
    """Isotropic, of two channels."""
    f = 1.0 + 0.5 * incident[:, 2] * exit[:, 2] - 0.3 * np.sum(incident[:, :2] * exit[:, :2], axis=1)
    return np.column_stack([f, 2.0 * f])


def test_between_rows_of_a_whole_grid_f_is_linear():
    """Between nodes a straight line misses by an eighth of the step's square times the curve, of 1.3 at most for each
    of the three angles here."""
    pairs = rows(*STEPS)
    found = between_rows(*pairs, smooth(*pairs))
    np.testing.assert_allclose(found(*pairs), smooth(*pairs), rtol=1e-9)
    rng = np.random.default_rng(0)
    theta, phi = np.radians(85.0) * rng.random((2, 500)), 2.0 * np.pi * rng.random((2, 500))
    some = unit_vectors(theta[0], phi[0]), unit_vectors(theta[1], phi[1])
    off = 1.3 * (2.0 * np.radians(5.0) ** 2 + np.radians(15.0) ** 2) / 8.0
    np.testing.assert_allclose(found(*some), smooth(*some), atol=2.0 * off)


def test_rows_that_are_no_grid_say_nothing_between_them():
    pairs = rows(*STEPS)
    value = smooth(*pairs)
    keep = np.arange(len(value)) != len(value) - 1
    assert between_rows(pairs[0][keep], pairs[1][keep], value[keep]) is None
    half = rows(STEPS[0], STEPS[1], STEPS[2][:5])  # not all the way round
    assert between_rows(*half, smooth(*half)) is None
    coarse = rows(STEPS[0][::4], STEPS[1], STEPS[2])
    assert between_rows(*coarse, smooth(*coarse)) is None
    low = rows(STEPS[0][:9], STEPS[1], STEPS[2])  # light to 40 degrees alone
    assert between_rows(*low, smooth(*low)) is None


def turning_rows(polar, azimuth):
    grids = np.meshgrid(polar, azimuth, polar, azimuth, indexing="ij")
    theta_i, phi_i, theta_r, phi_r = (np.radians(one).ravel() for one in grids)
    return unit_vectors(theta_i, phi_i), unit_vectors(theta_r, phi_r)


def turning(incident, exit):
    """Changes as the sample turns; of one channel."""
    return (1.0 + 0.3 * incident[:, 0] * exit[:, 0] - 0.2 * incident[:, 1] * exit[:, 1])[:, None]


def test_of_a_surface_that_turns_both_azimuths_count():
    """Curves are of 0.3 at most for each of the four angles."""
    pairs = turning_rows(np.arange(0.0, 81.0, 10.0), np.arange(0.0, 360.0, 20.0))
    found = between(*pairs, turning(*pairs))
    np.testing.assert_allclose(found(*pairs), turning(*pairs), rtol=1e-9)
    rng = np.random.default_rng(0)
    theta, phi = np.radians(80.0) * rng.random((2, 500)), 2.0 * np.pi * rng.random((2, 500))
    some = unit_vectors(theta[0], phi[0]), unit_vectors(theta[1], phi[1])
    off = 0.3 * 2.0 * (np.radians(10.0) ** 2 + np.radians(20.0) ** 2) / 8.0
    np.testing.assert_allclose(found(*some), turning(*some), atol=off)
    kept = np.radians(0.0) <= np.arctan2(pairs[1][:, 1], pairs[1][:, 0])
    assert between(pairs[0][kept], pairs[1][kept], turning(*pairs)[kept]) is None
