"""Facets finer toward the mirror direction: they hold the same samples, and become the coarse ones again."""

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.fit import FitOptions, fit_table
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.facet_table import accumulate, add_tables
from photogonio.reconstruct.table.facets import facet_index
from photogonio.reconstruct.table.refinement import (
    FINEST_NEAR,
    coarsened,
    finer_of,
    near_mirror,
    refined_facets,
)
from photogonio.reconstruct.table.table_file import load_table, save_table

LEVEL = 3


def samples(count=4000, seed=0):
    """Pairs of directions, half of them about the mirror direction."""
    rng = np.random.default_rng(seed)
    incident = unit_vectors(rng.uniform(0.1, 1.2, count), np.full(count, 0.6))
    exit = incident * [-1.0, -1.0, 1.0] + np.where(rng.uniform(size=(count, 1)) < 0.5, 0.1, 0.6) * rng.normal(
        size=(count, 3)
    )
    exit[:, 2] = np.abs(exit[:, 2]) + 0.05
    return incident, exit / np.linalg.norm(exit, axis=1, keepdims=True), rng


def table(level, finer, name="a", seed=0):
    incident, exit, rng = samples(seed=seed)
    facet_i, facet_r = facet_index(incident, level), facet_index(exit, level)
    if finer:
        facet_i, facet_r = refined_facets(incident, exit, level, finer)
    return accumulate(
        level=level,
        channels=("R",),
        name=name,
        isotropic=True,
        facet_i=facet_i,
        facet_r=facet_r,
        incident=incident,
        exit=exit,
        place=np.zeros((len(incident), 3)),
        omega=rng.uniform(0.5, 2.0, len(incident)),
        value=rng.uniform(0.1, 1.0, (len(incident), 1)),
        variance=np.ones((len(incident), 1)),
        finer=finer,
    )


def test_a_refined_table_holds_the_coarse_one():
    fine, coarse = table(LEVEL, finer_of(LEVEL)), table(LEVEL, 0)
    again = coarsened(fine)
    assert len(fine) > len(coarse) and again.finer == 0
    for name in ("group", "facet_i", "facet_r", "count"):
        np.testing.assert_array_equal(getattr(again, name), getattr(coarse, name))
    np.testing.assert_allclose(
        again.value, coarse.value, rtol=1e-12
    )  # sums of a few numbers in another order


def test_only_cells_near_the_mirror_direction_are_finer():
    fine = table(LEVEL, finer_of(LEVEL))
    near = near_mirror(fine.incident, fine.exit)
    first = (fine.facet_i % 4**fine.finer == 0) & (fine.facet_r % 4**fine.finer == 0)
    assert near.any() and first[~near].all() and not first[near].all()


def test_tables_of_different_refinement_do_not_add():
    with pytest.raises(ValueError, match="finer"):
        add_tables([table(LEVEL, finer_of(LEVEL)), table(LEVEL, 0, "b")])


def test_the_file_keeps_the_refinement(tmp_path):
    fine = table(LEVEL, finer_of(LEVEL))
    save_table(fine, tmp_path / "table.npz")
    again = load_table(tmp_path / "table.npz")
    assert again.finer == FINEST_NEAR - LEVEL
    np.testing.assert_array_equal(again.facet_r, fine.facet_r)


def test_least_squares_of_q_are_those_of_the_coarse_table():
    options = FitOptions(quantity="brdf_cos_cos", order=2)
    fits = [fit_table(some, options) for some in (table(LEVEL, 2), coarsened(table(LEVEL, 2)))]
    np.testing.assert_array_equal(*(fit.brdf.coefficients for fit in fits))


def test_facets_finer_than_pixels_are_said_to_be():
    one_each = table(6, 0)
    one_each = one_each.take(one_each.count == 1)
    with pytest.raises(InputError, match="no cell of facets of level 6 has 3 pixels: try a lower --level"):
        fit_table(one_each)
