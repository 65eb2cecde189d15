"""Where a fit may be trusted: what was seen, there or at the twin, and how far it reaches."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.validity import (
    DETERMINED,
    EXTRAPOLATED,
    NEAR,
    SEEN,
    STEP,
    TRUSTED,
    Region,
    region_of,
    seen_at,
)
from tests.drawn.fits import model_of


def at(theta_i, theta_r, dphi) -> Cells:
    return Cells.of_angles(
        *(np.radians(np.atleast_1d(np.asarray(a, float))) for a in (theta_i, theta_r, dphi))
    )


def test_data_are_seen_near_and_at_the_reciprocal_twin_and_nowhere_else():
    data, near = at(20.0, 60.0, 90.0), float(np.degrees(NEAR))
    assert seen_at(data, at(20.0 + 0.9 * near, 60.0, 90.0)).all()
    assert seen_at(data, at(60.0, 20.0, 90.0)).all()
    assert not seen_at(data, at(20.0 + 1.1 * near, 60.0, 90.0)).any()
    assert not seen_at(data, at(60.0, 20.0, 130.0)).any()
    assert not seen_at(data, at(20.0, 60.0, 0.0)).any()


def region(seen, relative) -> Region:
    theta = np.radians(np.arange(0.5 * STEP, 90.0, STEP))
    dphi = np.radians([45.0, 135.0])
    shape = (len(theta), len(theta), 2)
    return Region(theta, dphi, np.broadcast_to(seen, shape), np.broadcast_to(relative, shape))


def test_states_are_of_what_is_seen_and_known():
    seen = np.array([True, False])
    known = region(seen, np.array([0.5 * TRUSTED, 0.5 * TRUSTED])).state
    assert (known[..., 0] == DETERMINED).all() and (known[..., 1] == EXTRAPOLATED).all()
    assert (region(seen, 2.0 * TRUSTED).state[..., 0] == SEEN).all()


def test_the_largest_angle_is_where_data_end_or_errors_begin():
    theta = region(True, 0.0).theta
    low = theta < np.radians(60.0)
    both = (low[:, None] & low)[..., None]
    assert region(True, 0.0).valid() == {"theta_i_max": 90.0, "theta_r_max": 90.0}
    assert region(both, 0.0).valid()["theta_i_max"] == 60.0
    assert region(False, 0.0).valid()["theta_i_max"] == 0.0
    assert region(True, 2.0 * TRUSTED).valid()["theta_r_max"] == 0.0


def test_errors_are_averaged_by_the_light_that_goes_there():
    """Of light on a surface within L degrees the share 1 - sin^2 60 / sin^2 L comes beyond 60: a tenth at 65.9."""
    beyond = region(True, 0.0).theta > np.radians(60.0)
    for wrong in (beyond[:, None, None], beyond[None, :, None]):
        assert region(True, 1.0 * wrong).valid()["theta_i_max"] == 65.0


def test_the_map_of_a_model_is_of_its_own_error_and_data():
    model = model_of(order=0)
    data = at(30.0, 30.0, 90.0).with_value(np.full((1, 2), 0.2))
    found = region_of(lambda where, said: 0.05 * said, model, data)
    np.testing.assert_allclose(found.relative_error, 0.05, rtol=1e-12)
    i, r, d = np.nonzero(found.seen)
    assert len(i) > 0
    assert np.degrees(np.abs(found.theta[np.concatenate([i, r])] - np.radians(30.0))).max() <= np.degrees(
        NEAR
    )
    assert (np.abs(found.dphi[d] - 0.5 * np.pi) * np.sin(np.radians(30.0)) <= 1.1 * NEAR).all()
