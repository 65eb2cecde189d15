"""OpenPBR as a MaterialX 1.39 document: what film and product renderers open.

Base layer and gloss of OpenPBR Surface 1.1 (Academy Software Foundation): a conductor with Schlick's reflectance, or
a dielectric coat of the base over Lambert's ground, which sees what the gloss lets through toward the viewer.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from scipy.interpolate import PPoly

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.export.loss import PLACE
from photogonio.reconstruct.export.principled import (
    Gloss,
    Halves,
    Principled,
    fit_principled,
    of_metal,
)
from photogonio.reconstruct.lobes.interface import coat_albedo, dielectric_fresnel

_DOCUMENT = """<?xml version="1.0"?>
<materialx version="1.39" colorspace="lin_rec709">
  <!-- {place} -->
{tangent}  <open_pbr_surface name="{name}_surface" type="surfaceshader">
    <input name="base_color" type="color3" value="{color}" />
    <input name="base_metalness" type="float" value="{metal}" />
    <input name="base_diffuse_roughness" type="float" value="0" />
    <input name="specular_weight" type="float" value="{weight}" />
    <input name="specular_roughness" type="float" value="{roughness:.5f}" />
    <input name="specular_ior" type="float" value="{ior:.5f}" />
{turned}  </open_pbr_surface>
  <surfacematerial name="{name}" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="{name}_surface" />
  </surfacematerial>
</materialx>
"""
# of the wider roughness; by parts, since programs differ in the sense of MaterialX's rotations
_TANGENT = """  <tangent name="along" type="vector3">
    <input name="space" type="string" value="world" />
  </tangent>
  <bitangent name="across" type="vector3">
    <input name="space" type="string" value="world" />
  </bitangent>
  <multiply name="along_part" type="vector3">
    <input name="in1" type="vector3" nodename="along" />
    <input name="in2" type="float" value="{cos:.6f}" />
  </multiply>
  <multiply name="across_part" type="vector3">
    <input name="in1" type="vector3" nodename="across" />
    <input name="in2" type="float" value="{sin:.6f}" />
  </multiply>
  <add name="turned" type="vector3">
    <input name="in1" type="vector3" nodename="along_part" />
    <input name="in2" type="vector3" nodename="across_part" />
  </add>
"""
_TURNED = """    <input name="specular_roughness_anisotropy" type="float" value="{anisotropy:.5f}" />
    <input name="geometry_tangent" type="vector3" nodename="turned" />
"""


def write_openpbr(brdf: Brdf, path: Path) -> None:
    """The nearest OpenPBR material; of a surface that turns with an anisotropy, and a tangent turned from the
    sample's x."""
    found = fit_principled(brdf, openpbr, turning=brdf.turning)
    two = found.anisotropy > 0.0
    glossy = found.metal or found.f0 > 0
    text = _DOCUMENT.format(
        place=PLACE,
        name="photogonio",
        color=", ".join(f"{c:.6f}" for c in found.base_color),
        metal=int(found.metal),
        weight=int(glossy),
        roughness=found.roughness,
        tangent=_TANGENT.format(cos=np.cos(found.rotation), sin=np.sin(found.rotation)) if two else "",
        turned=_TURNED.format(anisotropy=found.anisotropy) if two else "",
        ior=found.ior if found.f0 > 0 else 1.5,
    )
    path.write_text(text, encoding="utf-8")


def read_openpbr(path: Path) -> Principled:
    """The material of a document that :func:`write_openpbr` wrote."""
    root = ElementTree.parse(path)
    inputs = {node.get("name"): node.get("value", "") for node in root.iter("input")}
    parts = [float(node.findall("input")[1].get("value", "")) for node in root.iter("multiply")]
    rotation = float(np.arctan2(parts[1], parts[0])) if parts else 0.0
    anisotropy = float(inputs.get("specular_roughness_anisotropy", 0.0))
    color = np.array([float(c) for c in inputs["base_color"].split(",")])
    index = float(inputs["specular_ior"])
    f0 = ((index - 1) / (index + 1)) ** 2 * float(inputs["specular_weight"])
    metal = float(inputs["base_metalness"]) == 1.0
    roughness = float(inputs["specular_roughness"])
    return Principled(metal, color, roughness, 0.0 if metal else f0, openpbr, anisotropy, rotation)


def openpbr(
    metal: bool, gloss: Gloss, f0: float, seen: Halves, lobe: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """See :data:`.principled.Model`."""
    if metal:
        return of_metal(lobe, seen)
    if f0 <= 0:
        return np.zeros_like(lobe), np.full_like(lobe, 1 / np.pi)
    through = 1 - albedo_of_gloss(gloss.mean, f0, seen.exit[2])
    return lobe * dielectric_fresnel(seen.cos, f0), through / np.pi


def albedo_of_gloss(alpha: float, f0: float, cos: np.ndarray) -> np.ndarray:
    """(n,) share of the light that a dielectric's gloss sends back from directions of that cosine."""
    table = coat_albedo(False, False, alpha, f0)
    spline = PPoly(np.ascontiguousarray(table.T), np.linspace(0.0, 1.0, len(table) + 1))
    return spline(np.sqrt(np.clip(cos, 0.0, 1.0)))
