import numpy as np
import pytest
from numba.core.caching import Cache
from numba.core.errors import NumbaError

from photogonio.capture.jit import borrowing, jit


def test_whatever_process_has_a_loop_knows_its_kept_code_by_all_that_it_calls():
    """Nobody has to ask for it: processes of a pool and of evaluate, and whoever imports a module alone."""
    assert hasattr(Cache._index_key, "photogonio")


def test_a_loop_divides_as_numpy_does():
    @jit
    def ratio(a, b):
        return a / b

    assert np.isinf(ratio(1.0, 0.0)) and np.isnan(ratio(0.0, 0.0))


def test_what_borrows_its_arrays_gives_them_back_and_cannot_make_one():
    @borrowing
    def fill(rows):
        for k in range(len(rows)):
            row = rows[k]
            row[:] = k

    rows = np.empty((3, 2))
    fill(rows)
    assert rows.tolist() == [[0, 0], [1, 1], [2, 2]]

    @borrowing
    def make(n):
        return np.zeros(n)

    with pytest.raises((NumbaError, RuntimeError)):
        make(3)
