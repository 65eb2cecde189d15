"""Klems matrices for Radiance: how much is lost, and that no light is added."""

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Lobe
from photogonio.reconstruct.brdf.radiance_matrix import LATITUDES, AngleBasis
from photogonio.reconstruct.export.formats import find_format
from photogonio.reconstruct.export.radiance_klems import (
    PATCHES,
    _projected_solid_angles,
    matrix,
    patch_samples,
)
from photogonio.reconstruct.export.radiance_xml import LUMINANCE
from photogonio.reconstruct.modes.angles import unit_vectors
from tests.drawn.exports import plain


def test_a_lambertian_surface_is_the_same_everywhere(tmp_path):
    form = find_format("radiance", "klems")
    form.write(plain(), tmp_path / "a.xml")
    loss = form.loss(plain(), tmp_path / "a.xml")
    assert max(loss.rms) < 1e-4  # five digits are written
    np.testing.assert_allclose(loss.albedo, 1.0, atol=2e-4)  # the quadrature of the source: 1e-4


@pytest.mark.parametrize("roughness", [0.03, 0.3])
def test_no_patch_sends_out_more_than_the_surface_does_from_anywhere_in_it(roughness):
    brdf = plain(0.3, (Lobe(roughness, np.full(3, 0.04), np.ones(3)),))
    value, basis = matrix(brdf), AngleBasis.of(LATITUDES["LBNL/Klems Full"])
    theta = np.radians(np.linspace(0.0, 88.0, 45))
    sent = (_projected_solid_angles() @ value)[basis.index(unit_vectors(theta, 0.0 * theta))]
    albedo = brdf.directional_albedo(theta) @ LUMINANCE
    assert (sent <= 1.0001 * albedo).all()
    near = theta < np.radians(35.0)  # where the albedo hardly changes within a patch, nothing is lost
    np.testing.assert_allclose(sent[near], albedo[near], rtol=3e-3)


def test_a_matrix_is_reciprocal():
    lobe = Lobe((0.3, 0.2), np.full(3, 0.04), np.ones(3), azimuth=0.4)
    value, basis = matrix(plain(0.3, (lobe,))), AngleBasis.of(LATITUDES["LBNL/Klems Full"])
    theta, phi = (angle.mean(axis=1) for angle in patch_samples())
    opposite = basis.index(unit_vectors(theta, phi + np.pi))
    np.testing.assert_allclose(value, value[np.ix_(opposite, opposite)].T, rtol=1e-12)


def test_patches_are_sampled_within_themselves():
    theta, phi = patch_samples()
    basis = AngleBasis.of(LATITUDES["LBNL/Klems Full"])
    number = basis.index(unit_vectors(theta.ravel(), phi.ravel()))
    np.testing.assert_array_equal(
        number.reshape(theta.shape), np.arange(PATCHES)[:, None] + 0 * number.reshape(theta.shape)
    )


def test_samples_stand_for_equal_projected_solid_angles():
    """Means over a patch of what is linear in cos^2 theta are exact, by a midpoint rule that is even in it."""
    theta, _ = patch_samples()
    edges = np.radians([low for low, _ in LATITUDES["LBNL/Klems Full"]] + [90.0])
    middle = 0.5 * (np.cos(edges[:-1]) ** 2 + np.cos(edges[1:]) ** 2)
    expected = np.repeat(middle, [count for _, count in LATITUDES["LBNL/Klems Full"]])
    np.testing.assert_allclose((np.cos(theta) ** 2).mean(1), expected, rtol=1e-12)
