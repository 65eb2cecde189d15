"""What counts as a right answer to a hard case, on outcomes made by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.errors import InputError
from photogonio.evaluate.hard_cases import HardResult, cells_at, judged, names_faulty, run_battery
from photogonio.evaluate.hard_tables import TABLE_CASES
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.report.diagnoses import ENTRIES
from photogonio.synthetic.scene.hard_cases import (
    ACCURATE,
    IN_INTERVAL,
    NAMED,
    TOLD,
    HardCase,
    hard_case,
    hard_names,
    satin,
)
from photogonio.synthetic.scene.parts import FaultScene
from photogonio.system.progress import Reporter

GOOD = HardResult(error=0.019, stated=0.02, error_70=0.012, valid=80.0)
WRONG = replace(GOOD, error=0.021)


def case(must: str, *telling: str, **fault: object) -> HardCase:
    return HardCase("case", satin(fault=fault), must, telling)


def passes(must: str, found: HardResult, *telling: str, plain: float = 0.01, **fault: object) -> bool:
    return judged(case(must, *telling, **fault), found, plain).passed


def test_an_error_must_lie_within_the_stated_interval():
    assert passes(IN_INTERVAL, GOOD)
    assert not passes(IN_INTERVAL, WRONG)


def test_a_small_error_that_is_stated_still_smaller_is_wrong():
    assert not passes(IN_INTERVAL, replace(GOOD, error=0.003, stated=0.002))


def test_what_cannot_be_compared_is_wrong():
    assert not passes(IN_INTERVAL, replace(GOOD, error=np.nan))
    assert not passes(IN_INTERVAL, replace(GOOD, stated=np.nan))


def test_a_refusal_is_right_but_where_the_set_is_good_enough():
    refused = HardResult(refused="sample/s000.png: no light")
    assert all(passes(must, refused) for must in (IN_INTERVAL, NAMED, TOLD))
    assert not passes(ACCURATE, refused)


def test_as_good_as_the_plain_set():
    assert passes(ACCURATE, GOOD, plain=0.01)
    assert not passes(ACCURATE, GOOD, plain=0.009)  # 0.012 is more than 1.25 of it
    assert not passes(ACCURATE, WRONG, plain=0.01)


def test_a_bad_photo_is_named_and_does_no_harm():
    told = (Diagnosis("photo-left-out", views=("sample/s005.png",)),)
    assert passes(NAMED, replace(GOOD, told=told), two_lamps=(5,))
    assert not passes(NAMED, replace(WRONG, told=told), two_lamps=(5,))
    assert not passes(NAMED, replace(GOOD, told=told), two_lamps=(4,))
    assert not passes(NAMED, GOOD, two_lamps=(5,))
    # of a photo that claims another's light it is the claimant that is wrong
    assert not passes(NAMED, replace(GOOD, told=told), mislabelled=((2, 5),))
    assert passes(NAMED, replace(GOOD, told=told), mislabelled=((5, 2),))


def test_every_bad_photo_must_be_named():
    fault = FaultScene(two_lamps=(1, 3))
    first, second = (Diagnosis("x", views=(f"sample/{name}.png",)) for name in ("s001", "s003"))
    assert names_faulty([first, second], fault)
    assert not names_faulty([first], fault)
    assert not names_faulty([first, second], FaultScene())


def test_a_fault_is_told_by_its_own_code():
    warned = replace(WRONG, told=(Diagnosis("tilted-alike"),))
    assert not passes(TOLD, warned, "patch-not-believed")
    assert passes(TOLD, replace(WRONG, told=(Diagnosis("patch-not-believed"),)), "patch-not-believed")
    assert passes(TOLD, GOOD, "patch-not-believed")


def test_every_row_of_the_battery_can_be_met():
    """A sentence each, and a fault that somebody could name where one must be."""
    for name in hard_names():
        hard = hard_case(name)
        assert hard.must in (IN_INTERVAL, ACCURATE, NAMED, TOLD)
        assert bool(hard.telling) == (hard.must == TOLD)
        assert hard.must != NAMED or names_faulty(
            [Diagnosis("x", views=tuple(f"s{k:03d}.png" for k in range(12)))], hard.scene.fault
        )
        assert set(hard.telling) <= {entry.code for entry in ENTRIES}


def test_unknown_cases_are_refused(tmp_path):
    with pytest.raises(InputError, match="no such hard case"):
        run_battery(["one-lihgt"], tmp_path, workers=1, reporter=Reporter(quiet=True))


@pytest.mark.parametrize("name", TABLE_CASES)
def test_the_batterys_tables(name):
    passed, said = TABLE_CASES[name][1]()
    assert passed, said


def test_cells_of_directions_hold_their_angles():
    theta = np.radians([20.0, 50.0]), np.radians([35.0, 5.0])
    phi = np.radians([10.0, -120.0]), np.radians([190.0, 130.0])
    cells = cells_at(unit_vectors(theta[0], phi[0]), unit_vectors(theta[1], phi[1]))
    np.testing.assert_allclose(cells.theta_i, theta[0])
    np.testing.assert_allclose(cells.theta_r, theta[1])
    np.testing.assert_allclose(np.degrees(cells.dphi), [180.0, 110.0])
