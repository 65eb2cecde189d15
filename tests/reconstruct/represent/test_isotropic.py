"""A BRDF in the terms of the file's first version, isotropic: modes and GGX lobes alone."""

import numpy as np
import pytest

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.lobes.families import families
from photogonio.reconstruct.modes.angles import pair_angles, unit_vectors
from photogonio.reconstruct.represent.anisotropic import typical
from photogonio.reconstruct.represent.developed import developed
from photogonio.reconstruct.table.cells import Cells
from tests.drawn.fits import as_found

JUDGED = np.radians(70.0)


def model_of(family, order=2, roughness=0.25, seed=0):
    rng = np.random.default_rng(seed)
    basis = Basis("isotropic", order)
    coefficients = 0.02 * rng.normal(size=(len(basis.modes), 2))
    coefficients[0] = 1.0, 0.5
    own = np.full((len(family.coefficient_names), 2), 0.05)
    return Model(
        basis,
        coefficients,
        LobeSet((family,), (np.array([roughness, 0.05][: len(family.shape_names)]),)),
        own,
    )


def represent(model, order):
    """In the first version's terms, and the stated error, 1/sr."""
    brdf = as_found(model)
    found = developed(brdf, order)
    return found.brdf, found.loss * typical(brdf)


def dense():
    """Another rule than the one inside: Gauss nodes in theta below the limit, midpoints in azimuth."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    theta, weights = JUDGED * (nodes + 1) / 2, weights * np.sin(JUDGED * (nodes + 1) / 2)
    dphi = np.pi * (np.arange(72) + 0.5) / 72
    i, r, d = (a.ravel() for a in np.meshgrid(theta, theta, dphi, indexing="ij"))
    wi, wr, _ = (a.ravel() for a in np.meshgrid(weights, weights, dphi, indexing="ij"))
    return Cells.of_angles(i, r, d), wi * wr * np.cos(i) * np.cos(r)


def miss(model, said):
    cells, weight = dense()
    found = said.evaluate(cells.theta_i, 0.0, cells.theta_r, cells.dphi)
    return np.sqrt(np.average((found - model.evaluate(cells)) ** 2, axis=0, weights=weight))


@pytest.mark.parametrize("absolute", [True, False])
def test_the_files_own_family_is_said_exactly(absolute):
    model = model_of(families(absolute=absolute)[0])
    said, error = represent(model, 3)
    assert (error == 0.0).all()
    cells, _ = dense()
    found = said.evaluate(cells.theta_i, 0.0, cells.theta_r, cells.dphi)
    np.testing.assert_allclose(found, model.evaluate(cells), rtol=1e-11)
    np.testing.assert_array_equal(said.coefficients[: len(model.coefficients)], model.coefficients)


@pytest.mark.parametrize("name", ["correlated-dielectric", "separable-dielectric", "separable-schlick"])
def test_the_stated_error_is_true_and_falls_with_the_order(name):
    family = next(f for f in families(absolute=True) if f.name == name)
    model = model_of(family)
    stated = []
    for order in (2, 8):
        said, error = represent(model, order)
        # the stated error is taken on fewer nodes, of which those below the limit are not a rule of their own
        np.testing.assert_allclose(miss(model, said), error, rtol=0.1)
        stated.append(error.max())
    assert stated[1] < stated[0]
    # Schlick's formula is off by a few per cent of the lobe, f about 0.3 here: without modes this were 0.01
    assert stated[1] < 2e-3


def about_the_peak(roughness, count=40_000, seed=3):
    """Random pairs below the limit, half of them about the mirror direction as a lobe sends them, and the weights
    cos_i cos_r over their density."""
    rng = np.random.default_rng(seed)
    incident = unit_vectors(np.arccos(rng.uniform(np.cos(JUDGED), 1.0, count)), 0.0)
    share = rng.uniform(size=count)
    theta_h = np.arctan(roughness * np.sqrt(share / (1.0 - share)))
    half = unit_vectors(theta_h, rng.uniform(0.0, 2 * np.pi, count))
    mirrored = 2.0 * np.sum(incident * half, axis=1, keepdims=True) * half - incident
    anywhere = unit_vectors(
        np.arccos(rng.uniform(np.cos(JUDGED), 1.0, count)), rng.uniform(0.0, 2 * np.pi, count)
    )
    exit = np.where(rng.uniform(size=(count, 1)) < 0.5, mirrored, anywhere)
    below = exit[:, 2] > np.cos(JUDGED)
    incident, exit = incident[below], exit[below]
    half = incident + exit
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    cos_h, cos_d = half[:, 2], np.sum(incident * half, axis=1)
    normals = roughness**2 / (np.pi * (cos_h**2 * (roughness**2 - 1.0) + 1.0) ** 2)
    density = 0.5 * normals * cos_h / (4.0 * cos_d) + 0.5 / (2.0 * np.pi * (1.0 - np.cos(JUDGED)))
    theta_i, theta_r, dphi = pair_angles(incident, exit)
    return Cells.of_angles(theta_i, theta_r, np.abs(dphi)), incident[:, 2] * exit[:, 2] / density


@pytest.mark.parametrize("roughness", [0.03, 0.07, 0.15])
def test_a_narrow_peak_is_said_as_well_as_schlicks_formula_can(roughness):
    """Of Fresnel's reflectance at n = 1.5, up to 80 degrees, the best constant and (1 - cos)^5 leave 9.8 % (weighed as
    a narrow lobe's square is, by tan theta); a peak between the nodes of a rule left 60 % of the narrowest lobe here,
    and the stated error did not know."""
    family = next(f for f in families(absolute=True) if f.name == "correlated-dielectric")
    shape = np.array([roughness, 0.04])
    model = Model(Basis("isotropic", 0), np.zeros((1, 1)), LobeSet((family,), (shape,)), np.full((1, 1), 0.3))
    said, error = represent(model, 8)
    cells, weight = about_the_peak(roughness)
    true = model.evaluate(cells)[:, 0]
    found = Basis("isotropic", 8).design(cells) @ said.coefficients
    found = found + sum(lobe.evaluate(cells.theta_i, cells.theta_r, cells.dphi) for lobe in said.lobes)
    # of the random pairs, the error of both sums is some 2 %
    rms = np.sqrt(np.sum(weight * (found[:, 0] - true) ** 2) / np.sum(weight))
    assert error[0] == pytest.approx(rms, rel=0.1)
    assert rms < 0.098 * np.sqrt(np.sum(weight * true**2) / np.sum(weight))


@pytest.mark.parametrize(("name", "most"), [("correlated-schlick", 0.01), ("correlated-dielectric", 0.015)])
def test_a_gloss_without_tails_is_said_by_lobes_with_tails_and_many_modes(name, most):
    """Relative to the lobe itself, rms cosine weighted; a lobe a little narrower and one a little wider alone leave
    0.025 of the coat, where the file's lobe at grazing is sharper than its modes."""
    family = next(f for f in families(absolute=True) if f.name == name).with_beckmann
    shape = np.array([0.2, 0.04][: len(family.shape_names)])
    own = np.full((1, 1), 0.0 if family.has_ground else 0.95)
    model = Model(Basis("isotropic", 0), np.zeros((1, 1)), LobeSet((family,), (shape,)), own)
    cells, weight = dense()
    size = np.sqrt(np.average(model.evaluate(cells)[:, 0] ** 2, weights=weight))
    said, _ = represent(model, 24)
    assert all((lobe.weight >= 0).all() for lobe in said.lobes)
    found = Basis("isotropic", 24).design(cells) @ said.coefficients
    found = found + sum(lobe.evaluate(cells.theta_i, cells.theta_r, cells.dphi) for lobe in said.lobes)
    assert np.sqrt(np.average((found - model.evaluate(cells))[:, 0] ** 2, weights=weight)) < most * size


def test_two_lobes_are_said_apart():
    first, second = model_of(families(absolute=True)[0]), model_of(families(absolute=False)[0], seed=1)
    both = Model(
        first.basis,
        first.coefficients,
        LobeSet(
            (first.lobes.families[0], second.lobes.families[0]), (np.array([0.1]), second.lobes.shapes[0])
        ),
        np.vstack([first.lobe_coefficients, second.lobe_coefficients]),
    )
    said, _ = represent(both, 2)
    assert len(said.lobes) == 2
    assert miss(both, said).max() < 1e-12
