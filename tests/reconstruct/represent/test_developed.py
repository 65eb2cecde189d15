"""A BRDF as modes and lobes of the first version, or as modes alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.errors import Uncertain
from photogonio.reconstruct.brdf.parameters import mode_names
from photogonio.reconstruct.represent.developed import developed
from tests.drawn.exports import coated, rms_between, satin


def test_what_the_first_version_knows_stays_as_it_is():
    found = developed(satin())
    assert (found.loss == 0.0).all() and found.brdf.version == 1
    np.testing.assert_array_equal(found.brdf.coefficients, satin().coefficients)
    assert rms_between(found.brdf, satin()) == 0.0
    # of more modes the further ones are nothing, exactly
    wider = developed(satin(), 4).brdf
    assert wider.order == 4 and not wider.coefficients[len(satin().modes) :].any()


def test_modes_alone_have_no_lobe_and_lose_what_is_said():
    matte = satin(("Y",))
    found = developed(matte, 12, alone=True)
    assert found.brdf.lobes == () and len(found.loss) == 1
    assert rms_between(found.brdf, matte) == pytest.approx(found.loss[0], rel=0.1)


@pytest.mark.parametrize(("order", "said"), [(1, "expected 2"), (65, "to 64")])
def test_orders_that_do_not_do_are_refused(order, said):
    with pytest.raises(InputError, match=f"--order {order}: .*{said}"):
        developed(satin(), order)


def test_lobes_beside_modes_that_hold_a_cosine_are_refused():
    with pytest.raises(InputError, match="brdf_cos"):
        developed(replace(coated(), quantity="brdf_cos"), 4)


def test_errors_of_developed_modes_are_those_of_what_they_stand_for():
    """Modes that stand for a coat are linear in its weight and its ground: an error of the same share of both is that
    share of what the coat puts into each mode; and the own mode keeps its error."""
    brdf, share = coated(), 0.03
    (coat,) = brdf.lobes
    names = (*mode_names("isotropic", brdf.modes), "lobe 0 weight", "lobe 0 ground")
    size = np.array([0.0, coat.weight[0], coat.ground[0]])
    covariance = share**2 * np.outer(size, size)[None]
    covariance[0, 0, 0] = 0.01**2
    errors = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).T
    known = replace(brdf, uncertainty=Uncertain(names, errors, covariance))
    found = developed(known, 4, alone=True).brdf
    from_coat = found.coefficients.copy()
    from_coat[0] -= brdf.coefficients[0]
    expected = np.hypot(share * np.abs(from_coat), 0.01 * (np.arange(len(from_coat)) == 0)[:, None])
    np.testing.assert_allclose(found.standard_errors, expected, rtol=1e-3, atol=1e-6)
