"""Materials of engines: parameters that are known are found again, and files open in their own consumers."""

import json

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf, Lobe
from photogonio.reconstruct.export.gltf import metallic_roughness, read_gltf, write_gltf
from photogonio.reconstruct.export.loss import loss_of
from photogonio.reconstruct.export.openpbr import openpbr, read_openpbr, write_openpbr
from photogonio.reconstruct.export.principled import fit_principled, rgb

ALBEDO = np.array([0.6, 0.3, 0.1])


def matte() -> Brdf:
    return Brdf(0, ("R", "G", "B"), np.array([[0, 0, 0]]), 2 * ALBEDO[None], np.zeros((1, 3)))


def metal(roughness=0.25) -> Brdf:
    """GGX with Schlick's reflectance, as engines have it."""
    lobe = Lobe(roughness, np.array([0.9, 0.7, 0.4]), np.ones(3))
    return Brdf(0, ("R", "G", "B"), np.zeros((0, 3), int), np.zeros((0, 3)), np.zeros((0, 3)), lobes=(lobe,))


def plastic() -> Brdf:
    """A dielectric's coat over a ground, which OpenPBR has but for what the ground sees from the light."""
    lobe = Lobe(
        0.2, np.full(3, 0.04), np.ones(3), "coat", fresnel="dielectric", ground=np.array([0.5, 0.3, 0.1])
    )
    return Brdf(0, ("R", "G", "B"), np.zeros((0, 3), int), np.zeros((0, 3)), np.zeros((0, 3)), lobes=(lobe,))


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


def test_a_plastic_is_near(tmp_path):
    write_openpbr(plastic(), tmp_path / "a.mtlx")
    found = read_openpbr(tmp_path / "a.mtlx")
    assert found.roughness**2 == pytest.approx(0.2, rel=0.02)
    assert found.f0 == pytest.approx(0.04, rel=0.05)
    # what the coat takes of the light to the ground, about 5 %, is in the colour here, not in the angle
    assert loss_of(plastic(), found, lambda f: rgb(plastic(), f)).rms[0] < 0.02


@pytest.mark.parametrize("brdf", [metal(), plastic()], ids=["metal", "plastic"])
def test_what_is_written_is_what_was_found(tmp_path, brdf):
    write_openpbr(brdf, tmp_path / "a.mtlx")
    write_gltf(brdf, tmp_path / "a.gltf")
    for read, model in ((read_openpbr, openpbr), (read_gltf, metallic_roughness)):
        given, found = (
            fit_principled(brdf, model),
            read(tmp_path / f"a.{'mtlx' if model is openpbr else 'gltf'}"),
        )
        assert given.metal == found.metal
        np.testing.assert_allclose(found.base_color, given.base_color, atol=1e-5)
        assert (found.roughness, found.f0) == pytest.approx((given.roughness, given.f0), abs=2e-5)


def test_materialx_takes_the_document(tmp_path):
    mx = pytest.importorskip("MaterialX", reason="MaterialX is not installed")
    write_openpbr(plastic(), tmp_path / "a.mtlx")
    library, document = mx.createDocument(), mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
    mx.readFromXmlFile(document, str(tmp_path / "a.mtlx"))
    document.setDataLibrary(library)
    valid, said = document.validate()
    assert valid, said
    (surface,) = [node for node in document.getNodes() if node.getCategory() == "open_pbr_surface"]
    assert surface.getNodeDef() is not None


def test_the_gltf_holds_a_closed_sphere(tmp_path):
    write_gltf(plastic(), tmp_path / "a.gltf")
    import base64

    document = json.loads((tmp_path / "a.gltf").read_text())
    data = base64.b64decode(document["buffers"][0]["uri"].partition(",")[2])
    assert len(data) == document["buffers"][0]["byteLength"]
    points, faces = (
        np.frombuffer(
            data, kind, document["accessors"][k]["count"] * n, document["bufferViews"][k]["byteOffset"]
        )
        for k, (kind, n) in enumerate((("<f4", 3), ("<u2", 1)))
    )
    points, faces = points.reshape(-1, 3).astype(float), faces.reshape(-1, 3)
    a, b, c = (points[faces[:, k]] for k in range(3))
    # the volume of a polyhedron whose faces are seen counterclockwise from outside; 3 degrees a face
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert volume == pytest.approx(4 / 3 * np.pi, rel=0.01)
