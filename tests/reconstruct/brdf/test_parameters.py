"""The numbers that a BRDF consists of: named, changed, and what f does as they change."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.parameters import (
    STEP,
    either_side,
    lobe_numbers,
    lobe_parameter,
    mode_names,
    named_number,
    number_of,
    slopes,
    with_number,
)
from photogonio.reconstruct.modes.basis import isotropic_modes, reciprocal_modes
from tests.drawn.brdfs import COATS, MIRRORS, RETROS, brdf_of, coat, mirror

EVERY = [MIRRORS[0], mirror((0.45, 0.15), azimuth=0.5), COATS[0], coat((0.4, 0.2), azimuth=0.7), RETROS[0]]


def test_modes_are_called_by_their_indices():
    assert mode_names("isotropic", isotropic_modes(2)[:2]) == ["S 0 0 0", "S 1 1 1"]
    names = mode_names("reciprocal", reciprocal_modes(2))
    assert names[0] == "Z 0 0 0 0" and len(set(names)) == len(names)


@pytest.mark.parametrize("lobe", EVERY, ids=lambda lobe: f"{lobe.model} {lobe.turning}")
def test_a_number_that_is_changed_is_that_one_alone(lobe):
    for what in lobe_numbers(lobe):
        before = {other: number_of(lobe, other) for other in lobe_numbers(lobe)}
        step = np.full(len(lobe.weight), 0.01)
        changed = with_number(lobe, what, before[what] + step)
        for other, value in before.items():
            moved = number_of(changed, other) - value
            np.testing.assert_allclose(moved, step if other == what else 0.0, atol=1e-13, err_msg=other)


def test_names_that_mean_nothing_are_known_as_such():
    lobes = (mirror(0.3), coat(0.3))
    assert named_number("lobe 1 ground", lobes) == (1, "ground")
    for name in ("lobe 0 ground", "lobe 2 weight", "lobe 0 roughness along", "lobe x weight", "S 0 0 0"):
        assert lobe_parameter(name, lobes) is None
        with pytest.raises(KeyError):
            named_number(name, lobes)


def test_either_side_of_a_number_lie_as_far_apart_as_is_said():
    for what in lobe_numbers(EVERY[1]):
        less, more, between = either_side(EVERY[1], what)
        np.testing.assert_allclose(number_of(more, what) - number_of(less, what), between, rtol=1e-9)


def test_f_is_linear_in_modes_weights_and_grounds():
    """By Euler, a sum of what it is linear in is its slopes times their numbers."""
    brdf = brdf_of(mirror(0.4), coat(0.3), order=2)
    names = (*mode_names("isotropic", brdf.modes), "lobe 0 weight", "lobe 1 weight", "lobe 1 ground")
    rng = np.random.default_rng(0)
    where = [*rng.uniform(0.0, 1.3, (2, 40)), *rng.uniform(-3.0, 3.0, (2, 40))]
    where = [where[0], where[2], where[1], where[3]]
    own = np.vstack(
        [
            brdf.coefficients,
            brdf.lobes[0].weight,
            brdf.lobes[1].weight,
            brdf.lobes[1].ground,
        ]
    )
    # differences of a linear function are exact but for rounding over the step
    said = np.einsum("npc,pc->nc", slopes(brdf, where, names), own)
    np.testing.assert_allclose(said, brdf.evaluate(*where), atol=1e-15 / STEP * 100)


def test_the_slope_of_a_retro_lobe_by_its_roughness_in_closed_form():
    """At the light itself f = weight / (4 pi roughness^2), whose derivative is -2 f / roughness."""
    lobe = RETROS[0]
    none = np.empty((0, 3))
    brdf = Brdf(0, ("R", "G", "B"), np.empty((0, 3), int), none, none, lobes=(lobe,))
    angle, zero = np.array([0.0, 0.7]), np.zeros(2)
    found = slopes(brdf, (angle, zero, angle, zero), ("lobe 0 roughness",))[:, 0]
    exact = -2.0 * lobe.weight / (4.0 * np.pi * lobe.axes[0] ** 3)
    # central differences of x^-2 with steps of STEP x are off by 2 STEP^2
    np.testing.assert_allclose(found, np.broadcast_to(exact, found.shape), rtol=3.0 * STEP**2)
