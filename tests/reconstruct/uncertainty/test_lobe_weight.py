"""What a lobe covers: told where data reach toward grazing, and owned to be unknown where they do not."""

import numpy as np
import pytest

from photogonio.reconstruct.estimate.lobe_search import search_lobes, starting_shape
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.model_selection import Candidate, Prior
from photogonio.reconstruct.lobes.families import families, lobe_columns
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.budget import uncertainty_of
from photogonio.reconstruct.uncertainty.lobe_weight import cover_slopes

COAT = next(f for f in families(absolute=True) if f.name == "correlated-dielectric")
ROUGHNESS, F0 = 0.25, 0.043
PRIOR = Prior(0.01, 1.0)
NOISE = 0.003


def seen(steepest: float, share: float, seed: int = 0) -> tuple[Cells, np.ndarray]:
    """A coat over ``share`` of a matte surface, where facets are lit at no more than ``steepest`` degrees."""
    rng = np.random.default_rng(seed)
    n = 12_000
    angles = np.array(
        [*np.arccos(rng.uniform(np.cos(np.radians(75.0)), 1.0, (2, n))), rng.uniform(0.0, np.pi, n)]
    )
    i, r, d = angles
    phase = np.arccos(np.cos(i) * np.cos(r) + np.sin(i) * np.sin(r) * np.cos(d))
    i, r, d = angles[:, phase < 2.0 * np.radians(steepest)][:, :4000]
    truth = surface(i, r, d, share)
    value = truth * (1.0 + NOISE * rng.normal(size=truth.shape))
    return Cells.of_angles(i, r, d).with_value(value), NOISE * truth


def surface(i: np.ndarray, r: np.ndarray, d: np.ndarray, share: float) -> np.ndarray:
    fixed, ground = lobe_columns(COAT, np.array([ROUGHNESS, F0]), i, r, d)
    return share * fixed[:, None] + 0.3 * ground * [1.0, 0.5]


def error_near_grazing(steepest: float, share: float) -> tuple[float, float]:
    """Departure of f from the truth in the mirror direction at 65 degrees, and its standard error, relative."""
    cells, deviation = seen(steepest, share)
    start = LobeSet((COAT,), (starting_shape(COAT, 0.25),))
    fit = search_lobes(cells, deviation, Basis("isotropic", 0), PRIOR, start)
    believed = [(Candidate(0, PRIOR, fit.model.lobes, np.zeros(1)), 1.0)]
    spread = uncertainty_of(fit, cells, deviation, believed)
    angle = np.radians([65.0])
    there = Cells.of_angles(angle, angle, np.array([np.pi]))
    true = surface(angle, angle, np.array([np.pi]), share)
    said = fit.model.evaluate(there)
    return (
        float(np.abs(said / true - 1.0).max()),
        float((spread.standard_error(fit.model, there) / true).max()),
    )


def test_half_a_coat_seen_from_above_is_wrong_near_grazing_and_says_so():
    off, error = error_near_grazing(40.0, 0.5)
    assert off > 0.2  # taken as a whole coat of lower index, which rises more
    assert off < 3.0 * error


@pytest.mark.parametrize("steepest", [75.0])
def test_a_whole_coat_that_was_seen_near_grazing_is_known(steepest):
    off, error = error_near_grazing(steepest, 1.0)
    assert off < 3.0 * error
    assert error < 0.02


def test_only_lobes_of_weight_one_may_cover_less():
    cells, _ = seen(75.0, 1.0)
    few = cells.take(np.arange(10))
    free = next(f for f in families(absolute=False) if f.name == "correlated-dielectric")
    for family, count in ((COAT, 1), (free, 0)):
        own = np.full((len(family.coefficient_names), 2), 0.1)
        model = Model(
            Basis("isotropic", 0), np.zeros((1, 2)), LobeSet((family,), (starting_shape(family, 0.2),)), own
        )
        assert cover_slopes(model, few).shape == (10, count, 2)


def test_an_index_that_no_bulk_has_is_doubted_more():
    few = seen(40.0, 1.0)[0].take(np.arange(10))
    own = np.full((1, 2), 0.1)

    def doubt(f0: float) -> np.ndarray:
        lobes = LobeSet((COAT,), (np.array([ROUGHNESS, f0]),))
        model = Model(Basis("isotropic", 0), np.zeros((1, 2)), lobes, own)
        return cover_slopes(model, few)[:, 0] / lobes.columns(few)[0][:, None]

    assert (doubt(0.02) > 2.0 * doubt(F0)).all() and (doubt(0.1) > 2.0 * doubt(F0)).all()
    np.testing.assert_array_less(doubt(0.02), 0.5)


def test_doubt_has_no_step_where_metals_begin():
    """A metal of base reflectance 0.49 is no more a part of one than that of 0.51."""
    few = seen(40.0, 1.0)[0].take(np.arange(10))
    metal = families(absolute=True)[0]
    lobes = LobeSet((metal,), (np.array([ROUGHNESS]),))

    def doubt(f0: float) -> np.ndarray:
        model = Model(Basis("isotropic", 0), np.zeros((1, 2)), lobes, np.full((1, 2), f0))
        return cover_slopes(model, few)[:, 0] / model.evaluate(few)

    np.testing.assert_allclose(doubt(0.49), doubt(0.51), rtol=0.01)
    assert (doubt(0.15) > 2.0 * doubt(0.51)).all()  # neither a gloss nor a metal
