"""Rules about the mirror's direction: areas and a peak's integral."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.modes.mirror_quadrature import around, scattered_around


@pytest.mark.parametrize("theta", np.radians([0.0, 40.0, 86.0]))
@pytest.mark.parametrize(
    "rule",
    [around, lambda theta: around(theta, retro=True), lambda theta: scattered_around(theta, 20_000)],
    ids=["grid", "both ways", "lattice"],
)
def test_weights_are_projected_solid_angle(theta, rule):
    exit, weight = rule(theta)
    np.testing.assert_allclose(np.linalg.norm(exit, axis=1), 1.0, rtol=1e-12)
    assert weight.sum() == pytest.approx(np.pi, rel=2e-3)
    # the second moment along x, of a disk of radius 1
    assert weight @ exit[:, 0] ** 2 == pytest.approx(np.pi / 4.0, rel=2e-3)


@pytest.mark.parametrize("width", [0.1, 0.03])
@pytest.mark.parametrize("side", [1.0, -1.0], ids=["light", "mirror"])
def test_a_peak_about_the_light_or_its_mirror_is_as_large_as_it_is(width, side):
    """A Gaussian on the unit disk, far from its edge: pi width^2. With nodes dense about the mirror alone three
    quarters of the light's own, 0.03 wide, were lost."""
    theta = np.radians(30.0)
    exit, weight = around(theta, retro=True)
    apart = np.hypot(exit[:, 0] - side * np.sin(theta), exit[:, 1]) / width
    # weights that add up to 2 pi are 1 / (4 36^2) too large, of 36 nodes a quarter
    assert weight @ np.exp(-(apart**2)) == pytest.approx(np.pi * width**2, rel=2e-4)


def test_a_lattice_sees_what_jumps():
    """The share of a disk within a circle about the mirror's place: cells have such edges, and grids stand in line."""
    theta, radius = np.radians(60.0), 0.05
    exit, weight = scattered_around(theta, 20_000)
    inside = np.hypot(exit[:, 0] + np.sin(theta), exit[:, 1]) < radius
    assert weight[inside].sum() == pytest.approx(np.pi * radius**2, rel=0.01)
