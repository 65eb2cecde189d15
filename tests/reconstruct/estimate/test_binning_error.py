"""What a cell's mean has beyond f at its mean directions."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.estimate.binning_error import binning, lamp_size
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.lobes.families import CORRELATED_SCHLICK, families
from photogonio.reconstruct.modes.angles import pair_angles, unit_vectors
from photogonio.reconstruct.table.cells import Cells, cells_of
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
