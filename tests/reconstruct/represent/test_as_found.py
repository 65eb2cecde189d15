"""A fit's lobes in the file's terms: the same f, and the same changes of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.brdf.parameters import slopes
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.lobes.families import TYPICAL_F0
from photogonio.reconstruct.represent.as_found import STEP, lobe_jacobian, lobe_of, lobe_parameters, lobes_of
from photogonio.reconstruct.table.cells import Cells
from tests.drawn.fits import as_found, kinds, model_of

KINDS = kinds()
BRUSHED_COATS = [family for family in KINDS if family.turning and family.has_ground]
OTHERS = [family for family in KINDS if family not in BRUSHED_COATS]


def cells(n: int = 40) -> Cells:
    rng = np.random.default_rng(3)
    theta, phi = rng.uniform(0.0, 1.3, (2, n)), rng.uniform(-np.pi, np.pi, (2, n))
    return Cells.of_directions(theta[0], phi[0], theta[1], phi[1])


def told(model: Model, where: Cells) -> np.ndarray:
    return as_found(model).evaluate(where.theta_i, where.phi_i, where.theta_r, where.phi_r)


@pytest.mark.parametrize("family", OTHERS, ids=lambda family: f"{family.name} {family.absolute}")
def test_the_file_says_the_fits_lobe(family):
    model = model_of(family)
    # coats look their albedo up in tables of other fineness: 3e-5 of the light, so of the ground
    np.testing.assert_allclose(told(model, cells()), model.evaluate(cells()), rtol=1e-9, atol=3e-5)


@pytest.mark.parametrize("family", BRUSHED_COATS[:2], ids=lambda family: family.name)
def test_a_brushed_coats_ground_sees_the_light_that_its_mean_roughness_lets_in(family):
    """The fit's approximation: what a coat sends back at an azimuth is that of its mean roughness within a hundredth
    of the light, on the way in and on the way out."""
    model = model_of(family)
    ground = model.lobe_coefficients[-1] / np.pi
    off = np.abs(told(model, cells()) - model.evaluate(cells()))
    assert (off < 0.02 * ground).all()


@pytest.mark.parametrize("family", OTHERS, ids=lambda family: f"{family.name} {family.absolute}")
def test_the_files_numbers_change_as_the_fits_do(family):
    """f by the fit's numbers is f by the file's times their derivatives: the chain rule."""
    model = model_of(family)
    where, names = cells(), lobe_parameters(model)
    angles = (where.theta_i, where.phi_i, where.theta_r, where.phi_r)
    brdf = replace(as_found(model), modes=model.basis.modes[:0], coefficients=model.coefficients[:0])
    by_file = slopes(replace(brdf, standard_errors=brdf.coefficients), angles, names)
    change = lobe_jacobian(model, [0.2] * family.absolute)
    said = np.einsum("npc,cpq->nqc", by_file, change)
    own = model.lobe_coefficients
    for q in range(len(own)):
        more = own.copy()
        more[q] += 1e-4
        exact = (replace(model, lobe_coefficients=more).evaluate(where) - model.evaluate(where)) / 1e-4
        # finite differences of both: the file's numbers are bent by some 1e-3 of themselves
        np.testing.assert_allclose(said[:, q], exact, rtol=5e-3, atol=1e-3 * np.abs(exact).max() + 1e-6)
    logs = model.lobes.flat()
    for s in range(len(logs)):
        step = np.zeros(len(logs))
        step[s] = STEP
        ends = [replace(model, lobes=model.lobes.with_flat(logs + side * step)) for side in (1.0, -1.0)]
        exact = (ends[0].evaluate(where) - ends[1].evaluate(where)) / (2.0 * STEP)
        off = np.abs(said[:, len(own) + s] - exact).max()
        assert off < 0.01 * np.abs(exact).max() + 1e-5


def test_the_numbers_of_several_lobes_change_with_their_own_alone():
    families = [*[family for family in OTHERS if family.absolute][:2], OTHERS[-1]]
    models = [model_of(family) for family in families]
    lobes = LobeSet(tuple(families), tuple(one.lobes.shapes[0] for one in models))
    own = np.concatenate([one.lobe_coefficients for one in models])
    covers = [0.2, 0.3][: sum(family.absolute for family in families)]
    every = lobe_jacobian(replace(models[0], lobes=lobes, lobe_coefficients=own), covers)
    blocks, left = [], list(covers)
    for family, one in zip(families, models, strict=True):
        blocks.append(lobe_jacobian(one, [left.pop(0)] if family.absolute else []))
    parts = [len(one.lobe_coefficients) for one in models]
    shapes = [len(one.lobes.shapes[0]) for one in models]
    at = np.split(np.arange(every.shape[2]), np.cumsum([*parts, *shapes]))
    first, rest = 0, every.copy()
    for k, block in enumerate(blocks):
        place = np.concatenate([at[k], at[len(parts) + k], at[-1][k : k + 1] if families[k].absolute else []])
        rows = np.arange(first, first + block.shape[1])
        np.testing.assert_allclose(every[:, rows][:, :, place.astype(int)], block, atol=1e-12)
        rest[np.ix_(np.arange(len(rest)), rows, place.astype(int))] = 0.0
        first += block.shape[1]
    assert (
        first
        == every.shape[1]
        == len(lobe_parameters(replace(models[0], lobes=lobes, lobe_coefficients=own)))
    )
    assert not rest.any()


def test_what_an_absolute_lobe_covers_is_its_weight():
    coat = next(family for family in KINDS if family.has_ground and family.absolute and not family.turning)
    model = model_of(coat)
    (derivative,) = lobe_jacobian(model, [0.2])[:1]
    names = lobe_parameters(model)
    # the weight is exp(0.2 x): its derivative at 0 is 0.2, and nothing else of the lobe changes
    expected = [0.2 if name == "lobe 0 weight" else 0.0 for name in names]
    np.testing.assert_allclose(derivative[:, -1], expected, atol=1e-6)
    (lobe,) = lobes_of(model)
    covered = lobe_of(coat, model.lobes.shapes[0], model.lobe_coefficients, 0.4)
    np.testing.assert_allclose(covered.weight, 0.4 * lobe.weight)


def test_a_base_reflectance_that_was_assumed_is_no_number_of_the_fit():
    free = next(
        family for family in KINDS if family.has_ground and not family.absolute and not family.turning
    )
    model = model_of(free)
    assert (lobes_of(model)[0].f0 == TYPICAL_F0).all()
    assert not any(name.endswith("f0") for name in lobe_parameters(model))
