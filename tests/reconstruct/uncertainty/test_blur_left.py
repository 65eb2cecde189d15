"""How unsure a roughness is by wide cells: peaks averaged over turns and freed of it to second order."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from photogonio.reconstruct.estimate.binning_error import binning, blur
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.lobes.families import blinn_phong_lobe, retro_lobe
from photogonio.reconstruct.modes.angles import pair_angles
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.blur_left import blur_left, half_angles, with_blur_left
from photogonio.reconstruct.uncertainty.budget import Uncertainty

PEAK = 0.1
BASIS = Basis("isotropic", 0)


def peak_of(roughness: float, family=None) -> Model:
    lobes = LobeSet((family or blinn_phong_lobe(absolute=True),), (np.array([roughness]),))
    return Model(BASIS, np.zeros((1, 1)), lobes, np.full((1, 1), 0.05))


def turned(x: np.ndarray, y: np.ndarray) -> Cells:
    """Light and look 40 degrees apart about a half vector of slopes ``x`` and ``y``."""
    half = np.stack([x, y, np.ones_like(x)], axis=-1) / np.sqrt(1 + x**2 + y**2)[:, None]
    aside = np.stack([np.zeros_like(x), half[:, 2], -half[:, 1]], axis=-1)
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    c, s = np.cos(np.radians(20)), np.sin(np.radians(20))
    theta_i, theta_r, dphi = pair_angles(c * half + s * aside, c * half - s * aside)
    return Cells.of_angles(theta_i, theta_r, np.abs(dphi))


def seen(spread: float) -> Cells:
    """A peak over cells whose turns have the standard deviation ``spread``, exactly."""
    x, y = (0.6 * PEAK + np.array([0, 0.6, 1.2, 1.8, 3]) * PEAK), np.zeros(5)
    node, weight = np.polynomial.hermite_e.hermegauss(15)
    weight = weight / weight.sum()
    mean = sum(
        wa * wb * peak_of(PEAK).evaluate(turned(x + spread * a, y + spread * b))
        for a, wa in zip(node, weight, strict=True)
        for b, wb in zip(node, weight, strict=True)
    )
    return replace(turned(x, y), turn=np.full((5, 2), spread**2)).with_value(mean)


def found(cells: Cells) -> float:
    """The roughness of which the cells are, freed of their width by its own model; its weight is free."""

    def missed(roughness: float) -> float:
        model = peak_of(roughness)
        added = blur(cells, model) if cells.peaked else binning(cells, model)
        said = (model.evaluate(cells) + added)[:, 0]
        value = cells.value[:, 0]
        return float(np.sum((value - said * (said @ value) / (said @ said)) ** 2))

    return minimize_scalar(
        missed, bounds=(0.5 * PEAK, 1.5 * PEAK), method="bounded", options={"xatol": 1e-7}
    ).x


@pytest.mark.parametrize("spread", [0.1, 0.2, 0.3, 0.45])
def test_what_the_second_order_leaves_lies_within_the_interval(spread):
    """Of the cells' standard deviation over the roughness: twice the error holds what is off."""
    cells = seen(spread * PEAK)
    error = blur_left(peak_of(PEAK), cells)[0]
    assert error == pytest.approx(2 * spread**4, rel=1e-9)
    assert abs(np.log(found(cells) / PEAK)) < 2 * error + 2e-4


@pytest.mark.parametrize("spread", [0.2, 0.3, 0.45, 0.6])
def test_what_the_fifth_order_leaves_of_a_narrow_peak_lies_within_the_interval(spread):
    cells = replace(seen(spread * PEAK), peaked=True, binned=True)
    error = blur_left(peak_of(PEAK), cells)[0]
    assert error < blur_left(peak_of(PEAK), replace(cells, peaked=False))[0]
    assert abs(np.log(found(cells) / PEAK)) < 2 * error + 2e-4


def test_it_is_in_the_covariance_of_roughnesses_alone():
    cells = seen(0.3 * PEAK)
    spread = Uncertainty(BASIS, np.zeros((1, 3, 3)), 1, 10.0)
    covariance = with_blur_left(spread, peak_of(PEAK), cells).covariance[0]
    np.testing.assert_allclose(covariance, np.diag([0, 0, blur_left(peak_of(PEAK), cells)[0] ** 2]))
    assert blur_left(peak_of(PEAK, retro_lobe(absolute=True)), cells) == 0.0  # light and look turn together
    assert blur_left(peak_of(PEAK), replace(cells, turn=None)) == 0.0
    assert not len(blur_left(Model(BASIS, np.zeros((1, 1)), LobeSet(), np.empty((0, 1))), cells))


def test_the_half_vectors_angle():
    np.testing.assert_allclose(np.tan(half_angles(turned(np.array([0.1, 0.3]), np.zeros(2)))), [0.1, 0.3])
