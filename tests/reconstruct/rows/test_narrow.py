"""Peaks that are narrower than lobes are told by the rows about them, and no rough gloss is one."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.goniometer.doubts import doubts_of
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.rows.narrow import RING, narrow_peak
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.goniometer import glossy, matte, measured, regular, samples, scattered

GRID = regular(15.0, 5.0, 30.0)


def peak(width: float, toward: float = -1.0):
    """A matte surface and a Gaussian of ``width`` degrees."""

    def f(theta_i, theta_r, dphi):
        across = toward * np.sin(theta_i) * np.sin(theta_r) * np.cos(dphi)
        angle = np.degrees(np.arccos(np.clip(np.cos(theta_i) * np.cos(theta_r) + across, -1.0, 1.0)))
        return 0.016 + 86.0 * np.exp(-0.5 * (angle / width) ** 2)

    return f


def found(table):
    return narrow_peak(table.theta_i, table.theta_r, table.phi_r - table.phi_i, table.value[:, 0])


@pytest.mark.parametrize("width", [0.3, 0.5, 1.0])
@pytest.mark.parametrize(("toward", "about"), [(-1.0, "mirror"), (1.0, "light")])
def test_a_peak_of_a_degree_is_told_with_its_side_and_nothing_else_is(width, toward, about):
    table = measured(peak(width, toward), GRID)
    one = found(table)
    assert one.about == about and one.times > 1000.0
    assert one.rows.any() and np.degrees(RING[1]) == pytest.approx(12.0)
    codes = [told.code for told in doubts_of(table, "brdf")]
    assert codes == (["table-lamp-side"] if about == "light" else [])


@pytest.mark.parametrize("roughness", [0.07, 0.1, 0.3])
def test_a_gloss_that_lobes_follow_is_none(roughness):
    """The narrowest lobe of a grid of roughnesses has 0.07."""
    fine = np.radians(np.arange(0.0, 81.0, 1.0))
    theta_i, theta_r = (
        one.ravel() for one in np.meshgrid(np.radians([0.0, 30.0, 60.0]), fine, indexing="ij")
    )
    dphi = np.full_like(theta_i, np.pi)
    gloss = make_brdf("ggx-conductor", {"f0": (0.9,), "roughness": roughness})
    value = gloss(unit_vectors(theta_i, 0 * theta_i), unit_vectors(theta_r, dphi))[:, 0]
    assert found(samples((theta_i, theta_r, dphi), value)) is None


@pytest.mark.parametrize("surface", [matte(0.5), glossy(0.1, 0.3, 200.0)])
@pytest.mark.parametrize("at", [GRID, scattered(300)])
def test_other_surfaces_have_none(surface, at):
    assert found(measured(surface, at, noise=0.02)) is None


def test_values_beside_a_narrow_peak_are_in_order():
    """Of a glossy surface with such a peak, which lobes follow but for it."""
    base = glossy(0.3, 0.1, 20.0)
    table = measured(lambda *at: base(*at) + peak(0.5)(*at), GRID, noise=0.01)
    assert found(table).about == "mirror" and not doubts_of(table, "brdf")
