"""Values that may be marks, by what they are alone."""

import numpy as np
import pytest

from photogonio.reconstruct.goniometer.suspects import is_mark, suspects
from photogonio.reconstruct.table.neighbours import places
from tests.drawn.goniometer import regular, scattered


def drawn(count=400, seed=1):
    value = 0.1 * (1.0 + 0.05 * np.random.default_rng(seed).standard_normal(count))
    return places(*scattered(count)), value


@pytest.mark.parametrize("mark", [-999.0, -0.05, 0.001, 0.12, 5.0, 1e30])
def test_a_value_that_comes_often_is_suspect(mark):
    at, value = drawn()
    assert suspects(at, value).tolist() == []
    value[::20] = mark
    assert suspects(at, value).tolist() == [mark]


def test_the_same_value_at_the_same_pair_of_directions_is_no_repetition():
    """Light from the normal has no azimuth: a ring of readings about it is one."""
    at = places(*regular())
    value = 0.1 * (1.0 + 0.05 * np.random.default_rng(1).standard_normal(len(at)))
    value[(at[:, 0] == 0.0) & (np.abs(at[:, 3] - np.cos(np.radians(10.0))) < 1e-9)] = 0.105
    assert suspects(at, value).tolist() == []


def test_numbers_that_programs_write():
    assert is_mark(np.array([-999.0, 65535.0, 1e30, -1.0, 0.3, 998.0])).tolist() == [True] * 4 + [False] * 2
