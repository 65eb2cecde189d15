"""Folds, and the choice of order, prior and lobes on them."""

import numpy as np
import pytest

from photogonio.reconstruct.estimate.folded_design import FoldedDesign
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.model_selection import (
    Candidate,
    Prior,
    choose,
    crosses,
    folds_of,
    try_all,
)
from photogonio.reconstruct.estimate.normal_equations import Factors, solve
from photogonio.reconstruct.estimate.weights import error_model, independence, level
from photogonio.reconstruct.lobes.families import families, retro_lobe
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.tables import Plan, simulate

SMALL = Plan(views=12, pixels=1500, level=2, spoiled=0.0)


def random_cells(n=2000, seed=0):
    rng = np.random.default_rng(seed)
    return Cells.of_angles(*np.arccos(rng.uniform(0.1, 1.0, (2, n))), rng.uniform(0, np.pi, n))


def test_views_are_left_out_whole():
    cells = cells_of(simulate(make_brdf("lambert"), SMALL))
    fold = folds_of(cells)
    for view in np.unique(cells.group):
        assert len(np.unique(fold[cells.group == view])) == 1
    assert len(np.unique(fold)) == 10


def test_reciprocal_twins_share_a_fold_and_neighbours_mostly_do():
    cells = random_cells()
    twins = Cells.of_angles(cells.theta_r, cells.theta_i, cells.dphi)
    near = Cells.of_angles(cells.theta_i + np.radians(1.0), cells.theta_r, cells.dphi)
    both = Cells.of_angles(
        *(
            np.concatenate([getattr(c, a) for c in (cells, twins, near)])
            for a in ("theta_i", "theta_r", "dphi")
        )
    )
    fold = folds_of(both).reshape(3, -1)
    np.testing.assert_array_equal(fold[0], fold[1])
    assert (fold[0] == fold[2]).mean() > 0.85
    assert np.bincount(fold[0], minlength=10).min() > 0


def test_the_loss_of_a_fold_is_that_of_a_fit_without_it():
    cells = cells_of(simulate(make_brdf("oren-nayar"), SMALL))
    basis, fold = Basis("isotropic", 4), folds_of(cells)
    design, counts = basis.design(cells), independence(cells)
    weight = counts / error_model(cells) ** 2
    tried = try_all(cells, weight, "isotropic", (2, 4), [LobeSet()])
    for candidate in [one for one in tried if one.order == 4][::5]:
        penalty = candidate.prior.precision(basis.degree(), level(cells))
        left = fold == 3
        total = 0.0
        for c in range(3):
            w, x = weight[~left, c, None], design[~left]
            a = np.linalg.solve((x * w).T @ x + np.diag(penalty[c]), (x * w).T @ cells.value[~left, c])
            total += np.sum(weight[left, c] * (cells.value[left, c] - design[left] @ a) ** 2)
        assert candidate.loss[3] == pytest.approx(total / (3 * counts[left].sum()), rel=1e-6)


def one(order, loss, lobes=0):
    families_ = families(absolute=True)[:lobes]
    return Candidate(order, Prior(0.1, 1.0), LobeSet(families_, (np.array([0.2]),) * lobes), np.array(loss))


def test_the_simplest_that_predicts_as_well_is_taken():
    best, equal, worse = (
        one(8, [1.0, 1.1, 0.9, 1.0]),
        one(2, [1.1, 1.05, 0.95, 1.0]),
        one(0, [2.0, 2.1, 1.9, 2]),
    )
    assert choose([best, equal, worse]) == (equal, best)
    assert choose([best, worse])[0] is best


def test_a_lobe_must_pay():
    plain, little, much = one(2, [1.0, 1.1, 0.9]), one(2, [0.9, 1.0, 0.8], 1), one(2, [0.3, 0.2, 0.3], 1)
    assert choose([plain, little])[0] is plain
    assert choose([plain, much])[0] is much


