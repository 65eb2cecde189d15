"""What a cell's mean has beyond f at its mean directions."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.estimate import pilot as clean
from photogonio.reconstruct.estimate.binning_error import binning, lamp_size
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.fit import FitOptions, FitResult, fit_table
from photogonio.reconstruct.lobes.families import CORRELATED_SCHLICK, families
from photogonio.reconstruct.modes.angles import pair_angles, unit_vectors
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.reconstruct.table.goniometer_csv import UNBINNED
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.tables import Plan, simulate

CLEAR = {"views": 10, "pixels": 6000, "spoiled": 0.0, "view_error": 0.0, "electrons": 1e9}


def metal(roughness=0.3):
    """The fit's own form of the metal that is simulated."""
    f0 = np.array([[0.9, 0.8, 0.6]])
    return Model(
        Basis("isotropic", 0), np.zeros((1, 3)), LobeSet((CORRELATED_SCHLICK,), (np.array([roughness]),)), f0
    )


def brushed(along_x, along_y):
    """The same of :class:`synthetic.brdf.glossy.AnisotropicConductor`."""
    family = families(absolute=True, turning=True)[0]
    shape = np.array([np.sqrt(along_x * along_y), np.sqrt(along_x / along_y), 1.0])
    return replace(metal(), lobes=LobeSet((family,), (shape,)))


@pytest.mark.parametrize(
    ("plan", "left"),
    [
        (Plan(level=3, **CLEAR), 0.7),
        (Plan(shape="plane", level=3, camera="moving", camera_distance=10.0, **CLEAR), 0.85),
        (Plan(shape="plane", level=3, camera="moving", camera_distance=10.0, isotropic=False, **CLEAR), 0.85),
    ],
    ids=["ball", "turned plane", "plane"],
)
def test_means_of_cells_are_explained(plan, left):
    """Cells are irregular, so their second moments are known in part; what is explained has the right sign and size."""
    cells = cells_of(simulate(make_brdf("ggx-conductor", {"roughness": 0.3}), plan))
    cells = cells.take((cells.count > 8) & (np.maximum(cells.theta_i, cells.theta_r) < 1.3))
    true = metal().evaluate(cells)
    excess = cells.value - true
    rest = excess - binning(cells, metal())
    assert np.sqrt(np.mean((rest / true) ** 2)) < left * np.sqrt(np.mean((excess / true) ** 2))


def test_means_of_cells_of_a_brushed_plane_are_explained():
    """Both directions turn together, in the frame of the sample: the azimuths of the cells matter."""
    truth = make_brdf("anisotropic-ggx", {"f0": (0.9, 0.8, 0.6), "roughness_x": 0.2, "roughness_y": 0.4})
    plan = Plan(shape="plane", level=3, camera="moving", camera_distance=10.0, isotropic=False, **CLEAR)
    cells = cells_of(simulate(truth, plan))
    cells = cells.take((cells.count > 8) & (np.maximum(cells.theta_i, cells.theta_r) < 1.3))
    model = brushed(0.2, 0.4)
    true = model.evaluate(cells)
    excess = cells.value - true
    rest = excess - binning(cells, model)
    assert np.sqrt(np.mean((rest / true) ** 2)) < 0.85 * np.sqrt(np.mean((excess / true) ** 2))


def test_a_mean_over_pairs_that_turn_together_keeps_the_angle_between_them():
    """A surface whose f is the angle between lamp and camera alone shows the same all over a cell."""
    cells = replace(Cells.of_angles(*np.array([[0.9, 0.7], [0.8, 1.1], [0.4, 0.2]])), canonical=True)
    cells = replace(cells, turn=np.array([[0.01, 0.02], [0.0, 0.02]])).with_phase(np.array([0.93, 0.9]))

    class Phased:
        turning, coefficients = False, np.zeros((1, 1))

        def evaluate(self, at):
            return np.sum(unit_vectors(at.theta_i, 0.0) * unit_vectors(at.theta_r, at.dphi), 1)[:, None]

    np.testing.assert_allclose(binning(cells, Phased()), 0.0, atol=1e-12)
    assert np.abs(binning(replace(cells, rigid=False), Phased())).max() > 1e-4


