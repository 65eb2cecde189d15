"""Compiled sums of lobes: peaks in closed form, what they are added to, and independence of company."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.lobes.lobe_sums import above_horizon, add_lobe, mirror_values
from photogonio.reconstruct.modes.kernel import LANES
from tests.drawn.brdfs import COATS, MIRRORS, RETROS, coat

EVERY = [*MIRRORS, COATS[0], coat((0.4, 0.2), azimuth=0.7), *RETROS]


def pairs(n: int) -> list[np.ndarray]:
    rng = np.random.default_rng(0)
    theta, phi = rng.uniform(0.0, 1.5, (2, n)), rng.uniform(-np.pi, np.pi, (2, n))
    return [theta[0], phi[0], theta[1], phi[1]]


def alone(lobe, angles) -> np.ndarray:
    result = np.zeros((len(angles[0]), 3))
    add_lobe(lobe.terms(), angles, result)
    return result


@pytest.mark.parametrize("lobe", EVERY[::3], ids=lambda lobe: f"{lobe.model} {lobe.roughness}")
def test_a_lobe_is_added_to_what_is_there_or_takes_its_place_with_a_base(lobe):
    angles, before = pairs(100), np.random.default_rng(1).normal(size=(100, 3))
    added, base = before.copy(), np.array([0.1, 0.2, 0.3])
    add_lobe(lobe.terms(), angles, added)
    np.testing.assert_allclose(added, before + alone(lobe, angles), rtol=1e-14)
    add_lobe(lobe.terms(), angles, before, base)
    np.testing.assert_allclose(before, base + alone(lobe, angles), rtol=1e-14)


@pytest.mark.parametrize("lobe", EVERY[::3], ids=lambda lobe: f"{lobe.model} {lobe.roughness}")
@pytest.mark.parametrize("count", [1, LANES, LANES + 1])
def test_a_pairs_value_does_not_depend_on_its_company(lobe, count):
    angles = pairs(2 * LANES + 3)
    np.testing.assert_array_equal(alone(lobe, [a[:count] for a in angles]), alone(lobe, angles)[:count])


@pytest.mark.parametrize("roughness", [0.01, 0.1, 0.5])
def test_where_a_lobe_is_highest_only_the_slopes_peak_is_left(roughness):
    """D = 1 / (pi roughness^2) of either kind: F D / 4 at the normal, where nothing is hidden, and of peaks about the
    light or about the mirror direction D / 4 at any incidence."""
    up = [np.zeros(1)] * 4
    for beckmann in (False, True):
        own = (roughness, roughness, 0.0, beckmann, False, 0.06)
        assert mirror_values(own, up)[0] == pytest.approx(0.06 / (4.0 * np.pi * roughness**2), rel=1e-12)
    for lobe in RETROS:
        peak = replace(lobe, roughness=roughness)
        there = np.pi if lobe.model == "round" else 0.0
        angles = [
            np.array([0.0, 0.8]),
            np.array([0.0, 1.0]),
            np.array([0.0, 0.8]),
            np.array([0.0, 1.0 + there]),
        ]
        expected = np.tile(lobe.weight / (4.0 * np.pi * roughness**2), (2, 1))
        np.testing.assert_allclose(alone(peak, angles), expected, rtol=1e-12)


@pytest.mark.parametrize("beckmann", [False, True])
def test_two_roughnesses_that_are_all_but_equal_are_one(beckmann):
    angles = pairs(200)
    one = mirror_values((0.3, 0.3, 0.0, beckmann, False, 0.05), angles)
    two = mirror_values((0.3, 0.3 * (1.0 + 1e-9), 0.7, beckmann, False, 0.05), angles)
    # the exponent of Gaussian slopes is up to some hundreds, and so is what a change of the roughness is multiplied by
    np.testing.assert_allclose(two, one, rtol=1e-6, atol=1e-12)


def test_a_brushed_lobe_turns_with_its_azimuth():
    angles = pairs(200)
    turned = [angles[0], angles[1] + 0.9, angles[2], angles[3] + 0.9]
    first = mirror_values((0.5, 0.2, 0.3, False, False, 0.05), angles)
    np.testing.assert_allclose(mirror_values((0.5, 0.2, 1.2, False, False, 0.05), turned), first, rtol=1e-9)
    np.testing.assert_allclose(
        mirror_values((0.2, 0.5, 0.3 + 0.5 * np.pi, False, False, 0.05), angles), first, rtol=1e-9
    )


def test_arrays_that_compiled_code_cannot_take_are_taken():
    angles = pairs(64)
    expected = alone(MIRRORS[0], angles)
    strided = [np.repeat(a, 2)[::2] for a in angles]
    frozen = [a.copy() for a in angles]
    for a in frozen:
        a.setflags(write=False)
    for given in (strided, frozen):
        np.testing.assert_array_equal(alone(MIRRORS[0], given), expected)


def test_angles_below_the_horizon_and_what_is_no_number_are_seen():
    some = np.linspace(-0.5, 0.5, 1001) * np.pi
    still = np.zeros_like(some)
    assert above_horizon(some, some[::-1]) and above_horizon(np.broadcast_to(0.3, 5), np.zeros(5))
    for wrong in (np.nextafter(0.5 * np.pi, 2.0), -1.6, np.nan):
        other = some.copy()
        other[777] = wrong
        assert not above_horizon(other, still) and not above_horizon(still, other)
