"""Klems matrices for Radiance: how much is lost, and that no light is added."""

import numpy as np

from photogonio.reconstruct.brdf.brdf import Lobe
from photogonio.reconstruct.brdf.radiance_matrix import LATITUDES, AngleBasis
from photogonio.reconstruct.export.formats import find_format
from photogonio.reconstruct.export.radiance_klems import PATCHES, matrix, patch_samples
from photogonio.reconstruct.export.radiance_xml import LUMINANCE
from photogonio.reconstruct.modes.angles import unit_vectors
from tests.drawn.exports import plain


def test_a_lambertian_surface_is_the_same_everywhere(tmp_path):
    form = find_format("radiance", "klems")
    form.write(plain(), tmp_path / "a.xml")
    loss = form.loss(plain(), tmp_path / "a.xml")
    assert max(loss.rms) < 1e-4  # five digits are written
    np.testing.assert_allclose(loss.albedo, 1.0, atol=1e-4)


def test_a_gloss_narrower_than_a_patch_adds_no_light():
    brdf = plain(0.3, (Lobe(0.03, np.full(3, 0.04), np.ones(3)),))
    value = matrix(brdf)
    from photogonio.reconstruct.export.radiance_klems import _projected_solid_angles

    albedo = _projected_solid_angles() @ value
    # of the outermost ring's farthest incidence, a smooth dielectric's at 90 degrees
    assert albedo.max() <= float(LUMINANCE @ brdf.directional_albedo(np.radians(89.9))) + 1e-9
    assert albedo[:100].max() < 0.4


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
