"""What symmetry leaves free in a table of facet pairs, as docs/modes.md counts it."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.modes import basis as m
from photogonio.reconstruct.modes.angles import pair_angles
from photogonio.reconstruct.table import facets as f
from photogonio.synthetic.brdf.library import MODELS


def pair_classes(level: int, *, reciprocal: bool = True, isotropic: bool = True) -> np.ndarray:
    """(f, f) class of each facet pair: pairs of one class have one value under the symmetries asked for.

    Isotropic (with bilateral symmetry): equal theta_i, theta_r and |dphi|; reciprocal: i and r may change places.
    Classes are numbered from 0 in no set order.
    """
    count = f.facet_count(level)
    i, r = (x.ravel() for x in np.indices((count, count)))
    if reciprocal and not isotropic:
        keys = np.column_stack([np.minimum(i, r), np.maximum(i, r)])
    elif not isotropic:
        keys = np.column_stack([i, r])
    else:
        centres = f.barycentres(level)
        theta_i, theta_r, dphi = pair_angles(centres[i], centres[r])
        if reciprocal:
            theta_i, theta_r = np.minimum(theta_i, theta_r), np.maximum(theta_i, theta_r)
        keys = np.round(np.column_stack([theta_i, theta_r, np.abs(dphi)]) * 2**30).astype(np.int64)
    return np.unique(_merged(keys), axis=0, return_inverse=True)[1].reshape(count, count)


def _merged(keys: np.ndarray) -> np.ndarray:
    """Angles that differ by rounding alone, made equal column by column."""
    merged = np.empty_like(keys)
    for k, column in enumerate(keys.T):
        values, place = np.unique(column, return_inverse=True)
        merged[:, k] = (
            np.concatenate([[0], np.cumsum(np.diff(values) > 8)])[place] if keys.shape[1] == 3 else column
        )
    return merged


@pytest.mark.parametrize(
    ("level", "pairs", "reciprocal", "both"), [(1, 1600, 820, 96), (2, 25600, 12880, 1344)]
)
def test_degrees_of_freedom(level, pairs, reciprocal, both):
    def count(**kinds):
        classes = pair_classes(level, **kinds)
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
    classes = pair_classes(1)
    centres = f.barycentres(1)
    matrix = MODELS["satin-paint"]()(centres[:, None], centres[None, :])[..., 0]
    for label in range(classes.max() + 1):
        assert np.ptp(matrix[classes == label]) < 1e-12 * matrix.max()
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
    first = np.unique(pair_classes(request.param).ravel(), return_index=True)[1]
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
