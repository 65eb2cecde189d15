"""How sure a fit is: what its standard error is made of."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.estimate.lobe_search import search_lobes
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import STEP, LobeSet, Model, shape_slopes
from photogonio.reconstruct.estimate.model_selection import Candidate
from photogonio.reconstruct.estimate.pilot import PILOT_PRIOR
from photogonio.reconstruct.lobes.families import retro_lobe
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.budget import Rival, Uncertainty, uncertainty_of


def test_the_stated_error_holds_the_spread_of_the_rivals():
    """Of models that are f and 1.1 f, each believed by half, the mean square of what is off is 0.005 f^2; and half of
    the rival's own variance."""
    basis, cells = Basis("isotropic", 0), Cells.of_angles(*np.full((3, 1), 0.5))
    model, other = (Model(basis, np.full((1, 1), size), LobeSet(), np.empty((0, 1))) for size in (1.0, 1.1))
    sure = Uncertainty(basis, np.zeros((1, 1, 1)), 0, 10.0)
    value = model.evaluate(cells)
    told = Uncertainty(basis, sure.covariance, 0, 10.0, rivals=(Rival(other, 0.5),))
    assert sure.standard_error(model, cells) == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(told.standard_error(model, cells), np.sqrt(0.005) * value, rtol=1e-9)
    unsure = Uncertainty(basis, np.full((1, 1, 1), 0.03), 0, 10.0)
    both = Uncertainty(basis, sure.covariance, 0, 10.0, rivals=(Rival(other, 0.5, unsure),))
    expected = np.sqrt(0.5 * (0.01 + 0.03)) * value
    np.testing.assert_allclose(both.standard_error(model, cells), expected, rtol=1e-9)


def test_what_all_cells_share_is_not_averaged_away():
    """A matte surface of many cells: a change of all of them by a hundredth is taken for the surface's own, and leaves
    f unsure by a hundredth; one that no surface does, in half of them up and in half down, is told by the cells."""
    rng, count = np.random.default_rng(0), 2000
    angles = np.arccos(rng.uniform(0.3, 1.0, (2, count)))
    cells = Cells.of_angles(*angles, rng.uniform(0.0, np.pi, count))
    value = np.full((count, 1), 0.2) * rng.normal(1.0, 0.01, (count, 1))
    group = np.arange(count) % 12
    cells = replace(cells, value=value, variance=np.full((count, 1), 4e-6), binned=True, group=group)
    cells = replace(cells, groups=tuple(map(str, range(12))), channels=("grey",))
    deviation, basis = np.full((count, 1), 2e-3), Basis("isotropic", 0)
    fitted = search_lobes(cells, deviation, basis, PILOT_PRIOR, LobeSet(), free=0)
    models = [(Candidate(0, PILOT_PRIOR, LobeSet(), np.zeros(1)), 1.0)]
    up = np.where(rng.random(count) < 0.5, 1.0, -1.0)
    shares = {"none": None, "scale": np.full(count, 2e-3), "told": 2e-3 * up}
    errors = {}
    for name, shared in shares.items():
        rows = None if shared is None else shared[:, None, None]
        spread = uncertainty_of(fitted, cells, deviation, models, shared=rows)
        assert spread.covariance.shape == (1, 1, 1)  # f does not change with what is shared
        errors[name] = float(spread.standard_error(fitted.model, cells.take(np.arange(1)))[0, 0])
    assert errors["none"] < 2e-4
    assert errors["scale"] == pytest.approx(2e-3, rel=0.1)
    assert errors["told"] == pytest.approx(errors["none"], rel=0.1)


def test_an_interval_of_few_degrees_of_freedom_is_students():
    basis = Basis("isotropic", 0)
    for freedom, quantile in ((1.0, 12.706), (10.0, 2.228), (1e9, 1.960)):
        spread = Uncertainty(basis, np.zeros((1, 1, 1)), 0, freedom)
        np.testing.assert_allclose(spread.half_width(np.array([2.0])), 2.0 * quantile, rtol=1e-3)
    assert spread.half_width(np.ones(1), 0.5) == pytest.approx(0.6745, rel=1e-3)


def test_modes_alone_are_as_sure_as_with_the_lobes_known():
    """The covariance of modes given all else is the inverse of their part of the precision."""
    basis = Basis("isotropic", 2)
    m, rng = len(basis.modes), np.random.default_rng(0)
    root = rng.normal(size=(2, m + 3, m + 3))
    whole = root @ np.swapaxes(root, 1, 2) + np.eye(m + 3)
    spread = Uncertainty(basis, whole, 3, 10.0)
    for found, one in zip(spread.of_modes_alone(), whole, strict=True):
        np.testing.assert_allclose(found, np.linalg.inv(np.linalg.inv(one)[:m, :m]), rtol=1e-9)


def test_slopes_by_the_logarithm_of_a_roughness_in_closed_form():
    """Seen along the light a retro-reflective peak is weight / (4 pi roughness^2): its slope is -2 of itself."""
    lobes = LobeSet((retro_lobe(absolute=True),), (np.array([0.2]),))
    model = Model(Basis("isotropic", 0), np.zeros((1, 1)), lobes, np.full((1, 1), 0.6))
    along = Cells.of_angles(np.array([0.0, 0.5]), np.array([0.0, 0.5]), np.zeros(2))
    # differences of exp(-2 x) over steps h are off by 2 h^2 / 3
    np.testing.assert_allclose(shape_slopes(model, along)[:, 0], -2.0 * model.evaluate(along), rtol=STEP**2)
