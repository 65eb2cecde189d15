"""The order in which departures are asked for and allowed for, with departures that are made up."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.calib.diagnose import procedure
from photogonio.calib.diagnose.base import NO_DOUBT, Doubt, LightDeparture
from photogonio.calib.diagnose.procedure import (
    ask,
    doubted,
    fits_closer,
    one_astray,
    settle_allowing,
    tell_lights,
)
from photogonio.calib.geometry.camera import Pose
from photogonio.calib.remarks import Remarks
from photogonio.calib.setup import ViewSetup
from photogonio.capture.diagnosis import Diagnosis


@dataclass(frozen=True)
class Known:
    """As much of a state as the procedure sees."""

    remarks: Remarks
    seen: tuple[str, ...] = ()  # departures whose remedies came, in order
    settled_times: int = 0
    found: dict = field(default_factory=dict)
    rms: float = 1.0

    @property
    def settled(self):
        return SimpleNamespace(shading={"a": SimpleNamespace(rms=self.rms, believed=1.0)})


@dataclass(frozen=True)
class Made:
    """A departure that shows until it, or one of ``hidden_by``, is allowed for."""

    code: str
    amount: float = 1.0
    after: tuple[str, ...] = ()
    anew: tuple[str, ...] = ()
    certain: bool = True
    shown_by: tuple[str, ...] = ()  # that have to be allowed for first
    rms: float = 1.0  # of the paper once it is allowed for

    def evidence(self, state):
        shown = self.code not in state.seen and set(self.shown_by) <= set(state.seen)
        return [Diagnosis(self.code, f"{self.code} told", self.amount, 0.1, 0.0, 5.0)] if shown else []

    def remedy(self, state, found):
        return replace(state, seen=(*state.seen, self.code), rms=self.rms)

    def as_settled(self, state, found):
        return replace(found, amount=found.amount + 1)

    def numbers(self, found):
        return {self.code: found.amount}

    def message(self, found, *, allowed):
        return f"{self.code} {'allowed' if allowed else 'left'}" if found.told else ""

    def told_as(self, found):
        return self.code


@pytest.fixture(autouse=True)
def counted(monkeypatch):
    monkeypatch.setattr(
        procedure, "settle", lambda state, longer=False: replace(state, settled_times=state.settled_times + 1)
    )


def settled(*departures: Made) -> Known:
    return settle_allowing(Known(Remarks()), departures)


def test_the_surest_is_allowed_for_first():
    state = settled(Made("weak", 0.6), Made("strong", 3.0), Made("middling", 1.0))
    assert state.seen == ("strong", "middling", "weak") and state.settled_times == 4
    assert all(one.allowed for one in state.found.values())


def test_what_is_not_sure_enough_is_found_and_left():
    state = settled(Made("faint", 0.49))
    assert state.seen == () and state.settled_times == 1 and not state.found["faint"].allowed


def test_one_waits_for_those_that_come_before_it_if_they_are_told():
    assert settled(Made("a", 9.0, after=("b",)), Made("b")).seen == ("b", "a")
    assert settled(Made("a", 9.0, after=("b",)), Made("b", 0.1)).seen == ("a",)


def test_what_only_shows_once_another_is_known_is_found_then():
    assert settled(Made("beam", shown_by=("lens",)), Made("lens")).seen == ("lens", "beam")


def test_what_it_passed_for_is_asked_again():
    """The room's light may have passed for a beam: known, that is forgotten, and found anew if it is there."""
    state = settled(Made("room", 1.0, anew=("beam",)), Made("beam", 5.0))
    assert state.seen == ("beam", "room") and "beam" not in state.found
    assert state.found["room"].allowed


@pytest.mark.parametrize(("rms", "kept"), [(0.99, True), (1.0, False), (1.2, False)])
def test_what_is_not_certain_is_kept_where_the_paper_then_fits_closer(rms, kept):
    state = settled(Made("lens", certain=False, rms=rms))
    assert state.seen == (("lens",) if kept else ())
    assert state.found["lens"].told and state.found["lens"].allowed == kept


