"""Sessions' scales weigh as their errors have it, and what is left of those is stated."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.estimate.session_scales import Offsets
from photogonio.run.session_scales import CONTRADICTED, settled

EVEN = np.full(2, 1e12)  # views' errors of nothing


def offsets(*value: float, error: float = 0.0) -> Offsets:
    """Of one channel."""
    found = np.array([0.0, *value])[:, None]
    return Offsets(found, np.where(np.arange(len(found)) > 0, error, 0.0)[:, None])


def test_scales_weigh_by_the_inverse_squares_of_their_errors():
    found = settled(offsets(0.03), np.array([0.01, 0.02]), 0.002, EVEN)
    np.testing.assert_allclose(np.log(found.factor[:, 0]), [0.2 * 0.03, -0.8 * 0.03])
    spread = 0.03**2 / (0.01**2 + 0.02**2)  # chi squared of one degree of freedom
    assert found.common == pytest.approx(np.sqrt(spread * 0.8 * 0.01**2 + 0.002**2))
    assert found.apart == pytest.approx(np.sqrt(spread))
    np.testing.assert_allclose(found.doubt, 0.0, atol=1e-9)


def test_sessions_that_do_not_meet_keep_their_scales():
    found = settled(offsets(0.2, error=1e4), np.array([0.01, 0.02]), 0.0, EVEN)
    np.testing.assert_allclose(found.factor, 1.0, rtol=1e-6)
    assert found.doubt == pytest.approx([0.0, np.hypot(0.01, 0.02)], rel=1e-3)
    assert found.common == pytest.approx(0.5 * np.hypot(0.01, 0.02), rel=1e-3)  # of the mean of both


def test_a_relative_session_takes_the_absolute_ones_scale():
    found = settled(offsets(1.5, error=0.01), np.array([0.03, np.inf]), 0.0, np.array([1e12, 1e3]))
    np.testing.assert_allclose(np.log(found.factor[:, 0]), [0.0, -1.5], atol=1e-4)
    assert found.common == pytest.approx(0.03, rel=1e-3) and found.apart == 0.0


def test_scales_that_contradict_one_another_are_as_unsure_as_they_differ():
    found = settled(offsets(0.1), np.array([0.01, 0.01]), 0.0, EVEN)
    assert found.apart == pytest.approx(0.1 / np.hypot(0.01, 0.01)) and found.apart > CONTRADICTED
    assert found.common == pytest.approx(0.1 / 2)


def test_what_is_stated_is_what_is_left_of_drawn_errors():
    """Of 2000 draws the mean square of the remaining error over that stated is 1 within four of its own errors, where
    no draw was taken for a contradiction."""
    rng, own, error, weight = (
        np.random.default_rng(3),
        np.array([0.01, 0.02, 0.015]),
        0.006,
        np.array([3.0, 1, 2]) * 1e9,
    )
    left = []
    for _ in range(2000):
        off, miss = rng.normal(0.0, own), rng.normal(0.0, error, 2)
        found = settled(offsets(*(off[1:] - off[0] + miss), error=error), own, 0.0, weight)
        remaining = weight @ (off + np.log(found.factor[:, 0])) / weight.sum()
        left.append(remaining / (found.common / max(1.0, found.apart)))
    assert np.mean(np.square(left)) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / 2000))
