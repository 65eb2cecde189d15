"""What a cell's mean has beyond f at its mean directions."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated import Plan, simulate
from reconstruct.basis import Basis
from reconstruct.binning import binning
from reconstruct.cells import Cells, cells_of
from reconstruct.microfacet import CORRELATED_SCHLICK, families
from reconstruct.model import LobeSet, Model
from synthetic.brdf import make_brdf

CLEAR = {"views": 10, "pixels": 6000, "spoiled": 0.0, "view_error": 0.0, "electrons": 1e9}


def metal(roughness=0.3):
    """The fit's own form of the metal that is simulated."""
    f0 = np.array([[0.9, 0.8, 0.6]])
    return Model(
        Basis("isotropic", 0), np.zeros((1, 3)), LobeSet((CORRELATED_SCHLICK,), (np.array([roughness]),)), f0
    )


def brushed(along_x, along_y):
    """The same of :class:`synthetic.glossy.AnisotropicConductor`."""
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
