"""What a BRDF is, in words: the same on screen, in the report and in the file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.lobes.lobe import Lobe


def described(brdf: Brdf) -> str:
    """As "order 0 and a coat of roughness 0.25 over a diffuse ground"."""
    lobes = [lobe_in_words(lobe) for lobe in brdf.lobes]
    if not lobes:
        return f"order {brdf.order}, no lobe"
    return _listed([f"order {brdf.order}" if len(brdf.modes) else "no modes", *lobes])


def lobe_in_words(lobe: Lobe) -> str:
    """As "a mirror lobe of roughness 0.45 along 30 degrees, 0.15 across"."""
    along, across = lobe.axes
    rough = f"roughness {along:.2g}"
    if lobe.turning:
        rough += f" along {np.degrees(lobe.azimuth):.0f} degrees, {across:.2g} across"
    if lobe.model == "retro":
        return f"a retro-reflective peak of {rough}"
    if lobe.model == "round":
        return f"a round peak about the mirror direction, of {rough}"
    if lobe.model == "blinn-phong":
        return f"a cosine power {2.0 / along**2 - 2.0:.3g} of the half vector (Blinn-Phong), of {rough}"
    if lobe.model == "coat":
        return f"a coat of {rough} over a diffuse ground"
    return f"a mirror lobe of {rough}"


def lobe_details(lobe: Lobe) -> str:
    """Its numbers and its kind, for the report."""
    parts = [f"{'Beckmann' if lobe.distribution == 'beckmann' else 'GGX'} slopes"]
    if not lobe.peak:
        parts.append(f"{lobe.masking} masking")
        exact = lobe.fresnel == "dielectric"
        index = (1.0 + np.sqrt(lobe.f0[0])) / (1.0 - np.sqrt(lobe.f0[0])) if exact else 0.0
        parts.append(
            f"exact Fresnel of index {index:.3f} (base reflectance {lobe.f0[0]:.4g})"
            if exact
            else f"Schlick's Fresnel, base reflectance {_numbers(lobe.f0)}"
        )
    parts.append(f"weight {_numbers(lobe.weight)}")
    if lobe.ground is not None:
        parts.append(f"ground {_numbers(lobe.ground)}")
    return ", ".join(parts)


def _numbers(values: np.ndarray) -> str:
    return " · ".join(f"{value:.4g}" for value in values)


def _listed(parts: Sequence[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
