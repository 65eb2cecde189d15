"""Radiance images: whether an exposure is of any use."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.radiance import LEAST_SHARE, SEEN, RadianceImage, exposure_fault


def test_useless_exposures_are_told(make, light):
    photoset, reader = make(
        [
            ("a.png", "sample", light, {}),
            ("b.png", "sample", np.ones_like(light), {}),
            ("c.png", "sample", np.zeros_like(light), {}),
        ],
        "[radiometry]\ngain_electrons = 20000\nread_noise_electrons = 5",
    )
    faults = [exposure_fault(reader.read(view)) for view in photoset.views("sample")]
    assert faults[0] is None and "saturated" in faults[1] and "black" in faults[2]


@pytest.mark.parametrize(("usable", "fault"), [(0.5, True), (2.0, False)])
def test_a_hundredth_of_the_sample_is_enough(usable, fault):
    """Times LEAST_SHARE of its pixels: not saturated, or above black by SEEN standard deviations."""
    count = round(usable * LEAST_SHARE * 10_000)
    some = (np.arange(10_000) < count).reshape(100, 100)
    value, variance = np.ones((100, 100, 2), np.float32), np.full((100, 100, 2), 0.01, np.float32)
    full = exposure_fault(RadianceImage(value, variance, some, ~some))
    assert full == ("every pixel of the sample is saturated" if fault else None)
    dim = np.where(some[..., None], 1.01, 0.99).astype(np.float32) * np.float32(SEEN * 0.1) * [0, 1]
    black = exposure_fault(RadianceImage(dim, variance, some, np.zeros_like(some)))
    assert black == ("every pixel of the sample is black" if fault else None)


def test_what_lies_beside_the_region_does_not_count():
    value = np.zeros((20, 20, 1), np.float32)
    value[:10] = 1.0
    image = RadianceImage(value, np.full_like(value, 1e-4), value[..., 0] > 0, np.zeros((20, 20), bool))
    assert exposure_fault(image, np.s_[:10, :]) is None and exposure_fault(image, value[..., 0] > 0) is None
    assert "black" in exposure_fault(image, np.s_[10:, :])
    assert exposure_fault(image, np.zeros((20, 20), bool)) is None  # of nothing there is nothing to say
