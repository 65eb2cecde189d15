"""What an export loses, where that is known by other means."""

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf, Lobe
from photogonio.reconstruct.export.loss import ANGLES, loss_of


def glossy(roughness) -> Brdf:
    lobe = Lobe(roughness, np.full(2, 0.05), np.ones(2))
    return Brdf(0, ("A", "B"), np.array([[0, 0, 0]]), np.full((1, 2), 0.8), np.zeros((1, 2)), lobes=(lobe,))


@pytest.mark.parametrize("roughness", [0.4, 0.05])
def test_a_factor_is_a_loss_of_that_share(roughness):
    brdf = glossy(roughness)
    loss = loss_of(brdf, lambda i, r: brdf(i, r) * np.array([1.0, 1.02]))
    assert loss.rms == pytest.approx((0.02, 0.02), rel=1e-9)
    assert loss.albedo == pytest.approx([1.02] * len(ANGLES), rel=1e-9)
    # the quadrature follows the lobe: closed form of the modes, adaptive for the lobe
    expected = 1.02 * brdf.directional_albedo(np.radians(ANGLES)).max()
    assert loss.brightest == pytest.approx(expected, rel=1e-3)


def test_a_constant_that_is_added_is_known():
    brdf = Brdf(0, ("A",), np.array([[0, 0, 0]]), np.full((1, 1), 1.0), np.zeros((1, 1)))
    loss = loss_of(brdf, lambda i, r: brdf(i, r) + 0.1 / (2 * np.pi))
    assert loss.rms == pytest.approx((0.1, 0.1), rel=1e-9)


def test_the_words_name_the_worst_angle():
    brdf = glossy(0.3)
    loss = loss_of(brdf, lambda i, r: brdf(i, r) * np.where(i[:, 2:] < 0.1, 0.9, 1.0))
    assert "-10 % off" in str(loss)
    assert loss.to_dict()["albedo_ratio"]["85"] == pytest.approx(0.9)
