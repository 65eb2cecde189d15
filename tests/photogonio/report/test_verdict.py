"""The verdict's four answers, and coverage in words."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from photogonio.capture.diagnosis import Diagnosis
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.report.coverage_words import coverage_of
from photogonio.report.verdict import advice_of


def table(theta_i, theta_r, dphi):
    """Pairs on a grid, degrees."""
    grids = np.meshgrid(theta_i, theta_r, dphi, indexing="ij")
    i, r, d = (np.radians(one).ravel() for one in grids)
    return SimpleNamespace(incident=unit_vectors(i, 0.0), exit=unit_vectors(r, d))


def test_a_full_table_misses_nothing():
    every = table(np.arange(0, 86, 2.5), np.arange(0, 86, 2.5), np.arange(0, 181, 10.0))
    found = coverage_of(every)
    assert found.missing == ()
    assert "from 0 to 85 degrees from the normal" in found.said[0]
    assert any("mirror direction was seen, to 10 degrees, at 0 to 9" in one for one in found.said)


def test_what_was_not_seen_is_named():
    """Light to 50 degrees, seen from above alone, on the lamp's other side."""
    found = coverage_of(table(np.arange(20, 51, 2.5), np.arange(40, 61, 2.5), np.arange(60, 121, 10.0)))
    assert (
        "light from beyond 50 degrees" in found.missing and "a look from beyond 60 degrees" in found.missing
    )
    assert {"the mirror direction", "the lamp's own direction"} <= set(found.missing)
    assert any("100 % of the exit directions at 60 to 80" in one for one in found.missing)
    assert any("nowhere" in one for one in found.said)


def test_a_share_is_that_of_the_solid_angle():
    """Exit directions within 60 degrees are half of the hemisphere's solid angle."""
    half = table(np.arange(1, 30, 3.0), np.arange(0.5, 60, 1.0), np.arange(1, 180, 5.0))
    assert "50 % at 0 to 30 degrees of incidence" in coverage_of(half).said[1]


def test_advice_is_given_once_and_none_is_none():
    told = [Diagnosis("retro-unseen"), Diagnosis("photo-left-out"), Diagnosis("retro-unseen")]
    advice = advice_of(told)
    assert len(advice) == 1 and "beside the camera" in advice[0]
