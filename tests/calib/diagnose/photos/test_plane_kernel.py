"""Planes through neighbours, against numpy's least squares."""

import numpy as np

from photogonio.calib.diagnose.photos.plane_kernel import planes_at


def test_planes_are_those_of_least_squares():
    """Level, its variance and the misses, of places of any scale; a ridge moves them by as much as it says."""
    rng = np.random.default_rng(3)
    known, values = rng.uniform(0, 70.0, (50, 2)), rng.uniform(0.5, 1.5, (50, 3))
    places, near = rng.uniform(0, 70.0, (7, 2)), np.array([rng.permutation(50)[:24] for _ in range(7)])
    level, noise, scatter = np.empty((7, 3)), np.empty((7, 3)), np.empty(7)
    planes_at(places, known, values, near, 0.0, level, noise, scatter)
    for n, some in enumerate(near):
        design = np.column_stack([np.ones(24), places[n] - known[some]])
        found, squares, _, _ = np.linalg.lstsq(design, values[some], rcond=None)
        off = (values[some] - design @ found).mean(1)
        np.testing.assert_allclose(level[n], found[0], rtol=1e-12)
        variance = np.linalg.inv(design.T @ design)[0, 0] * squares / (24 - 3)
        np.testing.assert_allclose(noise[n], variance, rtol=1e-10)
        np.testing.assert_allclose(scatter[n], np.sqrt((off**2).mean()) / values[some].mean(), rtol=1e-10)
    ridged = np.empty_like(level)
    planes_at(places, known, values, near, 1e-6, ridged, noise, scatter)
    np.testing.assert_allclose(ridged, level, rtol=1e-4)
    assert (ridged != level).all()


def test_places_in_a_row_are_no_failure():
    known = np.column_stack([np.arange(30.0), np.zeros(30)])
    level, noise, scatter = np.empty((1, 1)), np.empty((1, 1)), np.empty(1)
    near = np.arange(24)[None]
    planes_at(np.array([[4.0, 0.0]]), known, np.full((30, 1), 2.0), near, 1e-6, level, noise, scatter)
    np.testing.assert_allclose(level, 2.0, rtol=1e-4)
    assert scatter[0] < 1e-4
