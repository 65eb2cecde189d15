"""Pools of drawn numbers: what sets share is as sure as is said, what changes is seen, who contradicts is found."""

import numpy as np
import pytest

from photogonio.calib.rig.gaussian import RigTold
from photogonio.calib.rig.pooling import FEWEST, expected_of, pooled

BEFORE, USUAL = np.array([900.0, 0.0]), np.diag([1e-6, 1.0])
CHANGES = [np.array([[1000.0], [0.0]]), np.array([[0.0], [1.0]])]


def drawn(rng, sets, between=0.0, error=2.0):
    """Sets whose first value, near 1000, is told within ``error`` and changes by ``between``; the second is bare."""
    told = []
    for _ in range(sets):
        true = 1000.0 + between * rng.normal()
        slope = np.array([[1.0, 5.0]]) / error  # one direction alone is told
        found = np.array([true + error * rng.normal(), 0.0])
        told.append(RigTold("focal", found, slope.T @ slope, BEFORE, USUAL))
    return told


def whole(rng, sets, between, error=2.0):
    return [
        RigTold(
            "focal",
            np.array([1000.0 + np.hypot(between, error) * rng.normal(), 0.05 + 0.01 * rng.normal()]),
            np.diag([error**-2.0, 1e4]),
            BEFORE,
            USUAL,
        )
        for _ in range(sets)
    ]


def test_what_a_steady_rig_shares_is_as_sure_as_its_sets_together():
    rng, off, errors = np.random.default_rng(1), [], []
    for _ in range(12):
        told = whole(rng, 20, between=0.0)
        pool = pooled(told, CHANGES)
        off.append((pool.value[0] - 1000.0) / np.sqrt(pool.covariance[0, 0]))
        errors.append(np.sqrt(pool.covariance[0, 0]))
    # 2 / sqrt(20) = 0.45, and what 20 sets leave open of how steady the rig is
    assert 0.44 < np.median(errors) < 0.7
    assert 0.4 < np.sqrt(np.mean(np.square(off))) < 1.5  # chi of 12 has a scatter of 0.2


@pytest.mark.parametrize("between", [0.5, 6.0, 40.0])
def test_another_set_lies_within_what_is_expected(between):
    rng, z = np.random.default_rng(2), []
    for _ in range(16):
        told = whole(rng, 12, between)
        pool = pooled(told, CHANGES)
        expected = expected_of(told, CHANGES, pool, -1)
        z.append((1000.0 + between * rng.normal() - expected.value[0]) / np.sqrt(expected.covariance[0, 0]))
    assert np.sqrt(np.mean(np.square(z))) < 1.6  # 16 draws: 1 with a scatter of 0.18, three of them
    if between > 2.0:  # else the sets' own errors hide how steady the rig is
        assert np.sqrt(np.mean(np.square(z))) > 0.45


def test_errors_that_all_sets_have_in_common_do_not_shrink_with_their_number():
    rng, common = np.random.default_rng(9), 2.0
    told = [
        RigTold(
            o.name,
            np.array([1000.0 + common + 0.05 * rng.normal(), o.value[1]]),
            o.information,
            BEFORE,
            USUAL,
        )
        for o in whole(rng, 20, 0.0)
    ]
    pool = pooled(told, CHANGES)
    # each says 2: nearly all of it is common, for they scatter by 0.05
    assert 1.7 < np.sqrt(pool.covariance[0, 0]) < 2.3


def test_few_sets_are_not_believed_to_show_that_a_rig_is_steady():
    rng = np.random.default_rng(3)
    few, many = (pooled(whole(rng, count, 0.0), CHANGES) for count in (FEWEST, 40))
    assert few.between[0, 0] > 4.0 * many.between[0, 0]
    assert pooled(whole(rng, FEWEST - 1, 0.0), CHANGES) is None


def test_a_set_of_another_rig_is_found_and_does_not_sway_the_others():
    rng = np.random.default_rng(4)
    told = whole(rng, 15, between=1.0)
    plain = pooled(told, CHANGES)
    assert all(plain.used)
    for number, shift in ((3, 60.0), (11, -45.0)):
        one = told[number]
        told[number] = RigTold(
            one.name, one.value + np.array([shift, 0.0]), one.information, one.before, one.usual
        )
    found = pooled(told, CHANGES)
    assert [k for k, used in enumerate(found.used) if not used] == [3, 11]
    assert abs(found.value[0] - plain.value[0]) < 2.0 and found.between[0, 0] < 25.0


def test_sets_of_two_rigs_are_none():
    rng = np.random.default_rng(5)
    told = whole(rng, 4, 0.0) + [
        RigTold(o.name, o.value + np.array([0.0, 5.0]), o.information, o.before, o.usual)
        for o in whole(rng, 4, 0.0)
    ]
    pool = pooled(told, CHANGES)
    # either they are refused, or what is expected is so wide that it forces neither
    assert pool is None or pool.between[1, 1] > 0.25


def test_what_a_set_is_to_be_told_has_nothing_of_itself():
    told = whole(np.random.default_rng(6), 8, between=1.0)
    pool = pooled(told, CHANGES)
    without = expected_of(told, CHANGES, pool, 0)
    far = RigTold("focal", told[0].value + np.array([3.0, 0.0]), told[0].information, BEFORE, USUAL)
    again = expected_of([far, *told[1:]], CHANGES, pool, 0)
    assert np.allclose(without.value, again.value, rtol=1e-9) and without.sets == 7


def test_directions_that_no_set_tells_keep_what_is_usual():
    told = drawn(np.random.default_rng(7), 20)
    pool = pooled(told, CHANGES)
    assert np.isfinite(pool.value).all()
    # of the first value and five times the second only the sum is told: the second is as unsure as before
    assert np.sqrt(pool.covariance[1, 1]) == pytest.approx(1.0, rel=0.05)
