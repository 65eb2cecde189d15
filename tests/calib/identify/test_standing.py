"""Which photos show the sample, and what stands beside it."""

import numpy as np

from photogonio.calib.identify.covered import Cover
from photogonio.calib.identify.standing import showing, things

SHAPE, STEP = (70, 90), 2.0
SAMPLE, PATCH = (slice(20, 45), slice(30, 60)), (slice(5, 15), slice(70, 85))


def cover(*parts, unknown=()):
    hidden = np.zeros(SHAPE)
    for part in parts:
        hidden[part] = 1.0
    for part in unknown:
        hidden[part] = 0.5
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    points = STEP * (np.column_stack([x.ravel(), y.ravel()]) + 0.5)
    none = np.zeros(hidden.size, bool)
    return Cover(
        points, SHAPE, STEP, hidden.ravel(), none, np.array([90.0, -200.0, 400.0]), np.ones(hidden.size)
    )


def test_photos_of_the_board_with_a_patch_on_it_show_no_sample():
    photos = [cover(PATCH)] * 6 + [cover(SAMPLE, PATCH)] * 2
    shaded = cover(PATCH, (slice(40, 45), slice(30, 60)), unknown=[(slice(20, 40), slice(30, 60))])
    assert showing([*photos, shaded]) == [False] * 6 + [True] * 3


def test_a_bare_board_shows_nothing():
    assert showing([cover(), cover()]) == [False, False]
    assert showing([]) == []


def test_what_stands_beside_the_sample_is_where_it_is():
    (one,) = things([cover(SAMPLE, PATCH)] * 3)
    np.testing.assert_allclose(one.corners.mean(axis=0), [155.0, 20.0], atol=STEP / 2)
    np.testing.assert_allclose(np.ptp(one.corners, axis=0), [30.0, 20.0], atol=STEP)
