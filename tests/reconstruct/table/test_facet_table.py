"""The facet-pair table: its sums, their addition, its file."""

from dataclasses import fields, replace

import numpy as np
import pytest

from photogonio.reconstruct.table.facet_table import (
    LEFT_OUT,
    FacetTable,
    accumulate,
    add_tables,
    in_parts,
    of_parts,
    pair_keys,
    split_keys,
)
from photogonio.reconstruct.table.facets import facet_index

LEVEL = 2
EXACT = 1e-12  # of a thousand numbers of one size added in another order


def samples(seed, n=800):
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(2, n, 3))
    directions[..., 2] = np.abs(directions[..., 2])
    incident, exit_ = directions / np.linalg.norm(directions, axis=2, keepdims=True)
    return {
        "incident": incident,
        "exit": exit_,
        "facet_i": facet_index(incident, LEVEL),
        "facet_r": facet_index(exit_, LEVEL),
        "place": rng.normal(size=(n, 3)),
        "omega": rng.uniform(0.1, 2.0, n),
        "value": rng.uniform(0.1, 1.0, (n, 2)),
        "variance": rng.uniform(0.01, 0.02, (n, 2)),
    }


def table_of(data, name="a", **more):
    return accumulate(level=LEVEL, channels=("R", "G"), name=name, isotropic=False, **data, **more)


def joined(*parts):
    return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}


def assert_equal(a: FacetTable, b: FacetTable, rtol=0.0):
    for f in fields(FacetTable):
        x, y = getattr(a, f.name), getattr(b, f.name)
        if isinstance(x, np.ndarray):
            assert x.dtype == y.dtype and x.shape == y.shape, f.name
            np.testing.assert_allclose(x, y, rtol=rtol, atol=rtol, err_msg=f.name)
        else:
            assert x == y, f.name


def test_cells_hold_the_sums_of_their_samples():
    data = samples(0)
    table = table_of(data)
    pairs = list(zip(data["facet_i"].tolist(), data["facet_r"].tolist(), strict=True))
    cells = list(zip(table.facet_i.tolist(), table.facet_r.tolist(), strict=True))
    assert cells == sorted(set(pairs))
    for k in range(0, len(table), 23):
        inside = np.array([pair == cells[k] for pair in pairs])
        omega = data["omega"][inside]
        assert table.count[k] == inside.sum()
        assert table.weight[k] == pytest.approx(omega.sum(), rel=EXACT)
        for got, what in (
            (table.value, data["value"]),
            (table.value2, data["value"] ** 2),
            (table.incident, data["incident"]),
            (table.exit, data["exit"]),
            (table.place, data["place"]),
        ):
            np.testing.assert_allclose(got[k], omega @ what[inside], rtol=EXACT, atol=EXACT)
        np.testing.assert_allclose(table.variance[k], omega**2 @ data["variance"][inside], rtol=EXACT)


def test_samples_of_one_cell_of_noise_have_the_variance_that_the_table_says():
    """variance / weight^2 is the variance of value / weight: over many cells chi-squared is one a cell."""
    rng = np.random.default_rng(5)
    data = samples(5, 20000)
    data["value"] = 0.3 + np.sqrt(data["variance"]) * rng.normal(size=data["value"].shape)
    table = table_of(data)
    z = (table.value / table.weight[:, None] - 0.3) / (np.sqrt(table.variance) / table.weight[:, None])
    n = z.size
    assert abs(np.mean(z**2) - 1.0) < 4.0 * np.sqrt(2.0 / n)
    assert abs(np.mean(z)) < 4.0 / np.sqrt(n)


def test_tables_of_one_group_add_as_their_samples_do():
    a, b = samples(1), samples(2)
    assert_equal(table_of(a) + table_of(b), table_of(joined(a, b)), rtol=EXACT)


def test_groups_stay_apart_and_join_by_name():
    a, b, c = (table_of(samples(k), name) for k, name in ((1, "p"), (2, "q"), (3, "p")))
    total = add_tables((a, b, c))
    assert total.groups == ("p", "q")
    assert (np.diff(pair_keys(total.group, total.facet_i, total.facet_r, LEVEL)) > 0).all()
    alone = total.group == 1
    np.testing.assert_array_equal(total.value[alone], b.value)
    assert_equal((a + b) + c, total, rtol=EXACT)
    assert total.count.sum() == 2400


def test_parts_of_whole_groups_make_the_table_again():
    table = add_tables([table_of(samples(k), name) for k, name in enumerate("abcde")])
    for rows, count in ((1, 5), (len(table) // 3, 3), (len(table) + 1, 1)):
        parts = in_parts(table, rows)
        assert sum(len(part) > 0 for part in parts) == count
        found = [set(part.group) for part in parts]
        assert sum(map(len, found)) == 5  # none is divided
        again = of_parts(parts)
        for one in fields(table):
            np.testing.assert_array_equal(getattr(again, one.name), getattr(table, one.name))
    empty = in_parts(table.take(slice(0, 0)), 10)
    assert len(empty) == 1 and len(empty[0]) == 0


def test_adding_nothing_changes_nothing():
    a = table_of(samples(1))
    none = {key: value[:0] for key, value in samples(1).items()}
    empty = table_of(none)
    assert len(empty) == 0
    assert_equal(a + empty, a)
    assert_equal(empty + a, a)


def test_counts_of_what_was_left_out_add():
    counts = np.arange(len(LEFT_OUT))
    a = table_of(samples(1), "p", left_out=counts)
    b = table_of(samples(2), "q", left_out=10 * counts)
    np.testing.assert_array_equal((a + b + a).left_out, [2 * counts, 10 * counts])


def test_tables_that_do_not_fit_are_refused():
    a = table_of(samples(1))
    with pytest.raises(ValueError, match="channels"):
        add_tables((a, replace(a, channels=("R", "X"))))
    with pytest.raises(ValueError, match="level"):
        add_tables((a, replace(a, level=3)))
    with pytest.raises(ValueError, match="no table"):
        add_tables(())


def test_keys_come_back():
    rng = np.random.default_rng(3)
    group, facet_i, facet_r = rng.integers(0, 10 * 4**6, (3, 100))
    for got, want in zip(
        split_keys(pair_keys(group, facet_i, facet_r, 6), 6), (group, facet_i, facet_r), strict=True
    ):
        np.testing.assert_array_equal(got, want)
