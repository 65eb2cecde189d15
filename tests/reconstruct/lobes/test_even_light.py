"""What a lobe sends out of even light."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.lobes.even_light import even_light_parts
from photogonio.reconstruct.lobes.lobe import Lobe
from photogonio.reconstruct.modes.quadrature import elevation_rule

ONE = np.ones(2)


def by_angles(lobe: Lobe) -> np.ndarray:
    """The mean of the directional albedo over incidence, weighed by the light, at eight azimuths of half a turn."""
    theta, weight = elevation_rule(6, level=3)
    turns = lobe.azimuth + np.pi * np.arange(8) / 8
    sent = [lobe.directional_albedo(theta, turn) for turn in (turns if lobe.turning else turns[:1])]
    return 2.0 * (weight * np.cos(theta)) @ np.mean(sent, axis=0)


@pytest.mark.parametrize(
    "lobe",
    [
        Lobe(0.3, np.array([0.04, 0.6]), np.array([1.0, 0.5])),
        Lobe(0.4, 0.04 * ONE, ONE, distribution="beckmann", masking="separable", fresnel="dielectric"),
        Lobe(0.4, 0.04 * ONE, ONE, "coat", fresnel="dielectric", ground=np.array([0.5, 0.1])),
        Lobe((0.6, 0.4), np.array([0.04, 0.6]), ONE, azimuth=0.7),
        Lobe(0.4, ONE, 0.3 * ONE, "retro"),
    ],
    ids=["schlick", "dielectric", "coat", "turning", "retro"],
)
def test_it_is_the_mean_over_incidence(lobe: Lobe):
    # a rule of 6 points and 3 halvings is within 3e-4, mostly of the part that grazes
    np.testing.assert_allclose(lobe.bihemispherical_albedo(), by_angles(lobe), rtol=3e-4)


def test_axes_may_be_named_either_way_round():
    one, other = (
        even_light_parts((0.5, 0.3), False, False, -1.0),
        even_light_parts((0.3, 0.5), False, False, -1.0),
    )
    np.testing.assert_allclose(one, other, rtol=1e-9)


def test_a_perfect_interface_loses_only_what_meets_it_twice():
    most = [even_light_parts((rough, rough), False, False, -1.0)[0] for rough in (0.1, 0.3, 0.9)]
    assert 1.0 > most[0] > most[1] > most[2] > 0.4