def test_a_uniform_surface_has_no_binning_error():
    cells = cells_of(simulate(make_brdf("lambert"), Plan(level=2, **CLEAR)))
    flat = Model(Basis("isotropic", 0), np.ones((1, 3)), LobeSet(), np.empty((0, 3)))
    np.testing.assert_allclose(binning(cells, flat), 0.0, atol=1e-14)


def test_measurements_of_their_own_have_none():
    rng = np.random.default_rng(0)
    cells = Cells.of_angles(*rng.uniform(0.0, 1.0, (2, 20)), rng.uniform(0.0, 3.0, 20))
    assert (binning(cells, metal()) == 0.0).all()


def seen_under_a_disk(cells, model, radius):
    """Mean over a lamp that fills a disk of angular ``radius``, weighted by the cosine: by quadrature, nodes of equal
    shares of the disk."""
    incident, exit = unit_vectors(cells.theta_i, 0.0), unit_vectors(cells.theta_r, cells.dphi)
    along = np.stack([incident[:, 2], np.zeros(len(cells)), -incident[:, 0]], axis=-1)
    total, weight = 0.0, 0.0
    for share in (np.arange(12) + 0.5) / 12:
        for turn in np.arange(24) * np.pi / 12:
            x, y = radius * np.sqrt(share) * np.array([np.cos(turn), np.sin(turn)])
            toward = incident + x * along + y * np.array([0.0, 1.0, 0.0])
            toward /= np.linalg.norm(toward, axis=1, keepdims=True)
            theta_i, theta_r, dphi = pair_angles(toward, exit)
            value = model.evaluate(Cells.of_angles(theta_i, theta_r, np.abs(dphi)))
            total, weight = total + toward[:, 2:] * value, weight + toward[:, 2:]
    return total / weight


@pytest.mark.parametrize("radius", [0.03, 0.06])
def test_a_lamp_of_some_size_blurs_a_gloss(radius):
    """What is left of it is of the next order: (radius / roughness)^2 of the whole, times a number near one."""
    rng = np.random.default_rng(1)
    cells = Cells.of_angles(*rng.uniform(0.0, 1.2, (2, 300)), rng.uniform(0.0, np.pi, 300))
    cells = replace(cells, lamp=np.full(300, radius**2 / 4))
    true, model = metal(0.2).evaluate(cells), metal(0.2)
    excess = seen_under_a_disk(cells, model, radius) - true
    rest = np.sqrt(np.mean(((excess - lamp_size(cells, model)) / true) ** 2))
    assert rest < (radius / 0.2) ** 2 * np.sqrt(np.mean((excess / true) ** 2))


def test_a_small_lamp_and_one_of_unknown_size_blur_nothing():
    cells = Cells.of_angles(*np.full((2, 3), 0.5), np.full(3, np.pi))
    assert (lamp_size(cells, metal()) == 0.0).all()
    assert (lamp_size(replace(cells, lamp=np.zeros(3)), metal()) == 0.0).all()


GLOSS = make_brdf("plastic", {"roughness": 0.2})
ONE_LOBE = FitOptions(order=0, lobes=1)  # what the gloss is: the fits differ by the binning alone
CLEAR = {"views": 12, "pixels": 3000, "spoiled": 0.0, "view_error": 0.0, "electrons": 1e8}
NOISY = {"views": 12, "pixels": 3000, "spoiled": 0.0, "view_error": 0.0}


def grid() -> tuple[np.ndarray, Cells]:
    """Pairs with both angles below 70 degrees, and their weights sin cos of both."""
    theta = np.radians(np.arange(2.5, 70.0, 5.0))
    where = Cells.of_angles(
        *(a.ravel() for a in np.meshgrid(theta, theta, np.radians(np.arange(0.0, 181.0, 10.0))))
    )
    return (np.sin(2.0 * where.theta_i) * np.sin(2.0 * where.theta_r))[:, None], where


def at(brdf: Brdf, where: Cells) -> np.ndarray:
    return brdf.evaluate(where.theta_i, where.phi_i, where.theta_r, where.phi_r)


