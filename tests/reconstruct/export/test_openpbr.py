"""OpenPBR: parameters that are known are found again, and MaterialX takes the document."""

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf, Lobe
from photogonio.reconstruct.export.loss import loss_of
from photogonio.reconstruct.export.openpbr import openpbr, read_openpbr, write_openpbr
from photogonio.reconstruct.export.principled import fit_principled, rgb
from tests.drawn.exports import metal, plastic


def test_a_plastic_is_near(tmp_path):
    write_openpbr(plastic(), tmp_path / "a.mtlx")
    found = read_openpbr(tmp_path / "a.mtlx")
    assert found.roughness**2 == pytest.approx(0.2, rel=0.02)
    assert found.f0 == pytest.approx(0.04, rel=0.05)
    # what the coat takes of the light to the ground, about 5 %, is in the colour here, not in the angle
    assert loss_of(plastic(), found, lambda f: rgb(plastic(), f)).rms[0] < 0.02


def test_materialx_takes_the_document(tmp_path):
    write_openpbr(plastic(), tmp_path / "a.mtlx")
    assert_valid(tmp_path / "a.mtlx")


def assert_valid(path):
    mx = pytest.importorskip("MaterialX", reason="MaterialX is not installed")
    library, document = mx.createDocument(), mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
    mx.readFromXmlFile(document, str(path))
    document.setDataLibrary(library)
    valid, said = document.validate()
    assert valid, said
    (surface,) = [node for node in document.getNodes() if node.getCategory() == "open_pbr_surface"]
    assert surface.getNodeDef() is not None


@pytest.mark.parametrize("brdf", [metal(), plastic()], ids=["metal", "plastic"])
def test_what_is_written_is_what_was_found(tmp_path, brdf):
    write_openpbr(brdf, tmp_path / "a.mtlx")
    given, found = fit_principled(brdf, openpbr), read_openpbr(tmp_path / "a.mtlx")
    assert given.metal == found.metal
    np.testing.assert_allclose(found.base_color, given.base_color, atol=1e-5)
    assert (found.roughness, found.f0) == pytest.approx((given.roughness, given.f0), abs=2e-5)


def test_a_brushed_metal_is_found_as_it_is_and_materialx_takes_its_tangent(tmp_path):
    """Both are GGX with Schlick's reflectance: roughness 0.4 along 0.5 radians, and 0.15 across."""
    lobe = Lobe((0.4, 0.15), np.array([0.9, 0.7, 0.4]), np.ones(3), azimuth=0.5)
    nothing = np.zeros((0, 3))
    brdf = Brdf(0, ("R", "G", "B"), nothing.astype(int), nothing, nothing, lobes=(lobe,))
    write_openpbr(brdf, tmp_path / "a.mtlx")
    found = read_openpbr(tmp_path / "a.mtlx")
    assert found.metal and found.gloss.axes == pytest.approx((0.4, 0.15), rel=0.02)
    assert np.sin(found.rotation - 0.5) == pytest.approx(0.0, abs=0.02)
    assert max(loss_of(brdf, found, lambda f: rgb(brdf, f)).rms) < 0.03
    assert_valid(tmp_path / "a.mtlx")
