"""Views that contradict the others are told from views that alone show a peak."""

from dataclasses import replace

import numpy as np

from photogonio.reconstruct.estimate.outlier_views import NEAR, apart, contradiction, discordant
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.tables import Plan, simulate

PLAN = Plan(views=12, pixels=1500, level=2, spoiled=0.0)
LAMBERT = 0.5 / np.pi


def cells_and_guess(model="lambert"):
    cells = cells_of(simulate(make_brdf(model), PLAN))
    return cells, np.full_like(cells.value, LAMBERT)


def test_a_photo_under_another_light_than_it_says_is_found():
    """Its values are those of a light half a radian away: wrong by the ratio of the cosines."""
    cells, guess = cells_and_guess()
    wrong = cells.group == 4
    seen = np.cos(np.clip(cells.theta_i + 0.5 * np.cos(cells.dphi), 0.0, 1.4)) / np.cos(cells.theta_i)
    spoiled = cells.with_value(np.where(wrong[:, None], seen[:, None] * cells.value, cells.value))
    assert np.flatnonzero(discordant(spoiled, guess)).tolist() == [4]


def test_a_peak_that_one_view_alone_shows_is_no_fault():
    """Ten times too bright where nobody else looks, which any model's misfit would call an outlier."""
    cells, guess = cells_and_guess()
    alone = cells.group == 4
    others = cells.take(~alone)
    moved = replace(cells.take(alone), theta_i=np.full(alone.sum(), 1.3), theta_r=np.full(alone.sum(), 1.3))
    both = replace(
        cells,
        **{
            name: np.concatenate([getattr(others, name), getattr(moved, name)])
            for name in (
                "theta_i",
                "phi_i",
                "theta_r",
                "phi_r",
                "dphi",
                "value",
                "variance",
                "count",
                "group",
                "place",
            )
        },
        turn=None,
    )
    bright = both.with_value(np.where((both.group == 4)[:, None], 10.0 * both.value, both.value))
    far = np.hypot(others.theta_i - 1.3, others.theta_r - 1.3) > 0.1
    keep = np.concatenate([far, np.ones(len(moved), bool)])
    assert not discordant(bright.take(keep), guess[keep]).any()


def test_a_surface_that_the_model_misses_everywhere_leaves_all_views_in():
    cells, guess = cells_and_guess("plastic")
    assert not discordant(cells, guess).any()


def test_views_that_agree_contradict_by_their_noise_and_views_at_odds_by_their_quarrel():
    cells, guess = cells_and_guess()
    tilt = 0.3 * np.cos(cells.dphi) * np.sin(cells.theta_i) * np.where(cells.group % 2 == 0, 1.0, -1.0)
    quarrel = cells.with_value(cells.value * (1.0 + tilt[:, None]))
    assert contradiction(cells, guess) <= 0.01
    assert contradiction(quarrel, guess) >= 0.05


def test_where_all_is_black_nothing_contradicts():
    cells, guess = cells_and_guess()
    black = cells.with_value(np.random.default_rng(0).normal(size=cells.value.shape))
    assert not discordant(black, 0.0 * guess).any()
    assert np.isnan(contradiction(black, 0.0 * guess))


def test_how_far_a_view_looked_from_all_others_is_known():
    """Exchanged, theirs has the camera 0.4 rad away, which is a chord; the same pair and its twin are nowhere else."""
    i, r = np.full(3, 0.5), np.full(3, 0.9)
    for angles, far in (((0.9, 0.9), 2 * np.sin(0.2)), ((0.5, 0.9), 0.0), ((0.9, 0.5), 0.0)):
        cells = Cells.of_angles(np.append(i, angles[0]), np.append(r, angles[1]), np.full(4, 1.0))
        cells = replace(cells, group=np.array([0, 1, 2, 3]), groups=("a", "b", "c", "d"))
        assert abs(apart(cells, 3) - max(far - NEAR, 0.0)) < 1e-12
    assert apart(replace(cells, group=np.zeros(4, int)), 0) == 0.0
    assert apart(cells.take(np.arange(3)), 3) == 0.0
