"""Expansions as matrices, and what each symmetry takes away."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.modes import basis as m
from photogonio.reconstruct.modes import transform as t

LISTS = {"isotropic": m.isotropic_modes, "reciprocal": m.reciprocal_modes, "general": m.general_modes}


def random_expansion(symmetry: str, order: int = 4, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    modes = LISTS[symmetry](order)
    return modes, np.random.default_rng(seed).normal(size=(len(modes), 2))


def values(symmetry: str, modes: np.ndarray, coefficients: np.ndarray, angles) -> np.ndarray:
    order = int(modes.max())
    brdf = Brdf(order, ("a", "b"), modes, coefficients, coefficients, symmetry=symmetry)
    return brdf.evaluate(*angles)


def projected(start, modes, coefficients, onto):
    """An expansion on another symmetry's basis."""
    return t.pair_coefficients(onto, t.pair_matrix(start, modes, coefficients))


ANGLES = np.random.default_rng(1).uniform(0, [[1.57], [6.28], [1.57], [6.28]], (4, 60))


@pytest.mark.parametrize("symmetry", LISTS)
def test_matrices_go_both_ways(symmetry):
    modes, coefficients = random_expansion(symmetry)
    back = t.pair_coefficients(symmetry, t.pair_matrix(symmetry, modes, coefficients))
    assert np.array_equal(back[0], modes) and np.abs(back[1] - coefficients).max() < 1e-14


@pytest.mark.parametrize("start", ["isotropic", "reciprocal"])
@pytest.mark.parametrize("onto", ["reciprocal", "general"])
def test_a_wider_basis_loses_nothing(start, onto):
    modes, coefficients = random_expansion(start)
    wide, own = projected(start, modes, coefficients, onto)
    exact = values(start, modes, coefficients, ANGLES)
    assert np.abs(values(onto, wide, own, ANGLES) - exact).max() < 1e-12
    assert np.linalg.norm(own) == pytest.approx(np.linalg.norm(coefficients), rel=1e-13)
    back = projected(onto, wide, own, start)
    assert np.array_equal(back[0], modes) and np.abs(back[1] - coefficients).max() < 1e-13


def test_projection_onto_reciprocal_is_the_mean_with_its_transpose():
    modes, coefficients = random_expansion("general")
    found = projected("general", modes, coefficients, "reciprocal")
    theta_i, phi_i, theta_r, phi_r = ANGLES
    exchanged = values("general", modes, coefficients, (theta_r, phi_r, theta_i, phi_i))
    mean = (values("general", modes, coefficients, ANGLES) + exchanged) / 2
    assert np.abs(values("reciprocal", *found, ANGLES) - mean).max() < 1e-12
    kept = np.linalg.norm(found[1], axis=0) / np.linalg.norm(coefficients, axis=0)
    lost = t.breaches(modes, coefficients)["reciprocity"]
    assert lost == pytest.approx(np.sqrt(1 - kept**2), rel=1e-12)


def test_projection_onto_isotropic_is_the_mean_over_turns_and_reflection():
    modes, coefficients = random_expansion("reciprocal", 3)
    found = projected("reciprocal", modes, coefficients, "isotropic")
    theta_i, phi_i, theta_r, phi_r = ANGLES
    mean = 0.0
    for k in range(13):
        turn = 2 * np.pi * k / 13
        mean = (
            mean
            + values("reciprocal", modes, coefficients, (theta_i, phi_i + turn, theta_r, phi_r + turn)) / 26
        )
        mean = (
            mean
            + values("reciprocal", modes, coefficients, (theta_i, turn - phi_i, theta_r, turn - phi_r)) / 26
        )
    assert np.abs(values("isotropic", *found, ANGLES) - mean).max() < 1e-12


def test_breaches_name_what_is_broken():
    """Each kind of departure put in alone, of known size, is found under its name and no other."""
    modes, coefficients = random_expansion("isotropic")
    matrix = t.pair_matrix("isotropic", modes, coefficients)
    general = t.pair_coefficients("general", matrix)
    clean = t.breaches(*general)
    assert (
        clean["kept"] == pytest.approx([1, 1]) and max(clean[k].max() for k in clean if k != "kept") < 1e-14
    )
    size = np.linalg.norm(coefficients, axis=0)
    n, l, k, p = m.general_modes(4).T

    def with_extra(places):
        extra = np.zeros((len(n), 2))
        for wanted, sign in places:
            extra[(np.column_stack([n, l, k, p]) == wanted).all(1)] = sign / np.sqrt(len(places)) * size
        return t.breaches(general[0], general[1] + extra)

    departures = {
        "reciprocity": [((2, 0, 0, 0), 1), ((0, 0, 2, 0), -1)],
        "isotropy": [((2, 2, 0, 0), 1), ((0, 0, 2, 2), 1)],
        "bilateral": [((3, 1, 1, -1), 1), ((1, -1, 3, 1), 1), ((3, -1, 1, 1), -1), ((1, 1, 3, -1), -1)],
    }
    for name, places in departures.items():
        found = with_extra(places)
        for key, share in found.items():
            expected = np.sqrt(0.5) if key in (name, "kept") else 0.0
            assert share == pytest.approx([expected] * 2, abs=1e-12), (name, key)


def test_breaches_of_anything_add_up():
    shares = t.breaches(*random_expansion("general"))
    assert sum(share**2 for share in shares.values()) == pytest.approx([1, 1], rel=1e-12)
    assert min(share.min() for share in shares.values()) > 0
