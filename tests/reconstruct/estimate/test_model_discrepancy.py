"""What a model misses systematically is told from noise and from the views' own errors."""

from dataclasses import replace

import numpy as np

from photogonio.reconstruct.estimate.model_discrepancy import DOUBT, PEAK_DOUBT, misfit_of
from photogonio.reconstruct.table.cells import cells_of
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.tables import Plan, simulate

PLAN = Plan(views=14, pixels=2500, level=3, spoiled=0.0)
F = 0.5 / np.pi


def cells_and_truth(plan=PLAN):
    cells = cells_of(simulate(make_brdf("lambert"), plan))
    return cells, np.full_like(cells.value, F)


def test_noise_and_errors_of_scale_are_no_misfit():
    cells, truth = cells_and_truth()
    found = misfit_of(cells, truth).at(cells, truth)
    # a view's scale is off by 0.3 % and several views meet at most places: what is left is of that size
    assert np.median(found) <= 0.002 * F


def test_what_all_views_miss_is_found_where_it_is():
    cells, truth = cells_and_truth()
    wrong = (np.maximum(cells.theta_i, cells.theta_r) > 1.0)[:, None]
    predicted = np.where(wrong, 0.9 * truth, truth)
    found = misfit_of(cells, predicted).at(cells, predicted) / predicted
    inside = (np.maximum(cells.theta_i, cells.theta_r) > 1.15) & (
        np.minimum(cells.theta_i, cells.theta_r) > 0.3
    )
    outside = np.maximum(cells.theta_i, cells.theta_r) < 0.8
    np.testing.assert_allclose(np.median(found[inside]), 1 / 0.9 - 1, atol=0.01)
    assert np.median(found[outside]) <= 0.003


def test_a_place_counts_as_its_reciprocal_twin():
    cells, truth = cells_and_truth()
    predicted = np.where((np.minimum(cells.theta_i, cells.theta_r) > 0.6)[:, None], 0.9, 1.0) * truth
    misfit = misfit_of(cells, predicted)
    twins = replace(cells, theta_i=cells.theta_r, theta_r=cells.theta_i)
    np.testing.assert_allclose(misfit.at(twins, predicted), misfit.at(cells, predicted), rtol=1e-9)


def test_a_share_of_what_binning_added_is_not_known():
    cells, truth = cells_and_truth()
    added = np.where((cells.theta_r < 0.5)[:, None], 0.2 * truth, 0.0)
    with_it = misfit_of(cells, truth, added).at(cells, truth)
    without = misfit_of(cells, truth).at(cells, truth)
    np.testing.assert_allclose(np.sqrt(with_it**2 - without**2), DOUBT * added, atol=1e-12)


def test_of_a_narrow_peak_s_blur_less_is_unknown_and_never_more_than_a_share_of_what_is_seen():
    cells, truth = cells_and_truth()
    cells = replace(cells, peaked=True)
    for times in (0.2, 30.0):  # of the sharp value, as on a steep flank
        relative = misfit_of(cells, truth, times * truth).relative
        without = misfit_of(cells, truth).relative
        expected = PEAK_DOUBT * times / (1.0 + times)
        np.testing.assert_allclose(np.sqrt(relative**2 - without**2), expected, rtol=1e-6)
