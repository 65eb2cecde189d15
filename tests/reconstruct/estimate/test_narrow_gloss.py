"""Whether cells show a narrow gloss, what is kept of them, and how it is blurred."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.estimate.binning_error import blur
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.narrow_gloss import evenly, fewer, half_angles, is_peak, shown_by
from photogonio.reconstruct.estimate.weights import INDEPENDENT, independence
from photogonio.reconstruct.lobes.families import families, tail_lobe
from photogonio.reconstruct.modes.angles import pair_angles, unit_vectors
from photogonio.reconstruct.represent.as_found import lobes_of
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.table.refinement import NEAR

COAT = families(absolute=True)[2]  # of a dielectric


def gloss(roughness, under=0.1):
    ground = np.full((1, 1), under)
    shape = np.array([roughness, 0.04])
    return Model(Basis("isotropic", 0), np.zeros((1, 1)), LobeSet((COAT,), (shape,)), ground)


def seen(roughness, count=6000, under=0.1):
    """Cells of every half angle, as ``gloss`` has them over a ground of ``under``."""
    rng = np.random.default_rng(0)
    theta = rng.uniform(0.0, 1.2, count)
    away = rng.exponential(0.3, count)
    cells = Cells.of_angles(theta, np.clip(theta + away, 0.0, 1.2), np.full(count, np.pi))
    cells = replace(cells, binned=True, turn=np.zeros((count, 2)))
    return cells.with_value(gloss(roughness, under).evaluate(cells))


def thinned(cells, most):
    kept, peaked = fewer([shown_by(cells)], most)
    return replace(cells.take(kept), peaked=peaked), peaked


@pytest.mark.parametrize(("roughness", "narrow"), [(0.03, True), (0.06, True), (0.25, False), (0.5, False)])
def test_a_peak_hardly_wider_than_facets_is_told(roughness, narrow):
    assert is_peak([shown_by(seen(roughness))]) == narrow


@pytest.mark.parametrize(("roughness", "narrow"), [(0.08, True), (0.3, False), (1.0, False)])
def test_over_a_bright_ground_a_peak_is_told_by_what_stands_above_it(roughness, narrow):
    cells = seen(roughness, under=2.0)
    shown = shown_by(cells)
    assert np.median(shown.top) < 2.5 * np.median(shown.beside)
    assert is_peak([shown]) == narrow
    assert not is_peak([shown_by(cells, finer=False)])  # of coarse cells the ground lies under the blur


def test_cells_of_a_narrow_peak_are_kept_first():
    cells, peaked = thinned(seen(0.04), 4000)
    assert peaked and len(cells) <= 4000
    kept = cells.take(evenly(cells, 1000))
    share = (half_angles(kept) < NEAR).mean()
    assert share == pytest.approx(0.5, abs=0.01)  # as many as of all others
    wide, peaked = thinned(seen(0.4), 4000)
    assert not peaked
    np.testing.assert_array_equal(evenly(wide, 1000), np.arange(0, 4000, 4))


def test_cells_are_chosen_alike_whatever_parts_they_come_in():
    for roughness in (0.04, 0.4):
        cells = seen(roughness)
        parts = [shown_by(cells.take(np.arange(start, start + 1500))) for start in range(0, 6000, 1500)]
        (one, sharp), (many, alike) = fewer([shown_by(cells)], 1000), fewer(parts, 1000)
        assert sharp == alike
        np.testing.assert_array_equal(one, many)


def test_the_blur_of_a_narrow_peak_is_the_mean_over_normals_and_lamp():
    """Normals and a glowing disc drawn at random, whose widths together are half of the peak's own."""
    roughness, turn, lamp, draws = 0.05, 0.015, 0.03, 40_000  # slopes, radians, angular radius
    model, rng = gloss(roughness), np.random.default_rng(1)
    for theta_i, theta_r in ((0.5, 0.5), (0.5, 0.56), (0.9, 0.84)):
        cell = Cells.of_angles(np.array([theta_i]), np.array([theta_r]), np.array([np.pi]))
        around = {"turn": np.full((1, 2), turn**2), "lamp": np.array([0.25 * lamp**2])}
        cell = replace(cell, binned=True, peaked=True, **around)
        i, r = unit_vectors(theta_i, 0.0), unit_vectors(theta_r, np.pi)
        a, b = turn * rng.normal(size=(2, draws, 1))
        x, y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
        i, r = (one + a * np.cross(x, one) + b * np.cross(y, one) for one in (i, r))
        reach, angle = lamp * np.sqrt(rng.uniform(size=draws)), rng.uniform(0.0, 2.0 * np.pi, draws)
        along = np.stack([i[:, 2], np.zeros(draws), -i[:, 0]], axis=-1)
        lit = i + (reach * np.cos(angle))[:, None] * along + (reach * np.sin(angle))[:, None] * y
        theta, other, dphi = pair_angles(lit, r)
        value = model.evaluate(Cells.of_angles(theta, other, np.abs(dphi)))[:, 0]
        mean = np.average(value, weights=lit[:, 2])
        theta, other, dphi = pair_angles(i, r)
        means = pair_angles(unit_vectors(theta, 0.0).mean(0), unit_vectors(other, dphi).mean(0))
        sharp = model.evaluate(Cells.of_angles(*(np.abs(one)[None] for one in means)))[0, 0]
        # the draws' own error, and what the fifth order leaves of a blur that takes off up to a fourth
        off = 4.0 * value.std() / np.sqrt(draws) + 0.02 * sharp
        assert sharp + blur(cell, model)[0, 0] == pytest.approx(mean, abs=off)
        assert abs(mean - sharp) > 2.0 * off


def test_tails_are_written_as_they_are_fitted():
    core = families(absolute=False)[2]
    lobes = LobeSet((core, tail_lobe(absolute=True)), (np.array([0.05]), np.array([0.15])))
    model = Model(Basis("isotropic", 0), np.zeros((1, 1)), lobes, np.array([[0.7], [0.2], [0.3]]))
    cells = Cells.of_angles(np.array([0.2, 0.9]), np.array([0.3, 0.9]), np.array([np.pi, 3.0]))
    angles = (cells.theta_i, cells.theta_r, cells.dphi)
    said = sum(one.evaluate(*angles) for one in lobes_of(model))
    np.testing.assert_allclose(said, model.evaluate(cells), rtol=1e-4)  # a coat's albedo is interpolated


def test_what_a_view_shows_of_a_narrow_peak_counts_beside_all_else():
    cells = replace(seen(0.04), binned=True, peaked=True)
    counts, near = independence(cells)[:, 0], half_angles(cells) < NEAR
    assert counts[near].sum() == pytest.approx(INDEPENDENT)
    assert counts[~near].sum() == pytest.approx(INDEPENDENT)
    assert independence(replace(cells, peaked=False)).sum() == pytest.approx(INDEPENDENT)
