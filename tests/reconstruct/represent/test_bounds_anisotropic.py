"""Files that are not isotropic, held to physics at every azimuth."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf, Lobe
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.fit import FitOptions, fit_table
from photogonio.reconstruct.modes.transform import pair_coefficients, pair_matrix
from photogonio.reconstruct.represent.bounds import HIGHEST, enforced
from photogonio.reconstruct.represent.bounds_anisotropic import TOLERANCE, enforced_turning, violated_turning
from photogonio.reconstruct.table.cells import Cells
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.tables import Plan, simulate

LOBE = Lobe(0.3, np.array([0.05]), np.array([1.0]))


def brdf_of(symmetry, coefficients, order=2, scale="absolute", lobes=()):
    """Of one channel with the first coefficients given."""
    modes = Basis(symmetry, order).modes
    full = np.zeros((len(modes), 1))
    full[: len(coefficients), 0] = coefficients
    return Brdf(order, ("Y",), modes, full, np.zeros_like(full), symmetry=symmetry, scale=scale, lobes=lobes)


def wild(symmetry, order=4, seed=0, lobes=()):
    """Negative in many places and brighter than the light elsewhere."""
    basis = Basis(symmetry, order)
    size = 1.0 / (1.0 + basis.degree()) / np.sqrt(len(basis.modes))
    coefficients = 8.0 * size * np.random.default_rng(seed).normal(size=len(size))
    coefficients[0] = 1.4
    return brdf_of(symmetry, coefficients, order, lobes=lobes)


def identity(brdf):
    return np.eye(len(brdf.modes))[None]


def moved(brdf, found):
    return replace(brdf, coefficients=found.coefficients)


def anywhere(n=200_000, seed=7):
    """Pairs at random: finer than any grid of the solve, and on none."""
    rng = np.random.default_rng(seed)
    theta, phi = rng.uniform(0.0, HIGHEST, (2, n)), rng.uniform(-np.pi, np.pi, (2, n))
    return Cells.of_directions(theta[0], phi[0], theta[1], phi[1])


def at(brdf, cells):
    return brdf.evaluate(cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r)[:, 0]


def breach(brdf):
    """Of f below 0, over its mean size, and of albedos above 1."""
    cells = anywhere()
    value, weight = at(brdf, cells), np.sin(2.0 * cells.theta_i) * np.sin(2.0 * cells.theta_r)
    mean = np.average(np.abs(value), weights=weight)
    few = cells.take(np.arange(600 if brdf.lobes else 4000))  # of a lobe by quadrature
    return -value.min() / mean, (brdf.directional_albedo(few.theta_i, few.phi_i) - 1.0).max()


@pytest.mark.parametrize(
    ("symmetry", "lobes"),
    [
        ("reciprocal", ()),
        ("general", (LOBE,)),
        pytest.param("reciprocal", (LOBE,), marks=pytest.mark.long),
        pytest.param("general", (), marks=pytest.mark.long),
    ],
)
def test_no_pair_of_directions_is_dark_below_0_and_none_sends_out_more_than_came_in(symmetry, lobes):
    brdf = wild(symmetry, lobes=lobes)
    assert min(breach(brdf)) > 30 * TOLERANCE
    found = enforced_turning(brdf, identity(brdf))
    assert max(breach(moved(brdf, found))) <= TOLERANCE
    assert found.active > 0 and found.albedo > 1.0
    assert found.least <= at(brdf, anywhere()).min()


@pytest.mark.parametrize("symmetry", ["reciprocal", "general"])
def test_a_physical_brdf_stays_to_the_last_bit(symmetry):
    brdf = brdf_of(symmetry, [1.5, 0.1, -0.1, 0.05], lobes=(LOBE,))
    found = enforced_turning(brdf, identity(brdf))
    assert found.coefficients.tobytes() == brdf.coefficients.tobytes()
    assert found.active == 0 and found.distance == 0.0


def test_the_same_input_gives_the_same_bytes():
    brdf = wild("reciprocal", 2)
    first, second = (enforced_turning(brdf, identity(brdf)).coefficients for _ in range(2))
    assert first.tobytes() == second.tobytes()


@pytest.mark.parametrize("symmetry", ["reciprocal", "general"])
def test_an_isotropic_surface_comes_out_as_by_the_isotropic_way(symmetry):
    """The isotropic way holds fewer pairs. Let its result be below 0 by as much as ``off`` beside them: lifted by that
    it is open to the other way also, whose distance is thus greater by no more than the lift; and of two points in a
    convex set, the nearest and one that is little farther, the squared distance is no more than the difference of
    the squares."""
    modes = Basis("isotropic", 2).modes
    plain = np.array([[0.5], [0.9], [0.0], [0.3], [-0.2]])
    flat = Brdf(2, ("Y",), modes, plain, 0 * plain, scale="relative")
    _, turned = pair_coefficients(symmetry, pair_matrix("isotropic", modes, plain))
    brdf = brdf_of(symmetry, turned[:, 0], scale="relative")
    by_isotropy = enforced(flat, np.eye(len(modes))[None])
    found = enforced_turning(brdf, identity(brdf))
    held = moved(flat, by_isotropy)
    cells = anywhere()
    value = held.evaluate(cells.theta_i, 0.0, cells.theta_r, cells.dphi)[:, 0]
    off = max(-value.min(), 0.0) + 2.0 * TOLERANCE * np.abs(value).mean()
    near = np.linalg.norm(by_isotropy.coefficients - plain)
    lift = off * 2.0 * np.pi  # the first mode is 1 / (2 pi)
    _, expected = pair_coefficients(symmetry, pair_matrix("isotropic", modes, by_isotropy.coefficients))
    apart = np.linalg.norm(found.coefficients - expected)
    assert apart <= np.sqrt(2.0 * near * lift + lift**2)
    assert apart < 0.25 * near  # the bound says something


def test_what_the_data_determine_stays_and_what_may_not_move_does_not():
    brdf = wild("reciprocal", 2)
    spread = np.diag(np.full(len(brdf.modes), 1.0))
    spread[0, 0] = 1e-8
    spread[-1, -1] = 0.0
    found = enforced_turning(brdf, spread[None])
    assert found.coefficients[0, 0] == pytest.approx(1.4, abs=1e-2)
    assert found.coefficients[-1, 0] == brdf.coefficients[-1, 0]
    assert max(breach(moved(brdf, found))) <= TOLERANCE


@pytest.mark.parametrize("symmetry", ["reciprocal", "general"])
def test_what_is_broken_by_more_than_its_error_and_not_by_less(symmetry):
    brdf = wild(symmetry, 2)
    depth = -at(brdf, anywhere()).min()

    def error(size):
        return lambda cells: np.full((len(cells), 1), size)

    dark = replace(brdf, scale="relative")
    assert violated_turning(dark, error(0.5 * depth))
    assert not violated_turning(dark, error(1.2 * depth))


def test_more_light_than_came_in_at_one_azimuth_is_found_on_an_absolute_scale_alone():
    """A general file that sends back 1.05 of what comes from one side, and 0.85 of what comes from the other."""
    modes = Basis("general", 1).modes
    aside = np.flatnonzero((modes == [1, 1, 0, 0]).all(1))[0]
    coefficients = np.zeros(len(modes))
    coefficients[0] = 0.95 * 2.0
    coefficients[aside] = 0.1
    brdf = brdf_of("general", coefficients, 1)
    over = brdf.directional_albedo(HIGHEST, np.linspace(0.0, 6.0, 50))
    assert over.max() > 1.02 and over.min() < 0.9

    def error(relative):
        return lambda cells: relative * np.abs(at(brdf, cells))[:, None]

    excess = float(over.max()) - 1.0
    assert violated_turning(brdf, error(0.5 * excess))
    assert not violated_turning(brdf, error(1.5 * excess))
    assert not violated_turning(replace(brdf, scale="relative"), error(0.0))
    found = enforced_turning(brdf, identity(brdf))
    assert breach(moved(brdf, found))[1] <= TOLERANCE


def test_what_modes_cannot_mend_is_said():
    brdf = brdf_of("reciprocal", [-0.1], 0)
    assert enforced_turning(brdf, np.zeros((1, 1, 1))) is None


def test_a_lobe_of_two_roughnesses_is_held_as_it_is():
    """Metal brighter along its grain than anything can be, and dark modes beside it."""
    metal = Lobe((0.45, 0.25), np.array([0.95]), np.array([1.6]), azimuth=0.4)
    brdf = brdf_of("reciprocal", [0.05, 0.3, -0.2, 0.1], lobes=(metal,))
    assert min(breach(brdf)) > 10 * TOLERANCE
    found = enforced_turning(brdf, identity(brdf))
    assert max(breach(moved(brdf, found))) <= TOLERANCE


def test_a_fit_of_brushed_metal_keeps_its_lobe_and_needs_no_bounds():
    plan = Plan(shape="plane", camera="moving", isotropic=False, views=10, pixels=300, level=2)
    surface = make_brdf("anisotropic-ggx", {"f0": (0.8,), "roughness_x": 0.45, "roughness_y": 0.25})
    asked = FitOptions(order=0, symmetry="reciprocal", lobes=1)
    fit = fit_table(simulate(surface, plan, seed=1), asked)
    assert fit.diagnostics["physics"] == {"held": False}
    (lobe,) = fit.brdf.lobes
    assert len(fit.brdf.modes) == 1 and lobe.model == "mirror"
    # what the fit itself says of its errors
    known = dict(zip(fit.brdf.uncertainty.parameters, fit.brdf.uncertainty.standard_errors, strict=True))
    assert abs(lobe.axes[0] - 0.45) < 4 * known["lobe 0 roughness along"][0]
    assert abs(lobe.axes[1] - 0.25) < 4 * known["lobe 0 roughness across"][0]
