"""Models that may turn, judged by what they were not shown."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.weights import independence
from photogonio.reconstruct.lobes.families import families, retro_lobe, round_lobe
from photogonio.reconstruct.symmetry.columns import Columns
from photogonio.reconstruct.symmetry.trials import (
    Trial,
    Tried,
    difference,
    glossy,
    shuffled,
    turned,
    units_of,
)
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.tables import TURNED_PLANE, simulate


def test_shuffled_views_are_the_same_of_an_isotropic_surface():
    cells = cells_of(simulate(make_brdf("plastic"), replace(TURNED_PLANE, views=8)))
    other = shuffled(cells, np.random.default_rng(3))
    np.testing.assert_array_equal(other.theta_r, cells.theta_r)
    wave = np.exp(1j * (cells.phi_r - cells.phi_i))
    np.testing.assert_allclose(np.exp(1j * (other.phi_r - other.phi_i)), wave, atol=1e-12)
    turn = np.exp(1j * (other.phi_i - cells.phi_i))
    for view in range(8):
        rows = cells.group == view
        np.testing.assert_allclose(turn[rows], turn[rows][0], atol=1e-12)
    assert np.abs(turn - 1.0).max() > 0.1


METAL, COAT = families(absolute=True)[0], families(absolute=True)[2]


def cells(views: int = 1, n: int = 120) -> Cells:
    rng = np.random.default_rng(0)
    theta, phi = rng.uniform(0.0, 1.3, (2, n)), rng.uniform(-np.pi, np.pi, (2, n))
    names = tuple(f"v{k}" for k in range(views))
    return replace(
        Cells.of_directions(theta[0], phi[0], theta[1], phi[1]), group=np.arange(n) % views, groups=names
    )


@pytest.mark.parametrize("family", [METAL, COAT], ids=lambda family: family.name)
def test_a_lobe_that_may_turn_starts_as_one_that_does_not(family):
    """Both roughnesses are the one: what a coat of two lets into its ground is taken by their mean."""
    still = LobeSet((family,), (np.array([0.3, 0.04][: len(family.shape_names)]),))
    turns = turned(still)
    assert turns.turning and len(turns.shapes[0]) == len(still.shapes[0]) + 2
    for one, other in zip(turns.columns(cells()), still.columns(cells()), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)


def test_what_has_no_axes_does_not_turn():
    peaks = (LobeSet((one(absolute=True),), (np.array([0.1]),)) for one in (retro_lobe, round_lobe))
    for lobes in (LobeSet(), *peaks):
        assert turned(lobes) is lobes


def test_a_gloss_is_one_only_where_it_is_bright_enough_to_tell():
    def model(f0: float, *lobes) -> Model:
        shapes = tuple(np.array([0.3]) for _ in lobes)
        own = np.full((len(lobes), 1), f0)
        return Model(Basis("isotropic", 0), np.full((1, 1), 1.0), LobeSet(lobes, shapes), own)

    assert glossy(model(0.9, METAL), cells())
    assert not glossy(model(0.0), cells())
    faint = replace(METAL, absolute=False)  # of a free weight, which is next to nothing
    weights = LobeSet((faint,), (np.array([0.3]),))
    assert not glossy(Model(Basis("isotropic", 0), np.ones((1, 1)), weights, np.full((2, 1), 1e-4)), cells())


def test_views_hang_together_where_there_are_several_and_else_neighbouring_directions():
    many = cells(views=12)
    np.testing.assert_array_equal(units_of(many), many.group)
    blocks = units_of(cells())
    assert 3 < len(np.unique(blocks)) < len(cells())


def tried(loss: float, predicted: float) -> Tried:
    model = Model(Basis("isotropic", 0), np.ones((1, 1)), LobeSet(), np.empty((0, 1)))
    return Tried(model, Columns.none(cells()), 0, np.zeros((1, 1)), loss, np.full((5, 1), predicted))


def test_odds_are_of_losses_by_as_many_values_as_are_independent():
    """Of a normal likelihood whose variance is found: the ratio of losses to half the number of values."""
    none = np.empty(0)
    trial = Trial(cells(), none, none, none, None, none, (), 40.0)
    worse, better = tried(2.0, 0.2), tried(1.0, 0.22)
    assert trial.log_odds(worse, better) == pytest.approx(20.0 * np.log(2.0))
    assert trial.log_odds(better, worse) == -trial.log_odds(worse, better)
    assert trial.log_odds(worse, worse) == 0.0
    assert difference(worse, better) == pytest.approx(0.1) and difference(worse, worse) == 0.0


def test_of_two_models_that_are_far_off_the_better_one_accounts_for_nothing():
    """What chance leaves of 120 values is about their number: a model may miss hardly more, or must take away most of
    what the other missed."""
    given = cells()
    ones = np.ones((len(given), 1))
    trial = Trial(given, ones, ones, np.zeros(len(given), int), None, np.zeros(1), (), 40.0)
    count = float(independence(given).sum())
    assert trial.accounts(tried(1.3 * count, 0.2), tried(count, 0.2))
    assert not trial.accounts(tried(90.0 * count, 0.2), tried(60.0 * count, 0.2))
    assert trial.accounts(tried(90.0 * count, 0.2), tried(10.0 * count, 0.2))
