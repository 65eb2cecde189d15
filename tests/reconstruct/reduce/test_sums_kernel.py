"""Sums of pixels by facet pair: a table that grows keeps them."""

import numpy as np

from photogonio.reconstruct.reduce import sums_kernel as kernel


def test_a_table_that_grows_keeps_its_sums_under_their_keys():
    n, columns = 8, 14
    slots = np.full(4 * n, -1, np.int32)
    keys = np.random.default_rng(4).permutation(10**6)[:n].astype(np.int64)
    table = kernel.SumTable(slots, keys, np.arange(n * columns, dtype=float).reshape(n, columns))
    for k, key in enumerate(keys):
        slots[kernel._slot(slots, keys, key)] = k
    grown = kernel._grown(table)
    assert len(grown.keys) == 2 * n and not grown.sums[n:].any()
    for k, key in enumerate(keys):
        at = grown.slots[kernel._slot(grown.slots, grown.keys, key)]
        assert grown.keys[at] == key
        np.testing.assert_array_equal(grown.sums[at], table.sums[k])
    assert grown.slots[kernel._slot(grown.slots, grown.keys, 10**6)] == -1
