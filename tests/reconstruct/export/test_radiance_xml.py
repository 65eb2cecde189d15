"""Radiance's BSDF XML: what trees and matrices share."""

from xml.etree import ElementTree

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.radiance import read_radiance
from photogonio.reconstruct.export.formats import find_format
from photogonio.reconstruct.export.radiance_xml import LUMINANCE, document, gray
from tests.drawn.exports import satin


def test_colours_become_gray_by_luminance(tmp_path):
    coefficients = np.array([[0.9, 0.5, 0.1]])
    brdf = Brdf(0, ("R", "G", "B"), np.array([[0, 0, 0]]), coefficients, np.zeros((1, 3)))
    find_format("radiance").write(brdf, tmp_path / "a.xml")
    up = np.array([[0.0, 0.0, 1.0]])
    found = read_radiance(tmp_path / "a.xml").evaluate(up, up)[0, 0]
    assert found == pytest.approx(float(coefficients[0] @ LUMINANCE) / (2 * np.pi), rel=1e-4)


def test_whatever_a_file_is_called_its_text_is_xml():
    text = document(
        name='a<b & "c"', remark="loses 1 % -- or so", definition="<D/>", basis="<B/>", data="{ 1 }"
    )
    space = "{http://windows.lbl.gov}"
    root = ElementTree.fromstring(text.encode())
    assert root.findtext(f".//{space}Name") == 'a<b & "c"'
    assert root.findtext(f".//{space}ScatteringData").strip() == "{ 1 }"
    assert root.findtext(f".//{space}WavelengthDataDirection") == "Reflection Back"


def test_gray_is_luminance_of_colours_in_whatever_order_and_the_mean_of_others():
    assert LUMINANCE.sum() == pytest.approx(1.0, abs=1e-6)
    value = np.array([[0.9, 0.5, 0.1]])
    rgb, bgr, other = satin(("R", "G", "B")), satin(("B", "G", "R")), satin(("X", "Y", "Z"))
    np.testing.assert_allclose(gray(rgb, value), value @ LUMINANCE, rtol=1e-14)
    np.testing.assert_allclose(gray(bgr, value[:, ::-1]), gray(rgb, value), rtol=1e-14)
    assert gray(other, value) == pytest.approx(0.5)
