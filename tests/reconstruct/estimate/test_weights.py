"""Weights of cells, and the views whose scale is not believed."""

import numpy as np
import pytest

from photogonio.reconstruct.estimate.weights import (
    error_model,
    independence,
    residual_scale,
    student_cost,
    student_weights,
    view_scales,
)
from photogonio.reconstruct.table.cells import Cells


def cells_of_views(views=12, each=200, *, seed=0, noise=0.01, channels=2):
    rng = np.random.default_rng(seed)
    n = views * each
    angles = np.arccos(rng.uniform(0.2, 1.0, (2, n)))
    true = 0.3 + 0.1 * np.cos(angles[0])[:, None] * np.arange(1, channels + 1)
    return (
        Cells(
            theta_i=angles[0],
            phi_i=np.zeros(n),
            theta_r=angles[1],
            phi_r=np.zeros(n),
            dphi=np.zeros(n),
            value=true * (1.0 + noise * rng.normal(size=true.shape)),
            variance=(noise * true) ** 2,
            count=np.full(n, 20.0),
            group=np.repeat(np.arange(views), each),
            place=np.zeros((n, 3)),
            groups=tuple(f"s{k}" for k in range(views)),
            channels=("R", "G")[:channels],
            binned=True,
        ),
        true,
    )


def test_errors_of_cells_grow_with_noise_stray_light_and_brightness():
    cells, true = cells_of_views()
    alone = error_model(cells)
    assert (alone >= np.sqrt(cells.variance)).all()
    assert (error_model(cells, 0.1 * true) > alone).all()
    measured = Cells(**{k: getattr(cells, k) for k in Cells.__slots__} | {"binned": False})
    np.testing.assert_array_equal(error_model(measured), np.sqrt(cells.variance))


def test_the_scale_of_residuals_does_not_see_outliers():
    rng = np.random.default_rng(0)
    z = 2.0 * rng.normal(size=20000)
    z[:1000] = 1e6
    # five per cent of outliers shift the median of |z| to its quantile 0.5 / 0.95
    assert residual_scale(z) == pytest.approx(2.0, rel=0.12)


def test_student_weights_are_the_slope_of_the_cost():
    """Reweighted least squares minimises the cost: d cost / dz = weight z / scale^2."""
    z, freedom = np.array([0.3, 1.0, 7.0]), 4.0
    for k in range(3):
        step = np.zeros(3)
        step[k] = 1e-5
        slope = (student_cost(z + step, 1.3, freedom) - student_cost(z - step, 1.3, freedom)) / 2e-5
        assert 3 * slope == pytest.approx(student_weights(z / 1.3, freedom)[k] * z[k] / 1.3**2, rel=1e-6)


def test_outlying_cells_lose_their_say():
    weights = student_weights(np.array([0.0, 1.0, 10.0, 100.0]), 4.0)
    assert (np.diff(weights) < 0).all()
    assert weights[3] * 100.0 < 0.1  # a redescending influence: the further, the less


def test_a_view_of_wrong_scale_is_freed_and_corrected_and_the_others_stay():
    cells, true = cells_of_views()
    wrong = cells.group == 5
    cells = cells.with_value(np.where(wrong[:, None], 1.15 * cells.value, cells.value))
    deviation = error_model(cells)
    scales = view_scales(cells, true, deviation, np.ones_like(true), np.full(12, 0.003))
    assert scales.freed.tolist() == [k == 5 for k in range(12)]
    # 200 cells of two channels at 1 % that count as 30: a standard error of 0.2 %
    assert scales.factor[5] == pytest.approx(1.15, abs=0.006)
    assert (np.delete(scales.factor, 5) == 1.0).all()
    assert (np.delete(scales.error, 5) < 0.004).all() and scales.error[5] > 0.5


def test_what_a_view_saw_that_looked_elsewhere_is_news_unless_no_surface_changes_as_much():
    """A third of a radian from all others f may be a third off what they lead to expect."""
    cells, true = cells_of_views()
    for factor, freed in ((1.3, False), (0.75, False), (1.4, True), (0.6, True)):
        off = cells.with_value(np.where((cells.group == 5)[:, None], factor * cells.value, cells.value))
        known = error_model(off), np.ones_like(true), np.full(12, 0.003)
        scales = view_scales(off, true, *known, lambda cells, view: 1 / 3)
        assert scales.freed.tolist() == [freed and k == 5 for k in range(12)]
        assert scales.factor[5] == pytest.approx(factor if freed else 1.0, abs=0.006)
        assert view_scales(off, true, *known).freed[5]


@pytest.mark.parametrize("stated", [0.002, 0.02])
def test_views_that_scatter_are_doubted_and_none_is_freed(stated):
    cells, true = cells_of_views(views=40, each=60, seed=1)
    shift = 1.0 + 0.02 * np.random.default_rng(2).normal(size=40)
    cells = cells.with_value(cells.value * shift[cells.group, None])
    scales = view_scales(cells, true, error_model(cells), np.ones_like(true), np.full(40, stated))
    assert not scales.freed.any()
    # a scatter that nobody stated is believed up to a hundredth, since a wrong model scatters too
    assert scales.error == pytest.approx(max(stated, 0.01))


def test_however_finely_a_view_is_cut_it_counts_no_more():
    coarse, _ = cells_of_views(views=3, each=20)
    fine, _ = cells_of_views(views=3, each=500)
    assert independence(coarse).sum() == pytest.approx(60.0)
    assert independence(fine).sum() == pytest.approx(90.0)
