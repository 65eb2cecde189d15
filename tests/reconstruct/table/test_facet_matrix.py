"""The facet-pair matrix, its classes under symmetry, and the means of modes over facets."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.modes import basis as m
from photogonio.reconstruct.modes.angles import pair_angles, unit_vectors
from photogonio.reconstruct.modes.zernike import zernike_sequence
from photogonio.reconstruct.table import facet_matrix as lookup
from photogonio.reconstruct.table import facet_means
from photogonio.reconstruct.table import facets as f
from photogonio.synthetic.brdf.library import MODELS


def directions(count: int, seed: int, lowest: float = 0.1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return unit_vectors(np.arccos(rng.uniform(lowest, 1, count)), rng.uniform(0, 2 * np.pi, count))


# --- classes ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("level", "pairs", "reciprocal", "both"), [(1, 1600, 820, 96), (2, 25600, 12880, 1344)]
)
def test_degrees_of_freedom(level, pairs, reciprocal, both):
    def count(**kinds):
        classes = lookup.pair_classes(level, **kinds)
        assert np.array_equal(np.unique(classes), np.arange(classes.max() + 1))
        return classes.max() + 1

    assert count(reciprocal=False, isotropic=False) == pairs
    assert count(reciprocal=True, isotropic=False) == reciprocal
    assert count() == both


def test_classes_by_burnsides_count():
    """Independently: orbits of pairs under the ten turns and reflections of the facets, with exchange."""
    centres = f.barycentres(1)
    images = []
    for k in range(5):
        cos, sin = np.cos(2 * np.pi * k / 5), np.sin(2 * np.pi * k / 5)
        turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
        for mirror in (1, -1):
            images.append(f.facet_index(centres @ (turn @ np.diag([1, mirror, 1])).T, 1))
    assert all(len(np.unique(image)) == 40 for image in images)
    every = np.arange(40)
    fixed = sum((image == every).sum() ** 2 for image in images)
    exchanged = sum((image[image] == every).sum() for image in images)  # (a, b) -> (g b, g a)
    assert (fixed + exchanged) / (2 * len(images)) == 96


def test_how_the_paper_may_have_counted_66():
    """Six rings, each facet of one paired with the 22 exit facets that a reflection leaves distinct, then halved."""
    height = np.round(f.barycentres(1)[:, 2], 9)
    rings = np.unique(height)
    centres = f.barycentres(1)
    on_mirror = np.abs(np.sin(np.arctan2(centres[:, 1], centres[:, 0]) - np.pi / 5)) < 1e-12
    distinct = (40 + on_mirror.sum()) / 2
    assert len(rings) == 6 and distinct == 22
    assert len(rings) * distinct / 2 == 66


def test_classes_join_what_is_equal_and_part_what_is_not():
    classes = lookup.pair_classes(1)
    matrix = lookup.facet_matrix(MODELS["satin-paint"](), 1).values[..., 0]
    for label in range(classes.max() + 1):
        assert np.ptp(matrix[classes == label]) < 1e-12 * matrix.max()
    centres = f.barycentres(1)
    i, r = np.indices((40, 40)).reshape(2, -1)
    theta_i, theta_r, dphi = pair_angles(centres[i], centres[r])
    low, high = np.minimum(theta_i, theta_r), np.maximum(theta_i, theta_r)
    keys = np.column_stack([low, high, np.abs(dphi)])
    first = np.unique(classes.ravel(), return_index=True)[1]
    gaps = np.abs(keys[first][:, None] - keys[first][None]).max(axis=2) + np.eye(len(first))
    assert gaps.min() > 1e-3


@pytest.fixture(scope="module", params=[1, 2])
def class_pairs(request):
    """Level and the angles of one pair of each class."""
    first = np.unique(lookup.pair_classes(request.param).ravel(), return_index=True)[1]
    i, r = np.divmod(first, f.facet_count(request.param))
    centres = f.barycentres(request.param)
    return request.param, pair_angles(centres[i], centres[r])


def test_condition_of_the_design_on_the_classes(class_pairs):
    """What each level carries (docs/modes.md): order 8 at level 1, 12 at level 2, and no more than the first."""
    level, angles = class_pairs
    stated = {1: {4: 2.4, 6: 7.9, 8: 112}, 2: {8: 4.0, 10: 9.0, 12: 22.7}}[level]
    for order, condition in stated.items():
        assert np.linalg.cond(m.isotropic_design(order, *angles)) == pytest.approx(condition, rel=0.02)
    if level == 1:
        assert np.linalg.cond(m.isotropic_design(10, *angles)) > 1e12


# --- lookup -------------------------------------------------------------------------------------------------------


def test_nearest_is_the_value_of_the_facet():
    matrix = lookup.facet_matrix(MODELS["oren-nayar"](), 2)
    incident, exit = directions(500, 1), directions(500, 2)
    found = matrix.nearest(incident, exit)
    centres = f.barycentres(2)
    i, r = f.facet_index(incident, 2), f.facet_index(exit, 2)
    assert np.array_equal(found, MODELS["oren-nayar"]()(centres[i], centres[r]))


def test_interpolation_is_exact_at_barycentres_and_for_planes():
    rng = np.random.default_rng(0)
    matrix = lookup.FacetMatrix(2, rng.normal(size=(160, 160, 2)))
    i, r = rng.integers(0, 160, (2, 50))
    centres = f.barycentres(2)
    assert np.abs(matrix.interpolate(centres[i], centres[r]) - matrix.values[i, r]).max() < 1e-12
    constant = lookup.FacetMatrix(1, np.full((40, 40, 1), 0.3))
    assert constant.interpolate(directions(200, 3, 0), directions(200, 4, 0)) == pytest.approx(0.3, rel=1e-12)


def test_interpolation_is_continuous_reciprocal_and_second_order():
    brdf = MODELS["satin-paint"](albedo=(0.5,), roughness=0.6)
    incident, exit = directions(4000, 5, 0.3), directions(4000, 6, 0.3)
    exact = brdf(incident, exit)
    errors = []
    for level in (1, 2, 3):
        matrix = lookup.facet_matrix(brdf, level)
        smooth = matrix.interpolate(incident, exit)
        assert np.abs(smooth - matrix.interpolate(exit, incident)).max() < 1e-13
        step = matrix.interpolate(incident + np.array([1e-9, -1e-9, 1e-9]), exit)
        assert np.abs(step - smooth).max() < 1e-6  # a step across an edge would be a hundredth
        errors.append(np.sqrt(np.mean((smooth - exact) ** 2) / np.mean(exact**2)))
        coarse = np.sqrt(np.mean((matrix.nearest(incident, exit) - exact) ** 2) / np.mean(exact**2))
        assert errors[-1] < coarse
    assert errors[2] < errors[1] / 3 < errors[0] / 6  # four times less a level, in the end


def test_below_the_horizon_is_not_a_number():
    matrix = lookup.facet_matrix(MODELS["lambert"](), 1)
    up, down = np.array([[0, 0, 1.0]]), np.array([[0, 0.6, -0.8]])
    for lookup_one in (matrix.nearest, matrix.interpolate):
        assert np.isnan(lookup_one(down, up)).all() and np.isnan(lookup_one(up, down)).all()
        assert np.isfinite(lookup_one(up, up)).all()
        assert lookup_one(np.empty((0, 3)), np.empty((0, 3))).shape == (0, 3)


def test_breach_of_reciprocity():
    assert lookup.facet_matrix(MODELS["plastic"](), 1).reciprocity_breach().max() < 1e-12
    oepik = lookup.facet_matrix(MODELS["oepik"](k=2.0), 3).reciprocity_breach()
    assert oepik == pytest.approx(np.sqrt(1 / 8), rel=0.01)  # |(cos_i - cos_r) / 2| over |cos_i|


# --- means of modes -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("level", [1, 2, 4])
def test_means_add_up_to_integrals(level):
    means = facet_means.zernike_means(level, 9)
    total = f.solid_angles(level) @ means
    assert np.abs(total[1:]).max() < 1e-12 and total[0] == pytest.approx(np.sqrt(2 * np.pi), rel=1e-13)
    if level > 1:
        share = f.solid_angles(level).reshape(-1, 4, 1)
        coarser = (share * means.reshape(-1, 4, means.shape[1])).sum(1) / share.sum(1)
        assert np.abs(coarser - facet_means.zernike_means(level - 1, 9)).max() < 1e-12


def test_mean_of_the_first_harmonics_is_the_mean_direction():
    means = facet_means.zernike_means(2, 2)
    z = f.mean_directions(2)[:, 2]  # Z_2^0 = sqrt(3 / 2 pi) (1 - 2 cos theta)
    assert means[:, 4] == pytest.approx(np.sqrt(3 / (2 * np.pi)) * (1 - 2 * z), abs=1e-13)


def test_means_of_pairs():
    rng = np.random.default_rng(1)
    i, r = rng.integers(0, 40, (2, 6))
    found = facet_means.isotropic_means(1, 5, i, r)
    points, weights = facet_means.facet_rule(1, 14)
    for row, a, b in zip(found, i, r, strict=True):
        pairs = np.broadcast_arrays(points[a][:, None], points[b][None])
        design = m.isotropic_design(5, *[x.ravel() for x in pair_angles(*pairs)])
        weight = np.outer(weights[a], weights[b]).ravel()
        assert np.abs(weight @ design / weight.sum() - row).max() < 1e-12


def test_binning_error_falls_with_the_square_of_the_facet():
    brdf_modes = m.isotropic_modes(6)
    gaps = []
    for level in (2, 3, 4):
        z = zernike_sequence(6, *_angles(f.barycentres(level)))
        gaps.append(np.sqrt(np.mean((z - facet_means.zernike_means(level, 6).T) ** 2)))
    assert gaps[0] / gaps[1] == pytest.approx(4, rel=0.15) and gaps[1] / gaps[2] == pytest.approx(4, rel=0.05)
    assert len(brdf_modes) == 30


def _angles(vectors):
    return np.arccos(vectors[:, 2]), np.arctan2(vectors[:, 1], vectors[:, 0])


def test_centre_spread_is_that_of_the_facet():
    level = 3
    points, weights = facet_means.facet_rule(level, 6)
    mean = f.mean_directions(level)[:, None]
    squared = ((points - mean) ** 2).sum(2)
    exact = np.sqrt((weights * squared).sum(1) / weights.sum(1))
    assert facet_means.centre_spread(level) == pytest.approx(exact, rel=1e-9)


def test_a_table_of_a_brdf_in_modes_is_its_means():
    """The matrix of facet means, seen as a lookup table, integrates to the same albedo as the expansion."""
    modes = m.isotropic_modes(4)
    values = np.random.default_rng(2).normal(size=(len(modes), 1))
    brdf = Brdf(4, ("Y",), modes, values, values)
    i, r = np.indices((160, 160)).reshape(2, -1)
    matrix = (facet_means.isotropic_means(2, 4, i, r) @ values).reshape(160, 160)
    areas = f.solid_angles(2)
    flat = areas @ matrix @ areas
    assert flat == pytest.approx(values[0, 0] * 2 * np.pi, rel=1e-10)  # only S_000 has an integral
    assert brdf.evaluate(0.1, 0, 0.1, 0).shape == (1,)
