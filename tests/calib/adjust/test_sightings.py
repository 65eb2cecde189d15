"""Corners, highlights and limbs: their derivatives, and nothing left where all is as it is drawn."""

import numpy as np
import pytest

from photogonio.calib.adjust.sightings import corner_term, highlight_term, limb_term
from photogonio.calib.geometry.cones import outline
from tests.drawn.adjustments import BALL, MODEL, POSE, VALUES, assert_slopes, seen_corners, sighting
from tests.drawn.boards import CAMERA

LIMB = outline(CAMERA, POSE, BALL[:3], BALL[3], 24)


def terms() -> dict:
    return {
        "corners": corner_term(MODEL, "pose", seen_corners()),
        "highlights": highlight_term(MODEL, [sighting("lamp")]),
        "flash": highlight_term(MODEL, [sighting("flash")]),
        "distant": highlight_term(MODEL, [sighting("far")]),
        "limb": limb_term(MODEL, "pose", "ball", LIMB + 0.4, np.full(24, 0.5)),
    }


@pytest.mark.parametrize("name", terms())
def test_derivatives_are_those_of_differences(name):
    assert_slopes(terms()[name])


def test_a_limb_where_it_is_drawn_misses_by_the_bias_that_all_limbs_share():
    """A point pushed off along the outline's radius by a pixel misses by about that, over its error."""
    residual, _ = limb_term(MODEL, "pose", "ball", LIMB, np.full(24, 0.5))(VALUES)
    np.testing.assert_allclose(residual, VALUES["limb offset"][0] / 0.5, atol=1e-3)
    middle = LIMB.mean(0)
    outward = (LIMB - middle) / np.linalg.norm(LIMB - middle, axis=1, keepdims=True)
    pushed, _ = limb_term(MODEL, "pose", "ball", LIMB + outward, np.full(24, 0.5))(VALUES)
    np.testing.assert_allclose(np.abs(pushed - residual), 1 / 0.5, rtol=0.1)
