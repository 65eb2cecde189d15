"""Projection of any BRDF: exact within the span, and honest about its error elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.modes import basis as m
from photogonio.reconstruct.modes.projection import project
from photogonio.synthetic.brdf.library import MODELS

LISTS = {
    "isotropic": (m.isotropic_modes, 9),
    "chiral": (m.chiral_modes, 7),
    "reciprocal": (m.reciprocal_modes, 4),
    "general": (m.general_modes, 4),
}


def expansion(symmetry: str, quantity: str = "brdf", seed: int = 1) -> Brdf:
    make, order = LISTS[symmetry]
    modes = make(order)
    values = np.random.default_rng(seed).normal(size=(len(modes), 2))
    return Brdf(order, ("a", "b"), modes, values, abs(values), quantity=quantity, symmetry=symmetry)


@pytest.mark.parametrize("quantity", ["brdf", "brdf_cos", "brdf_cos_cos"])
@pytest.mark.parametrize("symmetry", ["isotropic", "reciprocal", "general"])
def test_in_the_span_nothing_is_lost(symmetry, quantity):
    given = expansion(symmetry, quantity)
    found = project(given, given.order, symmetry=symmetry, quantity=quantity)
    assert np.array_equal(found.modes, given.modes)
    assert np.abs(found.coefficients - given.coefficients).max() <= 1e-10 * np.abs(given.coefficients).max()
    assert (found.error < 1e-10).all()
    assert found.norm == pytest.approx(np.linalg.norm(given.coefficients, axis=0), rel=1e-10)
    again = Brdf(given.order, given.channels, found.modes, found.coefficients, found.coefficients,
                 quantity=quantity, symmetry=symmetry)  # fmt: skip
    angles = np.random.default_rng(2).uniform(0, 1.5, (4, 300))
    exact = given.evaluate(*angles)
    assert np.abs(again.evaluate(*angles) - exact).max() <= 1e-10 * np.abs(exact).max()


def test_chiral_part_is_seen_and_separated():
    modes = m.chiral_modes(5)
    values = np.random.default_rng(3).normal(size=(len(modes), 1))

    def brdf(incident, exit):
        theta_i, theta_r = np.arccos(incident[..., 2]), np.arccos(exit[..., 2])
        dphi = np.arctan2(exit[..., 1], exit[..., 0]) - np.arctan2(incident[..., 1], incident[..., 0])
        theta_i, theta_r, dphi = np.broadcast_arrays(theta_i, theta_r, dphi)
        return (m.chiral_design(5, theta_i, theta_r, dphi) @ values).reshape(*dphi.shape, 1) + 1 / np.pi

    found = project(brdf, 5, symmetry="chiral", tolerance=1e-6)
    assert np.abs(found.coefficients - values).max() < 1e-6  # arccos of a cosine near 1 gives half the digits
    even = project(brdf, 5, symmetry="isotropic", tolerance=1e-6)
    assert (
        even.coefficients[0, 0] == pytest.approx(2.0, abs=1e-6) and np.abs(even.coefficients[1:]).max() < 1e-6
    )
    power = (values**2).sum()
    assert even.lost[0] == pytest.approx(np.sqrt(power / (power + 4)), abs=1e-6)


def test_lambert_is_the_first_mode():
    found = project(MODELS["lambert"](albedo=(1.0,)), 6)
    assert found.coefficients[0, 0] == pytest.approx(2.0, abs=1e-12)  # (1 / pi) / S_000, S_000 = 1 / (2 pi)
    assert np.abs(found.coefficients[1:]).max() < 1e-12


@pytest.mark.parametrize("k", [2, 3, 4])
def test_minnaert_terminates_for_whole_k(k):
    """(cos_i cos_r)^(k - 1) is a polynomial of degree 2 (k - 1) in each rho, and holds no azimuth."""
    found = project(MODELS["minnaert"](albedo=(1.0,), k=float(k)), 10)
    outside = (found.modes[:, 0] > 2 * (k - 1)) | (found.modes[:, 2] > 0)
    assert np.abs(found.coefficients[outside]).max() < 1e-12
    highest = (found.modes == [2 * (k - 1), 2 * (k - 1), 0]).all(1)
    assert np.abs(found.coefficients[highest]).min() > 1e-3
    assert found.lost[0] < 1e-7


def test_minnaert_between_converges_slowly():
    found = project(MODELS["minnaert"](albedo=(1.0,), k=0.7), 8, evaluations=3_000_000)
    low = found.modes[:, 0] <= 4
    lost_at_4 = np.sqrt(1 - (found.coefficients[low] ** 2).sum() / found.norm[0] ** 2)
    assert 0.3 < found.lost[0] < lost_at_4 < 0.5


def test_stated_error_covers_the_true_one():
    """cos^2.5 of both angles has closed moments: the integral of (1 - t)^2.5 P_k(2 t - 1) over [0, 1], twice."""
    s = 2.5

    def brdf(incident, exit):
        return (incident[..., 2] * exit[..., 2])[..., None] ** s

    found = project(brdf, 8, tolerance=1e-9)
    moments = {}
    for n in range(0, 9, 2):
        k, ratio = n // 2, 1 / (s + 1)
        for j in range(1, k + 1):
            ratio *= -(s - j + 1) / (s + j + 1)
        moments[n] = 2 * np.pi * np.sqrt((n + 1) / (2 * np.pi)) * ratio
    flat = found.modes[:, 2] == 0
    n, k = found.modes[flat, 0], found.modes[flat, 1]
    exact = np.array(
        [2 * moments[a] * moments[b] / (2 if a == b else np.sqrt(2)) for a, b in zip(n, k, strict=True)]
    )
    wrong = np.linalg.norm(found.coefficients[flat, 0] - exact) / np.linalg.norm(exact)
    assert wrong <= found.error[0] + 1e-13
    assert found.error[0] < 1e-6


@pytest.mark.parametrize("name", ["satin-paint", "retro-reflector", "oren-nayar", "blinn-phong"])
def test_a_finer_rule_moves_coefficients_by_no_more_than_stated(name):
    brdf = MODELS[name](albedo=(0.4,))
    coarse = project(brdf, 4, quantity="brdf_cos_cos", evaluations=50_000)
    fine = project(brdf, 4, quantity="brdf_cos_cos", evaluations=3_000_000)
    moved = np.linalg.norm(fine.coefficients - coarse.coefficients, axis=0)
    assert (moved <= 2 * coarse.error * np.linalg.norm(fine.coefficients, axis=0)).all()
    assert (fine.error < 1e-4).all() and (fine.error < coarse.error).all()


def test_what_is_not_reciprocal_is_lost():
    """Oepik's law f ~ cos_i^(k - 1), k = 2: half its antisymmetric part cos_i - cos_r can be kept by no mode."""
    found = project(MODELS["oepik"](albedo=(1.0,), k=2.0), 4)
    assert found.lost[0] == pytest.approx(np.sqrt(1 / 8), abs=1e-6)  # |(cos_i - cos_r) / 2| over |cos_i|


def test_a_function_without_a_norm_says_so():
    found = project(MODELS["minnaert"](albedo=(1.0,), k=0.3), 4, evaluations=500_000)
    assert np.isinf(found.norm).all() and np.isnan(found.lost).all()


def test_unknown_symmetry_is_refused():
    with pytest.raises(ValueError, match="symmetry is 'round'"):
        project(MODELS["lambert"](), 2, symmetry="round")
