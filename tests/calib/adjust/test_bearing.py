"""Places as they are seen: the same to first order, there and back, and straight however far they are."""

import numpy as np
import pytest

from photogonio.calib.adjust.bearing import Bearing
from photogonio.calib.adjust.bundle import Part, adjust, prior_term, quadratic_term

MIDDLE = np.array([90.0, 70.0, 0.0])
PLACE = np.array([400.0, -300.0, 900.0])
SEEN = Bearing(MIDDLE, PLACE)
STEP = 1e-3


def by_difference(what, at):
    return np.array([(what(at + s) - what(at - s)) / (2 * STEP) for s in STEP * np.eye(3)]).T


def test_near_its_place_it_is_the_place():
    np.testing.assert_allclose(SEEN.seen(PLACE), PLACE)
    np.testing.assert_allclose(SEEN.by_place(PLACE), np.eye(3), atol=1e-12)
    np.testing.assert_allclose(SEEN.by_seen(PLACE), np.eye(3), atol=1e-12)


@pytest.mark.parametrize("moved", [[50.0, 20.0, 300.0], [-300.0, 100.0, -400.0], [2e3, -1e3, 4e3]])
def test_there_and_back(moved):
    place = PLACE + moved
    seen = SEEN.seen(place)
    np.testing.assert_allclose(SEEN.place(seen), place, rtol=1e-10)
    np.testing.assert_allclose(SEEN.by_place(place), by_difference(SEEN.seen, place), rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(SEEN.by_seen(seen), by_difference(SEEN.place, seen), rtol=1e-5, atol=1e-4)


def test_a_ray_through_the_middle_is_a_line_that_ends_at_infinity():
    toward = (PLACE - MIDDLE) / np.linalg.norm(PLACE - MIDDLE)
    reach = np.linalg.norm(PLACE - MIDDLE)
    seen = np.array([SEEN.seen(MIDDLE + k * reach * toward) for k in (1.0, 2.0, 1e6)])
    np.testing.assert_allclose((seen - PLACE) @ toward / reach, [0.0, 0.5, 1.0], atol=1e-5)
    beyond = SEEN.place(PLACE + 1.5 * reach * toward) - MIDDLE
    np.testing.assert_allclose(beyond / np.linalg.norm(beyond), toward, atol=1e-9)
    assert np.linalg.norm(beyond) > 100 * reach


def test_behind_it_nothing_is_infinite():
    assert np.isfinite(SEEN.seen(2 * MIDDLE - PLACE)).all()
    assert np.isfinite(SEEN.by_place(2 * MIDDLE - PLACE)).all()


def test_a_lamp_whose_distance_little_tells_keeps_its_direction():
    """Half an inverse distance of error, and a witness at another place who says nothing but a direction, roughly: the
    adjustment ends where direction says, however far it has to go."""
    toward = (PLACE - MIDDLE) / np.linalg.norm(PLACE - MIDDLE)
    reach = np.linalg.norm(PLACE - MIDDLE)
    across = np.eye(3) - np.outer(toward, toward)
    normal = across / (0.001 * reach) ** 2 + np.outer(toward, toward) / (0.5 * reach) ** 2
    told = quadratic_term(
        [Part("light", slice(0, 3), bearing=Bearing(MIDDLE, PLACE))],
        PLACE,
        normal,
        -normal @ (0.9 * reach * toward),
    )
    weak = prior_term("light", PLACE, np.full(3, 1e3 * reach))
    found = adjust({"light": PLACE}, [(told, False), (weak, False)], middle=MIDDLE, places=["light"])
    offset = found.values["light"] - MIDDLE
    far = np.linalg.norm(offset)
    assert far > 5 * reach  # told: ten times as far
    assert np.linalg.norm(np.cross(offset / far, toward)) < 0.001
    sigma = np.sqrt(np.trace(across @ found.covariance["light"]) / 2) / far
    assert sigma == pytest.approx(0.001, rel=0.1)
