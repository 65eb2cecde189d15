"""glTF: what is written is what was found, on a sphere."""

import json

import numpy as np
import pytest

from photogonio.reconstruct.export.gltf import metallic_roughness, read_gltf, write_gltf
from photogonio.reconstruct.export.principled import fit_principled
from tests.drawn.exports import metal, plastic


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


@pytest.mark.parametrize("brdf", [metal(), plastic()], ids=["metal", "plastic"])
def test_what_is_written_is_what_was_found(tmp_path, brdf):
    write_gltf(brdf, tmp_path / "a.gltf")
    given, found = fit_principled(brdf, metallic_roughness), read_gltf(tmp_path / "a.gltf")
    assert given.metal == found.metal
    np.testing.assert_allclose(found.base_color, given.base_color, atol=1e-5)
    assert (found.roughness, found.f0) == pytest.approx((given.roughness, given.f0), abs=2e-5)
