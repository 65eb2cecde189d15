"""How large the errors of shading's model are, as squares of the print show: no more than expected, and as they are."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.shading.fit import fit_shading
from photogonio.calib.shading.model_error import NOTHING, pooled, shown
from tests.drawn import setups

EACH, VALUES = 20, 4  # samples of a square, values fitted
COMMON = 0.5  # expected error common to a square, beside noise of 1 from sample to sample


def seen(rng, squares, factor, present=1.0):
    """Of a fit of straight lines, where errors common to a square are ``factor`` of what is expected, and are taken
    for ``present`` of it."""
    square = np.repeat(np.arange(squares), EACH)
    design = rng.normal(size=(VALUES, squares))[:, square]
    most = EACH * COMMON**2  # independent errors that come to as much in a square's sum
    sigma = np.sqrt(1 + present**2 * most)
    error = rng.normal(size=len(square)) + factor * COMMON * rng.normal(size=squares)[square]
    score = design / sigma
    normal = score @ score.T
    residual = error / sigma - score.T @ np.linalg.solve(normal, score @ error / sigma)
    return shown(score, residual, normal, square, np.full(len(square), most / sigma**2), present)


@pytest.mark.parametrize("factor", [0.0, 0.3, 0.6, 1.5])
@pytest.mark.parametrize("present", [1.0, 0.4])
def test_errors_are_found_as_large_as_they_are(factor, present):
    """A square's variance is 1 + 5 factor^2 in units of noise, and is known to sqrt(2 / squares) of it. Leaving it out
    makes it look larger by one of ten: 4 values of 40 squares follow it."""
    rng, count, squares = np.random.default_rng(1), 12, 40
    found = pooled([seen(rng, squares, factor, present) for _ in range(count)])
    size = 2 * (1 + 5 * factor**2) / 5 / np.sqrt(count * squares / 2)  # two standard errors of factor^2
    expected = (5 + count * squares * factor**2) / (5 + count * squares)
    assert expected - 2 * size < found**2 < expected + 2 * size + (1 + 5 * factor**2) / 5 / 10 / 0.9


def test_few_squares_that_settle_the_values_between_them_do_not_look_better_than_they_are():
    """Of 8 squares 4 values take half of the error away: without their leverage 0.7 would be found for 1."""
    rng, count = np.random.default_rng(2), 60
    found = pooled([seen(rng, 8, 1.0) for _ in range(count)])
    assert found > 1 - 4 / np.sqrt(count * 8 / 2) / 2


def test_errors_are_at_most_twice_what_is_expected_and_nothing_is_shown_by_nothing():
    assert pooled([seen(np.random.default_rng(3), 40, 9.0)]) == pytest.approx(2.0, rel=0.1)
    assert pooled([NOTHING]) == pooled([]) == 1.0


@pytest.mark.parametrize(("edge", "least", "most"), [(0.0, 0.0, 0.75), (0.08, 1.0, 2.0)])
def test_shadows_whose_edges_are_not_as_the_model_has_them_are_less_sure(monkeypatch, edge, least, most):
    """Drawn paper whose shadows are exact, or miss by 0.08 where 0.03 is expected."""
    monkeypatch.setattr(setups, "EDGE", edge)
    rng = np.random.default_rng(6)
    world = setups.draw_world(rng, fixed=True, views=6)
    scene, readings = setups.scene_of(world), [setups.draw_paper(world, k, rng) for k in range(6)]
    fits = [fit_shading(one, scene, lamp) for one, lamp in zip(readings, world.lamps, strict=True)]
    found = pooled(fit.shown for fit in fits)
    assert least <= found <= most
    # what is less sure tells less of the lamp
    scene = replace(scene, error=found)
    again = [fit_shading(one, scene, fit.local) for one, fit in zip(readings, fits, strict=True)]
    ratio = [np.trace(a.covariance()) / np.trace(b.covariance()) for a, b in zip(again, fits, strict=True)]
    assert (np.median(ratio) > 1.0) == (edge > 0)
