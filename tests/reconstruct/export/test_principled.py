"""Materials of engines: parameters that are known are found again, and files open in their own consumers."""

import numpy as np
import pytest

from photogonio.reconstruct.export.gltf import metallic_roughness
from photogonio.reconstruct.export.openpbr import openpbr
from photogonio.reconstruct.export.principled import fit_principled
from tests.drawn.exports import ALBEDO, matte, metal


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
