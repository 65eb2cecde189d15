"""What highlights say while shading is fitted: their own place, no more than some samples' worth, right derivatives."""

import numpy as np
import pytest

from photogonio.calib.detect.mirror_rays import MirroredRay
from photogonio.calib.shading.sights import Sights

LAMP = np.array([300.0, 200.0, 900.0])
BALLS = np.array([[10.0, 10.0, 8.0], [170.0, 130.0, 8.0]])


def rays(lamp=LAMP, spread=0.03):
    toward = lamp - BALLS
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    return [MirroredRay(k, BALLS[k], toward[k], spread) for k in range(2)]


def test_the_lamp_itself_costs_nothing_and_a_wrong_one_a_bounded_amount():
    sights = Sights.of(rays())
    assert sights.cost(LAMP) == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(sights.normal(LAMP)[1], 0.0, atol=1e-12)
    assert sights.cost(LAMP * [-1.0, 1.0, 1.0]) == pytest.approx(2 * 5.0**2 / 6)
    assert not np.any(sights.normal(LAMP * [-1.0, 1.0, 1.0])[0])
    assert Sights.of([]) is None


def test_derivatives_are_those_of_the_cost():
    sights, place, step = Sights.of(rays(), 1.5), LAMP + np.array([40.0, -30.0, 60.0]), 1e-3
    by_difference = [(sights.cost(place + s) - sights.cost(place - s)) / (2 * step) for s in step * np.eye(3)]
    np.testing.assert_allclose(sights.normal(place)[1], by_difference, rtol=0.02)


def test_near_it_is_half_the_squares_of_the_angles_over_their_errors():
    sights, turn = Sights.of(rays(spread=0.03)), 1e-3
    across = np.cross(LAMP - BALLS.mean(0), [0.0, 0.0, 1.0])
    place = LAMP + turn * 900.0 * across / np.linalg.norm(across)
    angles = [
        np.arccos(
            min(
                1.0,
                (place - ball) @ (LAMP - ball) / np.linalg.norm(place - ball) / np.linalg.norm(LAMP - ball),
            )
        )
        for ball in BALLS
    ]
    expected = 0.5 * np.sum(np.square(angles)) / (0.03**2 + 0.02**2)
    assert sights.cost(place) == pytest.approx(expected, rel=0.01)
    moved = place - LAMP
    assert 0.5 * moved @ sights.normal(LAMP)[0] @ moved == pytest.approx(expected, rel=0.01)