def apart(one: FitResult, other: FitResult) -> np.ndarray:
    """Relative L2 (c,) of the difference below 70 degrees."""
    weight, where = grid()
    first, second = at(one.brdf, where), at(other.brdf, where)
    return np.sqrt((weight * (first - second) ** 2).sum(0) / (weight * second**2).sum(0))


def stated(one: FitResult) -> np.ndarray:
    """Relative L2 (c,) of the standard error of f below 70 degrees."""
    weight, where = grid()
    return np.sqrt(
        (weight * one.standard_error(where) ** 2).sum(0) / (weight * at(one.brdf, where) ** 2).sum(0)
    )


def reported(fit: FitResult) -> np.ndarray:
    return np.array(fit.diagnostics["binning error"])


@pytest.fixture(scope="module")
def direct() -> FitResult:
    return fit_table(simulate(GLOSS, Plan(level=UNBINNED, **CLEAR)), ONE_LOBE)


def test_single_pixels_have_no_binning_error_and_find_the_truth(direct):
    assert (reported(direct) == 0.0).all()
    # noise is 1e-4 a pixel; what is left is how the fit writes the ground under a gloss
    weight, where = grid()
    true = GLOSS(*(_unit(t, p) for t, p in ((where.theta_i, where.phi_i), (where.theta_r, where.phi_r))))
    found = direct.model.evaluate(where)  # before it is said in modes of order 0
    miss = np.sqrt((weight * (found - true) ** 2).sum(0) / (weight * true**2).sum(0))
    coarse = fit_table(simulate(GLOSS, Plan(level=1, **CLEAR)), ONE_LOBE)
    assert (miss < 0.2 * reported(coarse)).all()


def _unit(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    return np.column_stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


@pytest.mark.parametrize("level", [1, 2, 3])
def test_they_agree_within_the_binning_error_at_every_level(direct, level):
    table = fit_table(simulate(GLOSS, Plan(level=level, **CLEAR)), ONE_LOBE)
    assert (reported(table) > 0.0).all()
    assert (apart(table, direct) < reported(table)).all()


def test_the_binning_error_is_what_they_would_differ_by(direct, monkeypatch):
    """Uncorrected they do differ, by more than is reported at facets as coarse as the gloss, in every channel."""
    for level in (1, 2):
        seen = simulate(GLOSS, Plan(level=level, **CLEAR))
        corrected = fit_table(seen, ONE_LOBE)
        with monkeypatch.context() as patch:
            patch.setattr(clean, "blur", lambda cells, model: np.zeros_like(cells.value))
            plain = fit_table(seen, ONE_LOBE)
        assert (reported(plain) == 0.0).all()
        assert (apart(plain, direct) > reported(corrected)).all()
        assert (apart(corrected, direct) < 0.2 * apart(plain, direct)).all()


def test_the_binning_error_falls_as_the_square_of_the_facets_size():
    """A quarter each level, once facets (12.8 and 6.4 degrees) are smaller than the gloss (0.2 is 11 degrees)."""
    coarse, fine = (reported(fit_table(simulate(GLOSS, Plan(level=k, **CLEAR)), ONE_LOBE)) for k in (2, 3))
    np.testing.assert_allclose(fine / coarse, 0.25, atol=0.05)


@pytest.mark.parametrize(
    ("model", "options"),
    # of single pixels without a lobe orders to 24 are tried: in one channel that is a quarter of the work
    [
        ("plastic", {"albedo": [0.5]}),
        pytest.param("satin-paint", {}, marks=pytest.mark.long),
        pytest.param("oren-nayar", {"albedo": [0.5]}, marks=pytest.mark.long),
    ],
    ids=["plastic", "satin-paint", "oren-nayar"],
)
def test_with_noise_and_all_automatic_they_agree_within_that_and_their_own_errors(model, options):
    """Either chooses its model for itself; two standard errors of both, and the binning error."""
    truth = make_brdf(model, options)
    single = fit_table(simulate(truth, Plan(level=UNBINNED, **NOISY)))
    table = fit_table(simulate(truth, Plan(level=2, **NOISY)))
    assert (
        apart(table, single)
        < np.sqrt(reported(table) ** 2 + 4.0 * (stated(table) ** 2 + stated(single) ** 2))
    ).all()
