"""Shapes of lobes by variable projection."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.estimate.lobe_search import search_lobes, starting_shape
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.model_selection import Prior
from photogonio.reconstruct.estimate.variable_projection import SEEN, Profile
from photogonio.reconstruct.estimate.weights import independence
from photogonio.reconstruct.lobes.families import families, lobe_columns, retro_lobe
from photogonio.reconstruct.table.cells import Cells

PRIOR = Prior(0.1, 1.0)


def observed(family, shape, own, *, noise=0.003, n=3000, seed=0):
    """A Lambertian ground of 0.2 and a lobe, seen at random directions."""
    rng = np.random.default_rng(seed)
    top = np.cos(np.radians(75.0))
    angles = *np.arccos(rng.uniform(top, 1.0, (2, n))), rng.uniform(0.0, np.pi, n)
    cells = Cells.of_angles(*angles)
    fixed, columns = lobe_columns(family, shape, *angles)
    value = 0.2 + fixed[:, None] + columns @ own
    cells = cells.with_value(value * (1.0 + noise * rng.normal(size=value.shape)))
    return cells, noise * value


def start_of(family, roughness=0.25):
    return LobeSet((family,), (starting_shape(family, roughness),))


@pytest.mark.parametrize("family", families(absolute=True), ids=lambda f: f.name)
@pytest.mark.parametrize("roughness", [0.1, 0.3])
def test_the_shape_that_made_the_data_is_found_from_afar(family, roughness):
    shape = np.array([roughness, 0.06][: len(family.shape_names)])
    own = np.full((len(family.coefficient_names), 2), 0.06) * [1.0, 0.5]
    cells, deviation = observed(family, shape, own)
    fitted = search_lobes(cells, deviation, Basis("isotropic", 2), PRIOR, start_of(family))
    # 3000 values of 0.3 %: the search's own tolerance, 1e-3 of the logarithm, is what remains
    np.testing.assert_allclose(fitted.model.lobes.shapes[0], shape, rtol=5e-3)
    assert fitted.scale == pytest.approx(1.0, rel=0.05)


def test_outliers_do_not_move_the_shape():
    family = families(absolute=True)[2]
    cells, deviation = observed(family, np.array([0.2, 0.05]), np.array([[0.1, 0.2]]))
    rng = np.random.default_rng(1)
    spoiled = rng.uniform(size=len(cells)) < 0.03
    value = np.where(spoiled[:, None], 1.5 * cells.value, cells.value)
    cells = replace(cells, value=value, binned=True)  # of rows, neighbours are asked before
    fitted = search_lobes(cells, deviation, Basis("isotropic", 2), PRIOR, start_of(family))
    np.testing.assert_allclose(fitted.model.lobes.shapes[0], [0.2, 0.05], rtol=0.01)
    plain = np.median(fitted.weight[~spoiled])
    assert np.median(fitted.weight[spoiled]) < 0.01 * plain


def test_views_of_wrong_scale_hardly_move_the_model_when_their_errors_are_known():
    family = families(absolute=True)[0]
    own = np.array([[0.05, 0.1]])
    cells, deviation = observed(family, np.array([0.2]), own)
    view = np.arange(len(cells)) % 10
    scale = 1.0 + 0.05 * np.random.default_rng(3).normal(size=10)
    parts = {name: getattr(cells, name) for name in Cells.__slots__}
    parts |= {"group": view, "groups": tuple("abcdefghij"), "value": cells.value * scale[view, None]}
    seen = Cells(**parts)
    basis = Basis("isotropic", 2)
    told = search_lobes(seen, deviation, basis, PRIOR, start_of(family), view_errors=np.full(10, 0.05))
    # what remains within a view is noise; the views' shared part is their scale, about the mean scale
    assert told.scale == pytest.approx(1.0, rel=0.05)
    share = (told.shared / (seen.value - told.residual))[:10, 0]
    assert np.corrcoef(share, scale)[0, 1] > 0.999
    assert independence(seen).max() == 1.0  # measurements are not binned here


def test_a_peak_that_no_data_come_near_is_not_made_up():
    """Of a photo that looks 50 degrees past the mirror direction a narrow lobe could be anything: noise bought one
    of 14000 % error. What GGX has at its peak is at most (1 + SEEN^-2)^2 times what it has at the nearest data."""
    retro = retro_lobe(absolute=True)
    rng = np.random.default_rng(0)
    theta_i, theta_r = np.radians(rng.uniform(35.0, 45.0, (2, 500)))
    cells = Cells.of_angles(theta_i, theta_r, np.radians(rng.uniform(80.0, 100.0, 500)))
    value = np.full((500, 2), 0.2) * (1.0 + 0.01 * rng.normal(size=(500, 2)))
    cells = cells.with_value(value)
    fitted = search_lobes(cells, 0.01 * value, Basis("isotropic", 0), PRIOR, start_of(retro))
    lobes = fitted.model.lobes
    at_peak = lobes.columns(Cells.of_angles(*np.radians([[40.0], [40.0], [0.0]])))[1].max()
    # masking and the cosines change by less than half between the data and the peak
    assert at_peak < 1.5 * (1.0 + SEEN**-2) ** 2 * lobes.columns(cells)[1].max()


@pytest.mark.parametrize("retro", [False, True])
@pytest.mark.parametrize(("theta", "off"), [(20.0, 30.0), (70.0, 10.0), (75.0, 20.0)])
def test_the_narrowest_peak_that_may_be_is_the_same_at_any_incidence(retro, theta, off):
    """Seen by one cell, ``off`` degrees in azimuth beside it: GGX has there (1 + SEEN^-2)^-2 of its peak, over the
    fourth power of the cosine of the slope."""
    family = retro_lobe(absolute=True) if retro else families(absolute=False)[0]
    angle = np.radians([theta])
    cells = Cells.of_angles(angle, angle, np.radians([off if retro else 180.0 - off]))
    cells = cells.with_value(np.ones((1, 1)))
    profile = Profile(cells, np.ones((1, 1)), np.ones((1, 1)), np.zeros((1, 1)))
    least = np.exp(profile.bounds(start_of(family))[0, 0])
    peak = Cells.of_angles(angle, angle, np.array([0.0 if retro else np.pi]))
    lobes = LobeSet((family,), (np.array([least]),))
    ratio = lobes.columns(peak)[1][0, 0] / lobes.columns(cells)[1][0, 0]
    aside = np.sin(np.radians(0.5 * off))
    cosine2 = (
        1.0 - (np.sin(angle[0]) * aside) ** 2 if retro else 1.0 / (1.0 + (np.tan(angle[0]) * aside) ** 2)
    )
    assert ratio == pytest.approx((1.0 + SEEN**-2) ** 2 * cosine2**2, rel=1e-6)
