"""Materials of engines: parameters that are known are found again, and files open in their own consumers."""

import numpy as np
import pytest

from photogonio.reconstruct.export.gltf import metallic_roughness
from photogonio.reconstruct.export.loss import loss_of
from photogonio.reconstruct.export.openpbr import openpbr
from photogonio.reconstruct.export.principled import fit_principled, rgb
from photogonio.reconstruct.lobes.lobe import Lobe
from tests.drawn.exports import ALBEDO, matte, metal, plain, plastic


@pytest.mark.parametrize("model", [openpbr, metallic_roughness])
def test_a_metal_is_found_as_it_is(model):
    found = fit_principled(metal(), model)
    assert found.metal
    assert found.roughness == pytest.approx(0.5, abs=1e-3)
    np.testing.assert_allclose(found.base_color, [0.9, 0.7, 0.4], atol=1e-3)


@pytest.mark.parametrize("model", [openpbr, metallic_roughness])
def test_a_matte_surface_has_no_gloss(model):
    found = fit_principled(matte(), model)
    assert not found.metal and found.f0 == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(found.base_color, ALBEDO, atol=1e-6)


RETRO = Lobe(0.15, np.ones(3), 0.1 * np.ones(3), "retro")
BRUSHED = Lobe((0.45, 0.15), np.full(3, 0.04), np.ones(3), azimuth=0.5)


@pytest.mark.parametrize("brdf", [plain(0.5, (RETRO,)), plain(0.3, (BRUSHED,)), plastic()])
@pytest.mark.parametrize("model", [openpbr, metallic_roughness])
def test_no_viewer_gets_more_light_than_from_the_surface(model, brdf):
    """Of a surface that turns, whichever way the light comes from; the quadrature is good to a thousandth."""
    found = fit_principled(brdf, model)
    up = loss_of(brdf, found, lambda f: rgb(brdf, f), gathered=True)
    assert max(up.albedo) < 1.005
    assert up.brightest < 1.0
