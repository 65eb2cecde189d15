"""The cost of lobes' shapes, its slopes, and the way down."""

import numpy as np
import pytest

from photogonio.reconstruct.estimate.folded_design import Common
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.model_selection import Prior
from photogonio.reconstruct.estimate.variable_projection import Profile, descend
from photogonio.reconstruct.estimate.weights import level
from photogonio.reconstruct.lobes.families import Family, families
from tests.reconstruct.estimate.test_lobe_search import observed, start_of

PRIOR = Prior(0.1, 1.0)
COAT = families(absolute=True)[2]  # its roughness and its index are hard to tell apart


def profile_of(
    family: Family, shape: list[float], own: list[list[float]], *, views: int = 0, noise: float = 0.003
) -> Profile:
    cells, deviation = observed(family, np.array(shape), np.array(own), noise=noise)
    basis = Basis("isotropic", 3)
    common = Common(np.arange(len(cells)) % views, 0.02 * cells.value) if views else None
    penalty = PRIOR.precision(basis.degree(), level(cells))
    weight = 1.0 / np.maximum(deviation, 0.003 * cells.value) ** 2
    return Profile(cells, basis.design(cells), weight, penalty, common)


def test_the_cost_is_that_of_penalised_least_squares():
    family = families(absolute=True)[0]
    cells, deviation = observed(family, np.array([0.2]), np.array([[0.05, 0.1]]))
    basis = Basis("isotropic", 3)
    design, weight = basis.design(cells), 1.0 / deviation**2
    penalty = PRIOR.precision(basis.degree(), level(cells))
    lobes = start_of(family, 0.27)
    fixed, columns = lobes.columns(cells)
    full, direct = np.hstack([design, columns]), 0.0
    for c in range(2):
        root = np.sqrt(weight[:, c, None])
        prior = np.hstack([np.diag(np.sqrt(penalty[c])), np.zeros((len(penalty[c]), 1))])
        rows, right = np.vstack([root * full, prior]), root[:, 0] * (cells.value[:, c] - fixed)
        right = np.r_[right, np.zeros(len(prior))]
        direct += np.sum((rows @ np.linalg.lstsq(rows, right)[0] - right) ** 2)
    assert Profile(cells, design, weight, penalty).cost(lobes) == pytest.approx(direct, rel=1e-6)


@pytest.mark.parametrize("views", [0, 10])
@pytest.mark.parametrize("family", [families(absolute=True)[0], COAT], ids=lambda f: f.name)
def test_slopes_are_those_of_the_cost(family, views):
    own = [[0.05, 0.1]]
    profile = profile_of(family, [0.2, 0.05][: len(family.shape_names)], own, views=views)
    lobes = start_of(family, 0.23)
    logs, step = lobes.flat(), 1e-4
    slope = profile.slope(lobes)
    assert slope.cost == pytest.approx(profile.cost(lobes), rel=1e-12)
    for p in range(len(logs)):
        beside = [
            profile.cost(lobes.with_flat(logs + sign * step * (np.arange(len(logs)) == p)))
            for sign in (-1, 1)
        ]
        # differences of 1e-4 of a logarithm, and the lobes' own of 1e-5
        assert slope.first[p] == pytest.approx((beside[1] - beside[0]) / (2 * step), rel=2e-3)


def test_where_the_model_is_true_curvatures_are_those_of_the_cost():
    shape = [0.2, 0.05]
    profile = profile_of(COAT, shape, [[0.05, 0.1]], views=10, noise=0.0)
    lobes = LobeSet((COAT,), (np.array(shape),))
    second, logs, step = profile.slope(lobes).second, lobes.flat(), 1e-3
    for p, q in ((0, 0), (0, 1), (1, 1)):
        corners = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
        places = [logs + step * (a * np.eye(2)[p] + b * np.eye(2)[q]) for a, b in corners]
        cost = np.array([profile.cost(lobes.with_flat(place)) for place in places])
        measured = (cost * corners.prod(1)).sum() / (4 * step**2)
        assert second[p, q] == pytest.approx(
            measured, rel=0.02
        )  # Gauss and Newton's lacks the residual's own


def test_a_narrow_valley_is_followed_in_few_steps(monkeypatch):
    shape = [0.4, 0.03]
    profile = profile_of(COAT, shape, [[0.3, 0.2]], noise=0.0)
    visited = []
    whole = profile.slope
    monkeypatch.setattr(profile, "slope", lambda lobes: visited.append(lobes) or whole(lobes))
    found = descend(profile, start_of(COAT, 0.25), 0.15)
    np.testing.assert_allclose(found.shapes[0], shape, rtol=2e-3)
    assert len(visited) < 12  # steps along the gradient took some twenty and more


@pytest.mark.parametrize(("shape", "at"), [([0.2, 0.001], 0), ([0.4, 0.4], 1)])
@pytest.mark.parametrize("start", [0.06, 0.12, 0.25, 0.5])
def test_a_shape_that_ends_at_its_bound_does_not_hold_up_the_other(shape, at, start):
    """A coat whose index is below, or above, all that are tried: its roughness is the best at that bound."""
    profile = profile_of(COAT, shape, [[0.3, 0.2]])
    found = descend(profile, start_of(COAT, start), 0.15)
    bound = np.exp(profile.bounds(found)[1, at])
    assert found.shapes[0][1] == pytest.approx(bound, rel=1e-9)
    beside = [
        profile.cost(LobeSet((COAT,), (np.array([found.shapes[0][0] * by, bound]),)))
        for by in (0.99, 1.0, 1.01)
    ]
    assert min(beside) == beside[1]
