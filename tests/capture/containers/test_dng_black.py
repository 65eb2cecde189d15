"""Black levels as a directory's tags state them, at every pixel."""

import numpy as np
import pytest

from photogonio.capture.containers import tiff
from photogonio.capture.containers.dng_black import black_fault, black_of, ratios


def pairs(*values: float) -> tuple[int, ...]:
    """Hundredths, as numerators and denominators in turn."""
    return tuple(part for value in values for part in (round(100 * value), 100))


def test_what_libraw_hands_over_whole_is_left_to_it():
    assert black_of({}) is None
    assert black_of({tiff.BLACK: pairs(64)}) is None
    assert black_of({tiff.BLACK: pairs(64, 65, 66, 67), tiff.BLACK_REPEAT: (2, 2)}) is None


def test_fractions_rows_and_columns_add_up_from_the_active_area_on():
    rng = np.random.default_rng(1)
    cells, down, across = (
        rng.integers(0, 900, (2, 3)) / 100,
        np.array([1.0, -2.5, 0.25, 3.0]),
        np.array([0.5] * 6),
    )
    across[2] = -1.25
    tags = {
        tiff.BLACK: pairs(*cells.ravel()),
        tiff.BLACK_REPEAT: (2, 3),
        tiff.BLACK_DOWN: pairs(*down),
        tiff.BLACK_ACROSS: pairs(*across),
        tiff.ACTIVE: (1, 2, 5, 8),
    }
    found = black_of(tags)
    known = np.tile(cells, (2, 2)) + down[:, None] + across
    np.testing.assert_allclose(found.at(np.arange(1, 5), np.arange(2, 8)), known, rtol=1e-6)
    assert found.mean == pytest.approx(known.mean())
    # beside the active area the repeat goes on, with what its nearest row and column have
    np.testing.assert_allclose(
        found.at(np.array([0]), np.array([2])), [[cells[1, 0] + down[0] + across[0]]], rtol=1e-6
    )


def test_planes_have_levels_of_their_own():
    found = black_of({tiff.BLACK: pairs(1.5, 2.5, 3.5), tiff.SAMPLES: (3,)})
    assert [float(found.at(np.arange(1), np.arange(1), plane)[0, 0]) for plane in range(3)] == [1.5, 2.5, 3.5]


@pytest.mark.parametrize(
    "tags",
    [
        {tiff.BLACK: (3, 0)},
        {tiff.BLACK: pairs(0.5, 0.5), tiff.BLACK_REPEAT: (2, 2)},
        {tiff.BLACK: pairs(0.5), tiff.BLACK_REPEAT: (1,)},
    ],
)
def test_what_is_damaged_states_nothing(tags):
    assert black_of(tags) is None


@pytest.mark.parametrize(
    ("tags", "words"),
    [
        ({tiff.BLACK: (3, 0)}, "no number"),
        ({tiff.BLACK: pairs(5), tiff.BLACK_DOWN: (1, 0)}, "no number"),
        (
            {tiff.BLACK: pairs(5, 5), tiff.BLACK_REPEAT: (2, 2)},
            "2 black levels for cells of 2 x 2 and 1 colours",
        ),
        ({tiff.BLACK: pairs(5, 5), tiff.SAMPLES: (3,)}, "2 black levels for cells of 1 x 1 and 3 colours"),
    ],
)
def test_levels_that_cannot_be_what_is_taken_off(tags, words):
    assert words in black_fault(tags)


def test_levels_that_can():
    for tags in ({}, {tiff.BLACK: pairs(5)}, {tiff.BLACK: pairs(5), tiff.SAMPLES: (3,)}):
        assert black_fault(tags) == ""
    assert black_fault({tiff.BLACK: pairs(*range(12)), tiff.BLACK_REPEAT: (2, 2), tiff.SAMPLES: (3,)}) == ""


def test_ratios_are_quotients_in_turn():
    np.testing.assert_array_equal(ratios((1, 2, 6, 4)), [0.5, 1.5])
    assert ratios(()).shape == (0,)
