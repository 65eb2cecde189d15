"""Cosines, sines and half vectors of many pairs side by side, against numpy's, near the pole and the horizon too."""

import math

import numpy as np
import pytest

from photogonio.capture.jit import jit
from photogonio.reconstruct.lobes.lanes import both_directions, stretch
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.modes.kernel import LANES

# of a sum of a dozen roundings of numbers up to 4
ROUNDING = 16 * np.finfo(float).eps


@jit
def told(theta_i, phi_i, theta_r, phi_r, count):
    lanes = np.zeros((6, LANES))
    cos_i, cos_r, sin_i, sin_r, length2, aside = lanes[0], lanes[1], lanes[2], lanes[3], lanes[4], lanes[5]
    both_directions(theta_i, phi_i, theta_r, phi_r, 0, count, cos_i, cos_r, sin_i, sin_r, length2, aside)
    return lanes


@jit
def stretched(phi_i, phi_r, axes, sin_i, sin_r):
    aside = np.zeros(LANES)
    stretch(phi_i, phi_i, phi_r, phi_r, 0, LANES, axes, sin_i, sin_r, aside)
    return sin_i, sin_r, aside


def angles(seed: int) -> tuple[np.ndarray, ...]:
    """Incidence and azimuth of both directions, some at the pole, the horizon and opposite one another."""
    rng = np.random.default_rng(seed)
    theta_i, theta_r = rng.uniform(0.0, math.pi / 2, (2, LANES))
    phi_i, phi_r = rng.uniform(-3.0 * math.pi, 3.0 * math.pi, (2, LANES))
    theta_i[0], theta_r[1], theta_i[2] = 0.0, math.pi / 2 - 1e-9, 1e-9
    theta_r[3], phi_r[3] = theta_i[3], phi_i[3] + math.pi
    return theta_i, phi_i, theta_r, phi_r


@pytest.mark.parametrize("seed", range(5))
def test_they_are_what_the_angles_say(seed):
    theta_i, phi_i, theta_r, phi_r = angles(seed)
    cos_i, cos_r, sin_i, sin_r, length2, aside = told(theta_i, phi_i, theta_r, phi_r, LANES)
    for theta, cosine, sine in ((theta_i, cos_i, sin_i), (theta_r, cos_r, sin_r)):
        np.testing.assert_allclose(cosine, np.cos(theta), rtol=1e-9, atol=ROUNDING)
        np.testing.assert_allclose(sine, np.sin(theta), rtol=ROUNDING)
    half = unit_vectors(theta_i, phi_i) + unit_vectors(theta_r, phi_r)
    # an azimuth of three half turns is itself rounded
    np.testing.assert_allclose(length2, (half**2).sum(-1), atol=4 * ROUNDING)
    np.testing.assert_allclose(aside, (half[:, :2] ** 2).sum(-1), atol=4 * ROUNDING)


def test_a_narrow_lobe_keeps_its_digits():
    """A ten-thousandth from the mirror direction, where 1 - cos^2 would keep eight digits."""
    theta = np.full(LANES, 1.0)
    off = np.linspace(1e-6, 1e-4, LANES)
    *_, aside = told(theta, np.zeros(LANES), theta + off, np.full(LANES, math.pi), LANES)
    known = 4.0 * (np.cos(theta + off / 2) * np.sin(off / 2)) ** 2
    np.testing.assert_allclose(aside, known, rtol=1e-9)


def test_lanes_beyond_the_last_pair_repeat_it():
    given = angles(7)
    whole, part = told(*given, LANES), told(*(one[:3].copy() for one in given), 3)
    np.testing.assert_array_equal(part[:, :3], whole[:, :3])
    np.testing.assert_array_equal(part[:, 3:], np.repeat(part[:, 2:3], LANES - 3, axis=1))


def test_two_roughnesses_stretch_what_lies_along_and_across():
    theta_i, phi_i, theta_r, phi_r = angles(11)
    along, across, azimuth = 0.1, 0.4, 0.7
    hidden_i, hidden_r, aside = stretched(
        phi_i, phi_r, np.array([along, across, azimuth]), np.sin(theta_i), np.sin(theta_r)
    )
    turn = np.array([[math.cos(azimuth), math.sin(azimuth)], [-math.sin(azimuth), math.cos(azimuth)]])
    flat_i, flat_r = (
        unit_vectors(theta, phi)[:, :2] @ turn.T for theta, phi in ((theta_i, phi_i), (theta_r, phi_r))
    )
    slopes = np.array([along, across])
    np.testing.assert_allclose(hidden_i, np.linalg.norm(flat_i * slopes, axis=1), atol=ROUNDING)
    np.testing.assert_allclose(hidden_r, np.linalg.norm(flat_r * slopes, axis=1), atol=ROUNDING)
    np.testing.assert_allclose(
        aside, (((flat_i + flat_r) / slopes) ** 2).sum(-1), rtol=1e-12, atol=1e3 * ROUNDING
    )