def test_one_that_was_refused_is_tried_again_once_another_is_known():
    """Refused at first it fits closer beside what was found since: 1.0 to 1.1, refused; then 1.2 to 1.1, kept."""
    state = settled(Made("lens", 5.0, certain=False, rms=1.1), Made("room", 1.0, rms=1.2))
    assert state.seen == ("room", "lens")


def test_closer_is_by_the_photos_that_both_have_and_against_what_is_not_believed():
    def of(**photos):
        return SimpleNamespace(
            shading={name: SimpleNamespace(rms=rms, believed=share) for name, (rms, share) in photos.items()}
        )

    assert fits_closer(of(a=(0.9, 1.0)), of(a=(1.0, 1.0))) and not fits_closer(
        of(a=(1.0, 1.0)), of(a=(0.9, 1.0))
    )
    assert fits_closer(of(a=(0.9, 1.0), b=(9.0, 1.0)), of(a=(1.0, 1.0), c=(0.0, 1.0)))
    assert not fits_closer(of(a=(0.9, 0.5)), of(a=(1.0, 1.0)))  # it fits half of the samples closer


def test_one_lamp_that_settled_elsewhere_says_nothing_against_what_all_others_fit_closer():
    def of(*rms):
        return SimpleNamespace(shading={str(k): SimpleNamespace(rms=one) for k, one in enumerate(rms)})

    assert one_astray(of(0.95, 0.95, 1.5), of(1.0, 1.0, 1.0))
    assert not one_astray(of(0.95, 0.95, 1.1), of(1.0, 1.0, 1.0))
    assert not one_astray(of(1.05, 1.05, 1.5), of(1.0, 1.0, 1.0))  # most are farther: the model is
    assert not one_astray(of(), of(1.0))


@dataclass(frozen=True)
class Told:
    """One that is asked for on the way; its remedy may be given up."""

    found: tuple[Diagnosis, ...]
    name: str = ""
    better: bool = True

    def evidence(self, state):
        return self.found

    def remedy(self, state, found):
        assert list(found) == list(self.found)
        return replace(state, seen=(*state.seen, self.name)) if self.better else None


def test_each_is_asked_on_the_state_that_the_one_before_has_left():
    one, silent = Diagnosis("a", "in words"), Diagnosis("b")
    state = ask(
        Known(Remarks()), [Told((one, silent), "first"), Told((), "nothing"), Told((silent,), "last")]
    )
    assert state.seen == ("first", "last")
    assert state.remarks.diagnoses == [one]  # what has no words is not told


def test_a_remedy_that_is_no_better_is_given_up_and_not_told():
    state = ask(Known(Remarks()), [Told((Diagnosis("a", "in words"),), better=False), Told((), "next")])
    assert state.seen == () and state.remarks.diagnoses == []


@pytest.mark.parametrize("denied", [False, True])
def test_what_was_found_of_the_lights_is_told_as_it_settled(denied):
    known = {"room": Diagnosis("room", "", 2.0, 0.1, 0.0, 5.0, allowed=True)}
    state = Known(Remarks(), found=known)
    tell_lights(state, [Made("room"), Made("beam")], {"room": not denied})
    (told,) = state.remarks.diagnoses
    assert told.amount == 3.0 and told.allowed == (not denied)
    assert told.message == f"room {'left' if denied else 'allowed'}"
    assert state.remarks.residuals == {"room": 3.0}


class Leaves(LightDeparture):
    """A departure that leaves a doubt."""

    def __init__(self, left: Doubt):
        self.left = left

    def doubt(self, state, views):
        return self.left


def test_doubts_that_departures_leave_add_in_squares():
    pose = Pose(np.eye(3), np.zeros(3))
    view = ViewSetup("v", None, pose, np.full(1, 2.0), np.full(1, 0.06), "board", 0.1, None, None)
    doubts = [Leaves(Doubt(np.array([0.04]), 0.3)), Leaves(NO_DOUBT), Leaves(Doubt(0.0, 0.4))]
    (wider,), common = doubted(None, doubts, [view])
    assert common == pytest.approx(0.5)
    np.testing.assert_allclose(wider.strength_error, [0.1])  # 0.06, and 0.04 of 2