def test_a_lobe_that_only_saves_modes_is_taken_where_the_data_can_tell_lobes():
    bare, many, few = one(0, [2.0, 2.1, 1.9]), one(8, [1.0, 1.1, 0.9]), one(0, [0.9, 1.0, 0.8], 1)
    assert choose([bare, many, few])[0] is few
    assert choose([bare, many, few], thrifty=False)[0] is many
    # of those with as few modes the best counts, whichever prior was tried first
    lacking, stiff = one(0, [1.15, 1.26, 1.05]), one(0, [1.0, 1.1, 0.89], 1)
    assert choose([lacking, many, stiff, few])[0] is few


def test_modes_that_gain_next_to_nothing_are_not_saved_by_a_lobe():
    """What a lobe does as well as many modes, none of them does nearly as well."""
    bare, many, few = one(0, [1.05, 1.16, 0.95]), one(8, [1.0, 1.1, 0.9]), one(0, [0.95, 1.05, 0.85], 1)
    assert choose([bare, many, few])[0] is many


def test_what_crosses_half_angles_and_differences():
    """Light from the normal makes the difference the half angle; a lamp beside the camera makes it nought."""
    theta, rng = np.radians(np.arange(5.0, 80.0, 5.0)), np.random.default_rng(0)
    i, r, d = np.meshgrid(theta, theta, np.radians([0.0, 60.0, 120.0, 180.0]), indexing="ij")
    assert crosses(Cells.of_angles(i.ravel(), r.ravel(), d.ravel()))
    assert not crosses(Cells.of_angles(np.zeros(15), theta, rng.uniform(0.0, np.pi, 15)))
    assert not crosses(Cells.of_angles(theta, theta, np.zeros(15)))


@pytest.mark.parametrize("model", ["lambert", "oren-nayar"])
def test_order_16_asked_of_sparse_data_stays_near_the_best_lower_order(model):
    """Left-out views are predicted within 1.1 of the best order's rms, and nothing runs away."""
    truth = make_brdf(model)
    cells = cells_of(simulate(truth, Plan(views=10, pixels=800, level=2)))
    weight = independence(cells) / error_model(cells) ** 2
    tried = try_all(cells, weight, "isotropic", (0, 1, 2, 4, 6, 16), [LobeSet()])
    least = {order: min(c.loss.mean() for c in tried if c.order == order) for order in (0, 1, 2, 4, 6, 16)}
    assert least[16] <= 1.1**2 * min(least.values())
    forced = choose([c for c in tried if c.order == 16])[0]
    basis = Basis("isotropic", 16)
    sums = FoldedDesign(basis.design(cells), weight, np.zeros(len(cells), int))
    statistics = sums.statistics(cells.value, np.empty((len(cells), 0)))
    factors = Factors(sums.modes_gram, forced.prior.precision(basis.degree(), level(cells)))
    coefficients = solve(statistics, factors, np.empty(0))[0].T
    everywhere = basis.evaluate(random_cells(), coefficients)
    assert np.abs(everywhere).max() < 3.0 * cells.value.max()


def test_channels_are_tried_a_few_at_a_time_with_the_losses_of_all_together():
    cells = cells_of(simulate(make_brdf("lambert"), SMALL)).of_channels(np.array([0, 1, 2, 0, 1, 2, 0]))
    rng = np.random.default_rng(3)
    cells = cells.with_value(cells.value * (1.0 + 0.05 * rng.normal(size=cells.value.shape)))
    weight = error_model(cells) ** -2.0
    sets = [LobeSet(), LobeSet((retro_lobe(absolute=False),), (np.array([0.2]),))]
    together = try_all(cells, weight, "isotropic", (0, 2), sets)
    alone = [
        try_all(cells.of_channels(np.array([c])), weight[:, [c]], "isotropic", (0, 2), sets) for c in range(7)
    ]
    for k, one in enumerate(together):
        mean = np.mean([each[k].loss for each in alone], axis=0)
        assert (one.order, one.prior) == (alone[0][k].order, alone[0][k].prior)
        assert np.allclose(one.loss, mean, rtol=1e-9)  # of a sum of thousands of squares in another order
