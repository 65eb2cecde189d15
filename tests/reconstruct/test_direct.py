"""A table of facet pairs and a direct fit on the same pixels: they agree within the binning error that is reported."""

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.estimate import pilot as clean
from photogonio.reconstruct.fit import FitOptions, FitResult, fit_table
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.table.goniometer_csv import UNBINNED
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.tables import Plan, simulate

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
            patch.setattr(clean, "binning", lambda cells, model: np.zeros_like(cells.value))
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
    [("plastic", {}), ("satin-paint", {}), ("oren-nayar", {"albedo": [0.5]})],
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
