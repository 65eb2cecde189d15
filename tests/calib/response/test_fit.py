"""The tone curve by print alone: known curves, hand-held lamps."""

import numpy as np
import pytest

from photogonio.calib.response.fit import FittedResponse, fit_response
from tests.calib.response.phones import CURVES, FLASH, INK, Tone, photos

LIGHT = np.geomspace(0.01, 0.85, 30)  # of full scale: two decades
MIDDLE = np.full(30, 0.4)


def misses(fitted: FittedResponse, tone: Tone) -> tuple[np.ndarray, np.ndarray]:
    """Of the logarithm of light, against a middle one, and their stated errors."""
    codes, middle = tone(LIGHT), tone(MIDDLE)
    told = fitted.curves.log_light(codes, 0) - fitted.curves.log_light(middle, 0)
    return told - np.log(LIGHT / MIDDLE), fitted.curves.error_between(codes, middle, 0)


@pytest.mark.parametrize("name", ["srgb", "gentle", "shoulder"])
def test_a_curve_is_found_over_two_decades_and_its_error_is_stated(name):
    fitted = fit_response(photos(CURVES[name], count=6, channels=1, seed=5))
    miss, error = misses(fitted, CURVES[name])
    assert (np.abs(miss) < 3 * np.hypot(error, 0.002)).all()
    bright = LIGHT > 0.15  # where white print lies
    assert np.abs(miss[bright]).max() < 0.01


def test_greys_tell_codes_between_black_and_white():
    """Of a curve so strong that black and white alone leave them open; in the mean of four sets, for by luck one may be
    found without."""
    tone, greys = CURVES["contrasty"], (0.65, 0.4, 0.25, 0.15, 0.09, 0.06)
    between = (LIGHT > 0.02) & (LIGHT < 0.1)
    found = []
    for seed in (9, 1, 2, 3):
        sets = (photos(tone, count=6, channels=1, seed=seed, greys=some) for some in ((), greys))
        found.append([misses(fit_response(one), tone) for one in sets])
        miss, error = found[-1][1]
        assert (np.abs(miss) < 3 * np.hypot(error, 0.002)).all()
    # by set, without and with greys, what is missed and what is stated
    bare, told = np.sqrt(np.mean(np.square(found), axis=0))[..., between]
    assert (told[1] < 0.6 * bare[1]).all()
    assert told[0].max() < bare[0].max() / 2


def test_lamps_and_ink_are_found_with_it():
    truth = photos(CURVES["gentle"], count=6, channels=1, seed=5, noise=0.01)
    fitted = fit_response(truth)
    assert fitted.places["flash"] == pytest.approx(FLASH, abs=3.0)
    assert fitted.covariance.shape == (3 * len(fitted.places),) * 2
    off, at = fitted.places["flash"] - FLASH, 3 * list(fitted.places).index("flash")
    assert off @ np.linalg.solve(fitted.covariance[at : at + 3, at : at + 3], off) < 16
    assert fitted.ink == pytest.approx(INK, rel=0.06)
    assert fitted.misfit < 0.002


def test_one_square_in_ten_that_is_dirty_does_not_sway_it():
    clean = photos(CURVES["gentle"], count=6, channels=1, seed=5)
    for one in clean:
        one.code[::10] *= 0.8
    miss, error = misses(fit_response(clean), CURVES["gentle"])
    assert (np.abs(miss) < 3 * np.hypot(error, 0.003)).all()
