"""A view's paper in gray, and its noise from sample to sample."""

import numpy as np
import pytest

from photogonio.calib.detect.paper_reading import local_noise
from tests.drawn.calibrations import Drawn
from tests.drawn.setups import draw_paper


def test_noise_is_told_apart_by_tone(drawn):
    """White with noise of 1 %, black with 4 %: each to the error of a median of so many differences."""
    _, readings = drawn
    samples, rng = readings[0].samples, np.random.default_rng(0)
    true = np.where(samples.white, 0.01, 0.04)
    level = np.where(samples.white, 0.5, 0.02) * (1.0 + true * rng.normal(size=len(true)))
    found = local_noise(samples, level)
    for white in (True, False):
        own = samples.white == white
        assert len(set(found[own])) == 1
        assert found[own][0] == pytest.approx(0.01 if white else 0.04, rel=5 * 1.2 / np.sqrt(own.sum()))


def test_paper_whose_black_reads_below_nothing_has_a_noise():
    drawn = Drawn(3)
    reading = draw_paper(drawn.world, 0, drawn.rng)
    level = np.where(reading.samples.white, reading.level, -reading.level)
    noise = local_noise(reading.samples, level)
    assert np.isfinite(noise).all() and noise.max() < 0.1


def test_the_span_is_that_of_the_paper_that_is_seen(drawn):
    _, (reading, *_) = drawn
    low, high = reading.span
    flat = reading.samples.points[:, :2]
    assert (flat >= low).all() and (flat <= high).all()
    assert (flat == low).any(axis=0).all() and (flat == high).any(axis=0).all()
