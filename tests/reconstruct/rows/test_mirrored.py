"""The odds of azimuths that count from the mirror side, by rows of surfaces whose side is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.rows.mirrored import mirrored_odds
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples, samples_table

THETA = np.radians(np.arange(5.0, 80.0, 15.0))
AT = [
    one.ravel() for one in np.meshgrid(THETA, THETA, np.radians(np.arange(0.0, 181.0, 20.0)), indexing="ij")
]


def rows(f: np.ndarray) -> Cells:
    noise = 1.0 + 0.01 * np.random.default_rng(0).normal(size=len(f))
    theta_i, theta_r, dphi = AT
    read = GoniometerSamples(theta_i, 0.0 * theta_i, theta_r, dphi, (f * noise)[:, None], None, ("Y",))
    return cells_of(samples_table(read))


def gloss() -> np.ndarray:
    """GGX of roughness 0.3 over a matte ground, without masking, along its widening toward grazing."""
    theta_i, theta_r, dphi = AT
    x = np.sin(theta_i) + np.sin(theta_r) * np.cos(dphi)
    y, z = np.sin(theta_r) * np.sin(dphi), np.cos(theta_i) + np.cos(theta_r)
    cosine = z / np.sqrt(x**2 + y**2 + z**2)
    return 0.05 + 0.02 / (
        (cosine**2 * (0.3**2 - 1.0) + 1.0) ** 2 * np.maximum(np.cos(theta_i), np.cos(theta_r))
    )


def test_a_gloss_that_was_turned_is_told_and_one_that_was_not_is_not():
    as_it_is = rows(gloss())
    turned = replace(as_it_is, dphi=np.pi - as_it_is.dphi)
    assert mirrored_odds(turned) > 20.0  # what a table is told at
    assert mirrored_odds(as_it_is) < 0.0


def test_a_surface_without_a_peak_has_no_side():
    assert abs(mirrored_odds(rows(np.full(len(AT[0]), 0.3)))) < 20.0


@pytest.mark.parametrize("times", [0.01, 100.0])
def test_the_unit_has_no_say(times):
    assert mirrored_odds(rows(times * gloss())) == pytest.approx(mirrored_odds(rows(gloss())), rel=1e-6)
