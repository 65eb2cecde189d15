"""Colour differences against published pairs and formulas written out here."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.compare.appearance import _delta_e_2000, _psnr, difference_itp

# IEC 61966-2-1, linear sRGB to XYZ with Y of white 1
XYZ_FROM_RGB = np.array(
    [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
)  # fmt: skip
D65 = XYZ_FROM_RGB.sum(1)
# ITU-R BT.2087, linear BT.709 to linear BT.2020
WIDE_FROM_RGB = np.array(
    [[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]]
)  # fmt: skip
# ITU-R BT.2100
LMS_FROM_WIDE = np.array([[1688, 2146, 262], [683, 2951, 462], [99, 309, 3688]]) / 4096
ITP_FROM_LMS = (
    np.array([[2048, 2048, 0], [0.5 * 6610, -0.5 * 13613, 0.5 * 7003], [17933, -17390, -543]]) / 4096
)


def rgb_of_lab(lab) -> np.ndarray:
    """Linear sRGB of CIE 1976 L*a*b*, written out."""
    level = (np.array(lab, float)[0] + 16) / 116
    f = np.array([level + lab[1] / 500, level, level - lab[2] / 200])
    xyz = D65 * np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29))
    return np.linalg.solve(XYZ_FROM_RGB, xyz)


def pq(luminance: np.ndarray) -> np.ndarray:
    """SMPTE ST 2084 of cd/m2."""
    power = (np.asarray(luminance, float) / 10_000) ** (2610 / 16384)
    return ((3424 / 4096 + 2413 / 128 * power) / (1 + 2392 / 128 * power)) ** (2523 / 32)


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [
        # of the pairs of Sharma, Wu & Dalal (Color Research and Application 2005) those that a display shows
        ((50, 2.5, 0), (50, 0, -2.5), 4.3065),
        ((50, 2.5, 0), (73, 25, -18), 27.1492),
        ((50, 2.5, 0), (61, -5, 29), 22.8977),
        ((50, 2.5, 0), (58, 24, 15), 19.4535),
        ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644),
    ],
)
def test_delta_e_2000_of_the_published_pairs(a, b, expected):
    one, two = rgb_of_lab(a), rgb_of_lab(b)
    assert min(one.min(), two.min()) > 0 and max(one.max(), two.max()) < 1
    # the standard's matrix has four digits
    assert _delta_e_2000(one[None], two[None])[0] == pytest.approx(expected, rel=2e-3)


def testdifference_itp_is_the_recommendations_formula():
    rng = np.random.default_rng(1)
    a, b = rng.uniform(0.02, 1.2, (2, 50, 3))
    itp = [pq(203 * x @ WIDE_FROM_RGB.T @ LMS_FROM_WIDE.T) @ ITP_FROM_LMS.T for x in (a, b)]
    expected = 720 * np.linalg.norm(itp[0] - itp[1], axis=1)
    # BT.2087's matrix has four digits
    np.testing.assert_allclose(difference_itp(a, b), expected, rtol=3e-3, atol=0.02)


def test_greys_differ_in_lightness_alone():
    """Delta E 2000 of greys is the lightness difference over S_L; Delta E ITP that of the PQ signals, times 720."""
    y = np.array([0.18, 0.5])
    a, b = (np.full((1, 3), value) for value in y)
    lightness = 116 * np.cbrt(y) - 16
    offset = (lightness.mean() - 50) ** 2
    expected = np.ptp(lightness) / (1 + 0.015 * offset / np.sqrt(20 + offset))
    assert _delta_e_2000(a, b)[0] == pytest.approx(expected, rel=1e-3)
    assert difference_itp(a, b)[0] == pytest.approx(720 * np.ptp(pq(203 * y)), rel=1e-3)


def test_psnr_is_of_the_displayed_values():
    """sRGB of 0.2 and 0.25 by the standard's formula; beyond white nothing differs any more."""
    shown = [1.055 * value ** (1 / 2.4) - 0.055 for value in (0.2, 0.25)]
    a, b = np.full((9, 3), 0.2), np.full((9, 3), 0.25)
    assert _psnr(a, b) == pytest.approx(-20 * np.log10(shown[1] - shown[0]), rel=1e-6)
    assert _psnr(np.full((9, 3), 1.5), np.full((9, 3), 3.0)) == np.inf
