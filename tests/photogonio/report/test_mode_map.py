"""The picture of coefficients has each mode where its two functions meet."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.modes.basis import isotropic_modes, reciprocal_modes
from photogonio.report.viewer.mode_map import mode_map


def brdf_of(modes: np.ndarray, order: int, symmetry: str) -> Brdf:
    rng = np.random.default_rng(4)
    value = rng.normal(size=(len(modes), 2))
    return Brdf(order, ("R", "G"), modes, value, np.full_like(value, 1e-3), symmetry=symmetry)


@pytest.mark.parametrize(
    "modes, symmetry", [(isotropic_modes(5), "isotropic"), (reciprocal_modes(2), "reciprocal")]
)
def test_every_mode_has_its_own_square_and_its_mirror_image(modes, symmetry):
    found = mode_map(brdf_of(modes, 5, symmetry))
    places = {(one.x, one.y) for one in found.squares}
    assert len(places) == len(found.squares)
    left = [block.x for block in found.blocks]
    for x, y in places:
        k = int(np.searchsorted(left, x, side="right")) - 1
        assert (left[k] + y, x - left[k]) in places  # exchange of incident and exit
        assert max(x - left[k], y) < found.blocks[k].side
    twice = sum(
        1 for one in modes if tuple(one[: len(one) // 2]) != tuple(one[len(one) // 2 :][: len(one) // 2])
    )
    if symmetry == "reciprocal":
        assert len(places) == len(modes) + twice
    else:
        assert len(places) == len(modes) + sum(n != m for n, m, _ in modes)


def test_sizes_signs_and_doubt_are_those_of_the_numbers():
    modes = isotropic_modes(2)
    value = np.array([[0.4], [-0.1], [0.001], [0.0], [0.025]])
    known = Brdf(2, ("Y",), modes, value, np.full((5, 1), 0.01))
    squares = {one.said.split(":")[0]: one for one in mode_map(known).squares}
    largest, negative, unsure = (squares[f"n m l = {name}"] for name in ("0 0 0", "1 1 1", "2 0 0"))
    assert (largest.depth, largest.sure, largest.positive) == (1.0, True, True)
    assert (negative.depth, negative.positive) == (0.5, False)
    assert not unsure.sure


def test_few_modes_are_no_picture():
    assert mode_map(brdf_of(isotropic_modes(1), 1, "isotropic")) is None
