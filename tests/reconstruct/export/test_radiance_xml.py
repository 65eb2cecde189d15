"""Radiance's BSDF XML: what trees and matrices share."""

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.radiance import read_radiance
from photogonio.reconstruct.export.formats import find_format
from photogonio.reconstruct.export.radiance_xml import LUMINANCE


def test_colours_become_gray_by_luminance(tmp_path):
    coefficients = np.array([[0.9, 0.5, 0.1]])
    brdf = Brdf(0, ("R", "G", "B"), np.array([[0, 0, 0]]), coefficients, np.zeros((1, 3)))
    find_format("radiance").write(brdf, tmp_path / "a.xml")
    up = np.array([[0.0, 0.0, 1.0]])
    found = read_radiance(tmp_path / "a.xml").evaluate(up, up)[0, 0]
    assert found == pytest.approx(float(coefficients[0] @ LUMINANCE) / (2 * np.pi), rel=1e-4)
