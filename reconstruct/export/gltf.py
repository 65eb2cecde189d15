"""glTF 2.0: a sphere of the nearest metallic-roughness material, as engines and browsers show it.

The BRDF is that of the specification's appendix B: Schlick's reflectance mixes a Lambertian ground and a GGX gloss, or
tints a conductor. KHR_materials_ior holds a dielectric's index, KHR_materials_specular takes its gloss away.
"""

from __future__ import annotations

import base64
import json
from pathlib import Path

import numpy as np

from photogonio.capture.files.documents import read_json
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.export.loss import PLACE
from photogonio.reconstruct.export.principled import (
    Gloss,
    Halves,
    Principled,
    fit_principled,
    of_metal,
    schlick,
)

_RINGS, _SEGMENTS = 48, 96
_FLOAT, _UINT16, _ARRAY, _INDICES = 5126, 5123, 34962, 34963  # glTF's numbers for types and targets


def write_gltf(brdf: Brdf, path: Path) -> None:
    """The nearest glTF material on a unit sphere."""
    found = fit_principled(brdf, metallic_roughness)
    path.write_text(json.dumps(_document(found), indent=1) + "\n", encoding="utf-8")


def read_gltf(path: Path) -> Principled:
    """The material of a file that :func:`write_gltf` wrote."""
    material = read_json(path)["materials"][0]
    base, added = material["pbrMetallicRoughness"], material.get("extensions", {})
    metal = base["metallicFactor"] == 1.0
    index = float(added.get("KHR_materials_ior", {}).get("ior", 1.5))
    gloss = float(added.get("KHR_materials_specular", {}).get("specularFactor", 1.0))
    f0 = ((index - 1) / (index + 1)) ** 2 * gloss
    color, roughness = np.array(base["baseColorFactor"][:3], float), float(base["roughnessFactor"])
    if color.shape != (3,) or not np.isfinite([*color, f0]).all() or not 0.0 <= roughness <= 1.0:
        raise ValueError("expected three colours, an index and a roughness from 0 to 1")
    return Principled(metal, color, roughness, 0.0 if metal else f0, metallic_roughness)


def metallic_roughness(
    metal: bool, gloss: Gloss, f0: float, seen: Halves, lobe: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """See :data:`.principled.Model`."""
    if metal:
        return of_metal(lobe, seen)
    reflected = schlick(f0, seen)
    return lobe * reflected, (1 - reflected) / np.pi


def _document(material: Principled) -> dict[str, object]:
    points, triangles = _sphere()
    data = points.astype("<f4").tobytes() + triangles.astype("<u2").tobytes()
    low, high = points.min(0).tolist(), points.max(0).tolist()
    extensions: dict[str, object] = {"KHR_materials_ior": {"ior": material.ior}}
    if not material.metal and material.f0 <= 0:
        extensions = {"KHR_materials_specular": {"specularFactor": 0.0}}
    view = {"buffer": 0, "byteOffset": 0, "byteLength": points.size * 4, "target": _ARRAY}
    faces = {"buffer": 0, "byteOffset": points.size * 4, "byteLength": triangles.size * 2, "target": _INDICES}
    accessor = {"bufferView": 0, "componentType": _FLOAT, "count": len(points), "type": "VEC3"}
    return {
        "asset": {"version": "2.0", "generator": "photogonio", "extras": {"remark": PLACE}},
        "extensionsUsed": [] if material.metal else list(extensions),
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "sphere"}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 0}, "indices": 1, "material": 0}]}
        ],
        "materials": [
            {
                "name": "photogonio",
                "pbrMetallicRoughness": {
                    "baseColorFactor": [*(float(c) for c in material.base_color), 1.0],
                    "metallicFactor": float(material.metal),
                    "roughnessFactor": material.roughness,
                },
                **({} if material.metal else {"extensions": extensions}),
            }
        ],
        "accessors": [
            accessor | {"min": low, "max": high},
            {"bufferView": 1, "componentType": _UINT16, "count": triangles.size, "type": "SCALAR"},
        ],
        "bufferViews": [view, faces],
        "buffers": [
            {
                "byteLength": len(data),
                "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode(),
            }
        ],
    }


def _sphere() -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of a unit sphere, which are its normals too, and triangles (m, 3), seen from outside."""
    polar, turn = np.linspace(0, np.pi, _RINGS + 1), np.linspace(0, 2 * np.pi, _SEGMENTS + 1)
    t, p = (grid.ravel() for grid in np.meshgrid(polar, turn, indexing="ij"))
    points = np.column_stack([np.sin(t) * np.cos(p), np.cos(t), -np.sin(t) * np.sin(p)])
    k, j = (grid.ravel() for grid in np.meshgrid(np.arange(_RINGS), np.arange(_SEGMENTS), indexing="ij"))
    a, row = k * (_SEGMENTS + 1) + j, _SEGMENTS + 1
    return points, np.concatenate(
        [np.column_stack([a, a + row, a + 1]), np.column_stack([a + 1, a + row, a + row + 1])]
    )
