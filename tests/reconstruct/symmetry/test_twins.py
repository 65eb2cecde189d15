"""Exchanged pairs compared directly: held, broken, or not to be told."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.symmetry.twins import BROKEN, HELD, UNTOLD, compare_twins
from tests.drawn.goniometer import glossy, in_plane, lobe, matte, measured, regular, rough, scattered

SQUARE = regular(15.0, 15.0, 30.0)
PLACES = {"square": SQUARE, "grid": regular(), "plane": in_plane(), "random": scattered(600)}
SURFACES = {"matte": matte(0.5), "rough": rough(0.6), "satin": glossy(0.3, 0.1, 20.0)}


def twins(surface, at, **noise):
    table = measured(surface, at, **noise)
    return compare_twins(table.theta_i, table.theta_r, table.phi_r - table.phi_i, table.value[:, 0])


@pytest.mark.parametrize(
    "at", [SQUARE, regular(), in_plane(), scattered(600)], ids=["square", "grid", "plane", "random"]
)
@pytest.mark.parametrize(
    "surface", [matte(0.5), rough(0.6), glossy(0.3, 0.1, 20.0)], ids=["matte", "rough", "satin"]
)
@pytest.mark.parametrize("noise", [0.0, 0.005, 0.02])
def test_a_reciprocal_surface_is_never_broken(at, surface, noise):
    assert twins(surface, at, noise=noise).verdict in (HELD, UNTOLD)


@pytest.mark.parametrize(
    "surface", [matte(0.5), rough(0.6), glossy(0.3, 0.1, 20.0)], ids=["matte", "rough", "satin"]
)
def test_on_a_grid_it_held(surface):
    found = twins(surface, SQUARE)
    assert found.verdict == HELD and found.count > 100


def test_phong_over_the_cosine_is_broken_by_that_cosine():
    """Of f = P(i, r) / cos(theta_i), P symmetric, twins differ by cos(theta_r) / cos(theta_i)."""
    found = twins(lambda ti, tr, p: (0.1 + lobe(ti, tr, p, 10.0)) / np.cos(ti), SQUARE)
    assert found.verdict == BROKEN
    assert abs(found.cosine - 1.0) < 5.0 * found.cosine_error + 0.01 and found.left < 0.05


def test_a_gloss_alone_over_the_cosine_is_broken():
    """Most exchanged pairs are of the ground, which is reciprocal: those within the lobe are told by their number."""
    found = twins(lambda ti, tr, p: 0.1 + lobe(ti, tr, p, 20.0) / np.cos(ti), SQUARE, noise=0.005)
    assert found.verdict == BROKEN and found.apart > 0.03


def test_another_breach_is_broken_and_no_cosine():
    def f(ti, tr, p):
        return 0.2 * (1.0 + 0.3 * np.sin(ti) ** 2 - 0.1 * np.cos(tr) ** 4)

    found = twins(f, SQUARE)
    assert found.verdict == BROKEN
    assert abs(abs(found.cosine) - 1.0) > 0.25 or found.left > 0.2


def test_what_noise_hides_cannot_be_told():
    assert twins(matte(0.05), regular(), noise=0.3).verdict == UNTOLD
    assert twins(lambda ti, tr, p: 0.1 * (1 + 0.03 * ti), SQUARE, noise=0.2).verdict == UNTOLD


def test_without_exchanged_pairs_nothing_is_told():
    theta_r, dphi = np.meshgrid(np.radians(np.arange(0, 20, 5.0)), np.radians(np.arange(0, 360, 30.0)))
    at = (np.full(theta_r.size, np.radians(60.0)), theta_r.ravel(), dphi.ravel())
    assert twins(matte(0.5), at) == compare_twins(*at, np.full(theta_r.size, 0.5 / np.pi))
    assert twins(matte(0.5), at).verdict == UNTOLD


def test_true_zeros_and_a_narrow_peak_prove_nothing():
    """Read to a step, a steep gloss has few readings, each of a few steps."""
    table = measured(glossy(0.0, 0.3, 50.0), regular())
    value = np.round(table.value[:, 0] / 0.005) * 0.005
    assert compare_twins(table.theta_i, table.theta_r, table.phi_r, value).verdict != BROKEN


def test_mirrored_pairs_at_exactly_mirrored_azimuths_tell_the_noise():
    """Either of two rows at one place may be taken for the nearest to itself: the noise was found a tenth of what it
    is, and reciprocity broken."""
    steps = (np.arange(0, 76, 10), np.arange(0, 81, 5), np.array([0, 90, 180, 270]))
    theta_i, theta_r, dphi = (np.radians(one).ravel() for one in np.meshgrid(*steps, indexing="ij"))
    at = (theta_i, theta_r, dphi)
    for seed, surface in enumerate([*SURFACES.values()] * 4):
        found = twins(surface, at, noise=0.04, seed=seed)
        assert found.verdict != BROKEN and 0.02 < found.noise < 0.12  # of two readings 0.057
