"""How far a round may move a lamp, and what is known of it then."""

import numpy as np
import pytest

from photogonio.calib.adjust.bundle import Adjusted
from photogonio.calib.adjust.lamp_steps import as_moved, within_reach
from photogonio.calib.adjust.lamps import Lamp
from tests.drawn.setups import MIDDLE


def test_a_step_beyond_a_lamps_distance_is_cut_short():
    """Along the ray and across it; what is near enough, and lamps that are fixed, stay as they are."""
    start = np.array([0.0, 0.0, 1000.0])
    steps = {
        "light a": np.array([10.0, 0.0, -5000.0]),  # through the middle
        "light b": np.array([800.0, 0.0, 0.0]),
        "light c": np.array([20.0, 30.0, 200.0]),
        "light d": np.array([900.0, 0.0, -950.0]),
        "light e": np.array([1.0, 0.0, 5000.0]),
    }
    lamps = {n: Lamp(n, None, "point", MIDDLE + start, "board", fixed=n == "d") for n in "abcde"}
    before = {name: MIDDLE + start for name in steps}
    after = {name: MIDDLE + start + step for name, step in steps.items()}
    moved = {n: place - MIDDLE for n, place in within_reach([before], after, lamps, MIDDLE).items()}
    assert set(moved) == {"light a", "light b", "light e"}
    np.testing.assert_allclose(moved["light a"], [0.0, 0.0, 500.0])
    assert np.hypot(*moved["light b"][:2]) / moved["light b"][2] == pytest.approx(0.05, rel=0.5)
    assert np.linalg.norm(moved["light b"]) == pytest.approx(np.hypot(800.0, 1000.0))
    np.testing.assert_allclose(moved["light e"], [0.25, 0.0, 1500.0], atol=0.01)


def test_a_step_is_counted_from_where_shading_has_a_lamp_too():
    """A first guess may be far off; the shadows that lead it home hold there, not where it came from."""
    lamps = {n: Lamp(n, None, "point", MIDDLE, "board") for n in "ab"}
    guess, place = np.array([600.0, 0.0, 1000.0]), np.array([10.0, 0.0, 1000.0])
    shaded, after = (
        {"light a": MIDDLE + place},
        {n: MIDDLE + place + [5.0, 0.0, 0.0] for n in ("light a", "light b")},
    )
    before = {"light a": MIDDLE + guess, "light b": MIDDLE + guess}
    assert set(within_reach([before, shaded], after, lamps, MIDDLE)) == {"light b"}


def test_a_lamp_that_is_kept_nearer_keeps_the_error_of_its_direction():
    up = np.array([0.0, 0.0, 1.0])
    far, near = MIDDLE + 1e6 * up, MIDDLE + 1e4 * up
    covariance = np.diag([2e4, 1e4, 1e6]) ** 2
    found = Adjusted({"light a": far}, {"light a": covariance}, [], 0.0)
    kept = as_moved(found, {"light a": near}, MIDDLE).covariance["light a"]
    np.testing.assert_allclose(
        np.sqrt(np.diag(kept)), [200.0, 100.0, 100.0], rtol=1e-9
    )  # of inverse distance
