"""What a photo's print tells of its tone curve, on drawn samples."""

import numpy as np
import pytest

from photogonio.calib.detect.paper import PaperSamples
from photogonio.calib.diagnose.photos.tone_print import (
    black_and_brightest,
    black_and_white,
    black_share,
    power_of_light,
)


def test_black_beside_white_that_is_blurred_at_its_edges():
    """Of a small print: an eighth of the white is as bright as it is, in a light that grows along the board."""
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(0, 100, (4000, 2)), np.zeros(4000)])
    white, light = rng.random(4000) < 0.5, 1.0 + 0.01 * points[:, 0]
    shown = np.where(white, np.where(rng.random(4000) < 0.25, 1.0, rng.uniform(0.8, 1.0, 4000)), 0.06) * light
    value, square = np.repeat(shown[:, None], 3, axis=1), np.zeros(4000, int)
    black, beside = black_and_brightest(PaperSamples(points, white, value, 1e-6 * value, square))
    assert black_share(black, beside) == pytest.approx(
        0.06, rel=0.03
    )  # light grows by that over the eight nearest


def test_black_across_a_shadows_edge_from_the_white_beside_it_is_not_compared():
    """Squares of 12 under light whose edge passes at any place of a square; black is read clear of its edges, so that
    the nearest white may lie all on one side. What lies in deep shadow is lost in the noise."""
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(np.arange(0.5, 96.0), np.arange(0.5, 72.0))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    column, row = (points[:, :2] // 12).astype(int).T
    clear = np.minimum(points[:, :2] % 12, 12 - points[:, :2] % 12).min(1) > 2
    points, white = points[clear], ((column + row) % 2 == 0)[clear]
    for edge in rng.uniform(20, 80, 6):
        light = np.where(points[:, 0] + 0.3 * points[:, 1] > edge, 1.0, 1e-3)
        noise = 5e-4
        shown = np.where(white, 1.0, 0.05) * light + noise * rng.normal(size=len(white))
        value = np.repeat(shown[:, None], 3, axis=1)
        samples = PaperSamples(
            points, white, value, np.full_like(value, 3 * noise**2), np.zeros(len(white), int)
        )
        black, beside = black_and_brightest(samples)
        assert len(black) > 100
        np.testing.assert_allclose(black / beside, 0.05, atol=6 * noise)


@pytest.mark.parametrize("power", [0.45, 1.0, 2.2])
def test_the_power_by_which_white_grows_with_light(power):
    """Exact on what is lit, whatever lies in shadow."""
    x, y = np.meshgrid(np.linspace(0, 180, 40), np.linspace(0, 140, 30))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    place = np.array([20.0, 40.0, 380.0])
    offset = place - points
    level = (3e4 * offset[:, 2] / np.linalg.norm(offset, axis=1) ** 3) ** power
    level[(points[:, 0] > 60) & (points[:, 0] < 90)] *= 0.1
    assert power_of_light(points, level, place) == pytest.approx(power, abs=1e-6)
    assert power_of_light(points, level, place + np.array([0, 0, 1e5])) is None  # evenly lit


def test_too_little_print_is_not_compared():
    points, value = np.zeros((30, 3)), np.ones((30, 3))
    few = PaperSamples(points, np.arange(30) < 15, value, value, np.zeros(30, int))
    assert black_and_white(few) is None
    assert np.isnan(black_share(np.ones((4, 3)), np.zeros((4, 3))))
