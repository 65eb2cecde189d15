"""BRDFs in words."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.words import described, lobe_details
from photogonio.reconstruct.lobes.lobe import Lobe


def test_words_are_those_of_the_page():
    plain = Brdf(0, ("Y",), np.zeros((1, 3), int), np.ones((1, 1)), np.ones((1, 1)))
    one = np.ones(1)
    coated = Lobe(0.25, 0.04 * one, one, "coat", fresnel="dielectric", ground=0.3 * one)
    brushed = Lobe((0.45, 0.15), one, one, azimuth=np.radians(30.0))

    def said(*lobes):
        return described(Brdf(0, ("Y",), plain.modes, plain.coefficients, plain.standard_errors, lobes=lobes))

    assert said() == "order 0, no lobe"
    assert said(coated) == "order 0 and a coat of roughness 0.25 over a diffuse ground"
    assert said(brushed) == "order 0 and a mirror lobe of roughness 0.45 along 30 degrees, 0.15 across"
    assert said(coated, Lobe(0.1, one, one, "retro")).endswith(
        "ground and a retro-reflective peak of roughness 0.1"
    )


def test_details_name_what_a_lobe_is_of():
    one = np.ones(1)
    coat = Lobe(
        0.25, 0.04 * one, one, "coat", fresnel="dielectric", distribution="beckmann", ground=0.3 * one
    )
    said = lobe_details(coat)
    # the base reflectance 0.04 is ((n - 1) / (n + 1))^2 of n = 1.5
    assert "Beckmann slopes" in said and "index 1.500" in said and said.endswith("ground 0.3")
    assert "Schlick's Fresnel, base reflectance 0.5 · 0.7" in lobe_details(
        Lobe(0.2, np.array([0.5, 0.7]), np.ones(2))
    )
    retro = lobe_details(Lobe(0.2, one, one, "retro"))
    assert "masking" not in retro and "Fresnel" not in retro
