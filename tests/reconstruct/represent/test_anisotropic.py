"""A BRDF that turns with the sample in the terms of the file's first version."""

import numpy as np
import pytest

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.lobes.families import families
from photogonio.reconstruct.represent.anisotropic import typical
from photogonio.reconstruct.represent.developed import developed
from photogonio.reconstruct.table.cells import Cells
from tests.drawn.fits import as_found

JUDGED = np.radians(70.0)


def model_of(symmetry="reciprocal", name="anisotropic correlated-schlick", order=2, seed=0):
    rng = np.random.default_rng(seed)
    basis = Basis(symmetry, order)
    coefficients = 0.02 * rng.normal(size=(len(basis.modes), 2))
    coefficients[0] = 1.0, 0.5
    found = [f for turning in (False, True) for f in families(absolute=True, turning=turning)]
    family = next(f for f in found if f.name == name)
    shape = {"roughness": 0.35, "f0": 0.05, "stretch": 1.2, "skew": 1.1}
    lobes = LobeSet((family,), (np.array([shape[n] for n in family.shape_names]),))
    return Model(basis, coefficients, lobes, np.full((len(family.coefficient_names), 2), 0.3))


def in_file(model, order):
    """In the first version's terms, and the stated error, 1/sr."""
    brdf = as_found(model)
    found = developed(brdf, order)
    return found.brdf, found.loss * typical(brdf)


def directions(n=6000, seed=1):
    """Pairs below the limit by cosine weight, and their azimuths."""
    rng = np.random.default_rng(seed)
    theta = np.arcsin(np.sin(JUDGED) * np.sqrt(rng.uniform(size=(2, n))))
    phi = rng.uniform(-np.pi, np.pi, (2, n))
    return Cells.of_directions(theta[0], phi[0], theta[1], phi[1])


def miss(model, said):
    cells = directions()
    found = said.evaluate(cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r)
    return np.sqrt(np.mean((found - model.evaluate(cells)) ** 2, axis=0))


@pytest.mark.parametrize("symmetry", ["reciprocal", "general"])
def test_the_files_own_lobe_and_the_modes_are_said_exactly(symmetry):
    model = model_of(symmetry, "correlated-schlick")
    said, error = in_file(model, 3)
    assert (error == 0.0).all()
    assert miss(model, said).max() <= 1e-12


@pytest.mark.parametrize(
    "name",
    [
        "anisotropic correlated-schlick",
        pytest.param("anisotropic separable-dielectric", marks=pytest.mark.long),
    ],
)
def test_the_stated_error_is_true_and_falls_with_the_order(name):
    model = model_of(name=name)
    stated = []
    for order in (2, 4, 8):
        said, error = in_file(model, order)
        # 6000 random pairs see the rms within some per cent, and it is taken on a rule of finite nodes
        np.testing.assert_allclose(miss(model, said), error, rtol=0.15)
        stated.append(error.max())
    assert stated[2] < 0.5 * stated[0]
    assert stated[2] < 0.02 * typical(as_found(model)).max()
