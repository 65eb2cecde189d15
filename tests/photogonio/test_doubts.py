"""What a result says of itself that no number holds: directions not looked at, photos at odds."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.fit import FitOptions, fit_table
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.table.facet_table import LEFT_OUT
from photogonio.report.summary import _odd_colours, clipped, doubts, unseen, unseen_lines
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.tables import Plan, simulate

PLAN = Plan(views=10, pixels=900, level=2, spoiled=0.0)


@pytest.fixture(scope="module")
def fit():
    return fit_table(simulate(make_brdf("lambert"), PLAN), FitOptions(lobes=0))


def only(fit, kept):
    """The fit as if only the cells ``kept`` had been seen."""
    return replace(fit, cells=fit.cells.take(kept), predicted=fit.predicted[kept])


def looked_at(fit, least):
    """The fit as if only pairs ``least`` and more from the light's own direction had been seen."""
    cells = fit.cells
    along = np.cos(cells.theta_i) * np.cos(cells.theta_r)
    phase = np.arccos(along + np.sin(cells.theta_i) * np.sin(cells.theta_r) * np.cos(cells.dphi))
    return only(fit, phase >= least)


def codes(found):
    return [one.code for one in found]


def test_a_retro_peak_that_would_not_have_been_seen_is_told(fit):
    assert "retro-unseen" in codes(doubts(looked_at(fit, np.radians(25.0))))


@pytest.mark.parametrize(("most", "told"), [(12.0, True), (60.0, False)])
def test_a_mirror_that_was_seen_head_on_alone_is_told(fit, most, told):
    """As a ball under a flash beside the lens is; ``most`` degrees between light and camera."""
    cells = fit.cells
    along = np.cos(cells.theta_i) * np.cos(cells.theta_r)
    phase = np.arccos(along + np.sin(cells.theta_i) * np.sin(cells.theta_r) * np.cos(cells.dphi))
    near = only(fit, phase <= np.radians(most))
    assert ("mirror-unseen" in codes(doubts(near))) == told


def test_what_was_not_seen_stands_beside_the_result(fit):
    """Of a flash alone: which directions, and how far apart light and camera were, in one line; else none."""
    cells = fit.cells
    along = np.cos(cells.theta_i) * np.cos(cells.theta_r)
    phase = np.arccos(along + np.sin(cells.theta_i) * np.sin(cells.theta_r) * np.cos(cells.dphi))
    (line,) = unseen_lines(doubts(only(fit, phase <= np.radians(12.0))))
    assert line.startswith("NOT SEEN: ") and "of the mirror direction" in line and "extrapolated" in line
    (line,) = unseen_lines(doubts(looked_at(fit, np.radians(25.0))))
    assert "of the light's own direction" in line and "degrees" in line
    everything = [one for one in doubts(fit) if one.code in ("mirror-unseen", "retro-unseen")]
    assert not unseen(everything) and not unseen_lines(everything)


def test_a_fit_that_misses_all_photos_tells_nothing_of_their_colours(fit):
    """Values far below the fit's, some of them negative: no ratio of theirs is one of colours."""
    wild = 1e18 * (1.0 + fit.predicted)
    sign = np.where(fit.cells.group % 2, 1.0, -1.0)[:, None]
    assert not _odd_colours(replace(fit.cells, value=sign * fit.cells.value), wild)


def test_photos_that_agree_raise_no_doubt_and_photos_at_odds_do(fit):
    assert "photos-contradict" not in codes(doubts(fit))
    at_odds = replace(fit, diagnostics=fit.diagnostics | {"contradiction": 0.2})
    assert "photos-contradict" in codes(doubts(at_odds))


@pytest.mark.parametrize(("most", "told"), [(80.0, True), (104.0, True), (150.0, False)])
def test_a_gloss_that_was_seen_from_above_alone_is_told(most, told):
    """``most`` degrees between light and camera are half as many of incidence on a mirror."""
    many = replace(PLAN, views=40)
    glossy = fit_table(simulate(make_brdf("plastic"), many), FitOptions(lobes=1, order=0))
    cells = glossy.cells
    along = np.cos(cells.theta_i) * np.cos(cells.theta_r)
    phase = np.arccos(along + np.sin(cells.theta_i) * np.sin(cells.theta_r) * np.cos(cells.dphi))
    near = only(glossy, phase <= np.radians(most))
    assert ("gloss-extrapolated" in codes(doubts(near))) == told


@pytest.mark.parametrize(("most", "told"), [(90.0, True), (150.0, False)])
def test_where_no_gloss_was_found_it_is_told_that_none_toward_grazing_could_be(most, told):
    """A sheen is nothing but what is seen there."""
    matte = fit_table(simulate(make_brdf("lambert"), replace(PLAN, views=40)), FitOptions(lobes=0, order=0))
    cells = matte.cells
    along = np.cos(cells.theta_i) * np.cos(cells.theta_r)
    phase = np.arccos(along + np.sin(cells.theta_i) * np.sin(cells.theta_r) * np.cos(cells.dphi))
    near = only(matte, phase <= np.radians(most))
    lines = [one.message for one in doubts(near) if one.code == "gloss-unseen-at-grazing"]
    assert len(lines) == told
    if told:
        apart = float(lines[0].split("no more than ")[1].split()[0])
        assert most - 10.0 < apart <= most  # facets of half a dozen degrees


@pytest.mark.parametrize(("share", "told"), [(0.1, True), (0.001, False)])
def test_a_sample_that_is_clipped_is_told(share, told):
    """``share`` of one photo's pixels, the photo named."""
    table = simulate(make_brdf("lambert"), PLAN)
    lost = np.zeros((len(table.groups), len(LEFT_OUT)), int)
    used = table.count[table.group == 3].sum()
    lost[3, LEFT_OUT.index("saturated")] = round(used * share / (1 - share))
    lines = [one.message for one in clipped(replace(table, left_out=lost))]
    assert [f"1 of {PLAN.views} photos, 10% of it in {table.groups[3]}" in line for line in lines] == [
        True
    ] * told


def test_photos_of_another_colour_are_told_whatever_their_scales():
    """Another sample among them, or another white balance: their mean was taken, and nothing said."""
    cells = Cells.of_angles(np.full(60, 0.5), np.linspace(0.1, 1.0, 60), np.full(60, 1.0))
    light = np.array([0.6, 0.5, 0.4]) / np.pi
    cells = replace(
        cells,
        value=np.tile(light, (60, 1)) * np.repeat([1.0, 0.7, 1.3], 20)[:, None],
        group=np.repeat(np.arange(3), 20),
        groups=("a.png", "b.png", "c.png"),
    )
    predicted = np.tile(light, (60, 1))
    assert not _odd_colours(cells, predicted)
    other = np.where(cells.group[:, None] == 1, cells.value * np.array([0.75, 1.0, 1.25]), cells.value)
    (told,) = _odd_colours(replace(cells, value=other), predicted)
    assert told.code == "photos-contradict" and told.views == ("b.png",)
    assert told.amount == pytest.approx(0.25)
