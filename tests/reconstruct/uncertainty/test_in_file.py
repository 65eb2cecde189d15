"""What the file says of a fit: no more digits than mean something, and errors that are the fit's."""

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.model_discrepancy import Misfit
from photogonio.reconstruct.lobes.families import families
from photogonio.reconstruct.represent.as_found import lobes_of
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.budget import Uncertainty
from photogonio.reconstruct.uncertainty.in_file import UNTOLD, in_file

COAT = next(one for one in families(absolute=True) if one.has_ground)
PLACES = np.zeros((1, 4))


def told(relative, *, scale=0.0, freedom=1e9, turning=False):
    """A mode and a lobe whose coefficients are known to ``relative`` of themselves, as the file has them."""
    family = families(absolute=True, turning=True)[0] if turning else COAT
    shape = np.array([0.31, 1.3, 1.1] if turning else [1.0 / 3.0, 0.043])
    own = np.array([[0.3, 0.2, 0.1]]) * (1.0 + 1e-13 * np.pi)
    basis = Basis("reciprocal" if turning else "isotropic", 0)
    model = Model(basis, np.array([[0.2, 0.1, 0.3]]) / 3.0, LobeSet((family,), (shape,)), own)
    size = np.concatenate([model.coefficients, own, np.ones((len(shape) + 1, 3))])
    covariance = np.stack([np.diag((relative * column) ** 2) for column in size.T])
    spread = Uncertainty(basis, covariance, 1, freedom, scale)
    plain = Brdf(
        0,
        ("R", "G", "B"),
        basis.modes,
        model.coefficients,
        0.0 * model.coefficients,
        symmetry=basis.symmetry,
        lobes=lobes_of(model),
    )
    misfit = Misfit(PLACES, np.zeros((1, 3)), np.full(3, 1e-6))
    return in_file(plain, model, spread, misfit, 1.6), plain, model, spread


def pairs():
    theta_i, theta_r, turn, dphi = np.random.default_rng(3).uniform(
        0.0, [[1.3], [1.3], [6.0], [3.1]], (4, 300)
    )
    return Cells.of_directions(theta_i, turn, theta_r, turn + dphi)


def digits(number):
    return len(repr(float(number)).replace(".", "").strip("0"))


@pytest.mark.parametrize("turning", [False, True])
@pytest.mark.parametrize("relative", [1e-2, 1e-4])
def test_digits_that_are_left_out_are_far_below_the_error(relative, turning):
    brdf, plain, model, spread = told(relative, turning=turning)
    cells = pairs()
    angles = cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r
    off = brdf.evaluate(*angles) - plain.evaluate(*angles)
    assert (np.abs(off) <= 2.0 * UNTOLD * spread.standard_error(model, cells)).all()


def test_less_sure_numbers_are_shorter_and_none_is_a_float_of_numpy():
    short, long = (told(relative)[0] for relative in (3e-2, 1e-6))
    assert digits(short.coefficients[0, 0]) < digits(long.coefficients[0, 0])
    assert digits(short.lobes[0].axes[0]) <= 6 < digits(long.lobes[0].axes[0])
    turned = told(1e-2, turning=True)[0].lobes[0]
    assert all(type(number) is float for number in (*turned.roughness, turned.azimuth))
    assert "np." not in repr(turned.roughness)


def test_a_scale_is_not_widened_for_the_views_being_few():
    """5 degrees of freedom widen what views tell by 2.57 / 1.96, and what no view tells not at all."""
    for scale in (0.0, 0.02):
        brdf, _, model, _ = told(1e-3, scale=scale, freedom=5.0)
        alone, _, _, few = told(1e-3, freedom=5.0)
        assert brdf.uncertainty.scale == scale and brdf.uncertainty.unseen == alone.uncertainty.unseen
        cells = pairs()
        error = brdf.standard_error(cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r)
        widened = few.half_width(few.standard_error(model, cells)) / 1.959964
        expected = np.hypot(widened, scale * model.evaluate(cells))
        np.testing.assert_allclose(error, expected, rtol=0.02)
