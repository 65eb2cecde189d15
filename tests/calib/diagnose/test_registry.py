"""All departures: each is what the protocol asks for, asked in an order that it needs, and told of in the docs."""

import pytest

from photogonio.calib.diagnose.photos.glossy_print import GlossyPrint
from photogonio.calib.diagnose.photos.unusable_photos import UnusablePhotos
from photogonio.calib.diagnose.photos.veiling_glare import VeilingGlare
from photogonio.calib.diagnose.registry import DEPARTURES, LIGHT, LOOKS, Stage, asked_at, entries, looked_at
from photogonio.capture.diagnosis import Entry


@pytest.mark.parametrize("departure", (*LOOKS, *DEPARTURES), ids=lambda one: type(one).__name__)
def test_each_is_what_is_asked_of_a_departure(departure):
    assert isinstance(departure.stage, Stage) and callable(departure.evidence) and callable(departure.remedy)
    assert all(isinstance(entry, Entry) for entry in departure.entries)
    assert (departure.stage is Stage.LIGHT) == (departure in LIGHT)
    assert type(departure).__doc__


@pytest.mark.parametrize("departure", LIGHT, ids=lambda one: type(one).__name__)
def test_those_of_light_speak_of_one_another_by_their_codes(departure):
    codes = {one.code for one in LIGHT}
    assert departure.code in {entry.code for entry in departure.entries}
    assert {*departure.after, *departure.anew} <= codes - {departure.code}


def test_no_two_of_light_wait_for_one_another():
    left = {one.code: set(one.after) for one in LIGHT}
    while free := {code for code, after in left.items() if not after & left.keys()}:
        left = {code: after for code, after in left.items() if code not in free}
    assert not left


def test_stages_share_out_all_departures():
    stages = list(Stage)
    for asked, every in ((asked_at, DEPARTURES), (looked_at, LOOKS)):
        assert [one for stage in Stage for one in asked(stage)] == sorted(
            every, key=lambda one: stages.index(one.stage)
        )
    assert max(stages.index(one.stage) for one in LOOKS) < min(stages.index(one.stage) for one in DEPARTURES)


def test_a_veil_is_taken_off_before_black_print_is_judged():
    order = [type(one) for one in asked_at(Stage.PHOTO)]
    assert order.index(VeilingGlare) < order.index(UnusablePhotos) < order.index(GlossyPrint)


def test_no_code_is_of_two_stages():
    codes = [entry.code for stage in Stage for entry in entries(stage)]
    assert len(codes) == len(set(codes))
