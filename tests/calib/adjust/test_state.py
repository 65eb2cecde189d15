"""A set while it is calibrated: each state stands for itself."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.adjust.state import State
from photogonio.calib.detect.highlights import Highlight
from photogonio.calib.detect.observation import Observation
from photogonio.calib.remarks import Remarks
from photogonio.calib.shading.correction import NO_CORRECTION, PhotometricCorrection
from photogonio.capture.photoset import Photo, View
from tests.drawn.boards import quiet
from tests.drawn.setups import photoset_of

SPOT = Highlight(0, np.zeros(2), 0.1, 1.0, 4.0, False)


@pytest.fixture
def state(drawn) -> State:
    world, readings = drawn
    observations = []
    for k, reading in enumerate(readings):
        one = Observation(View((Photo(f"s{k}", "sample"),)), "one", None, world.views[k], f"pose s{k}")
        one.reading, one.highlights, one.shading = reading, [SPOT], np.ones(10)
        observations.append(one)
    photoset = photoset_of(world, fixed=True)
    return State(photoset, None, world.camera, None, (), tuple(observations), Remarks(), quiet)


def test_nothing_has_settled_at_first(state):
    with pytest.raises(ValueError, match="nothing has settled yet"):
        _ = state.settled
    assert replace(state, settled_or_none="this").settled == "this"


def test_what_is_filled_in_later_does_not_change_what_was(state):
    later = state.copied()
    later[0].highlights = []
    later[1].reading = None
    assert state.observations[0].highlights == [SPOT] and state.observations[1].has_paper
    assert state.keeping(later).observations == tuple(later)


def test_lamps_are_sought_anew_from_what_was_seen_at_first(state):
    first = {one.view.name: (SPOT, SPOT) for one in state.observations}
    kept = [one.highlights for one in state.started_over()]
    assert kept == [[SPOT]] * 4  # as they are, before anything settled
    again = replace(state, highlights=first).started_over()
    assert all(one.highlights == [SPOT, SPOT] and one.shading is None for one in again)
    assert all(one.shading is not None and len(one.highlights) == 1 for one in state.observations)


def test_paper_of_dark_photos_is_not_given_out(state):
    state.observations[1].dark = True
    state.observations[2].reading = None
    found = dict(state.papers())
    assert list(found) == ["s0", "s3"] and found["s3"] is state.observations[3].reading


def test_changed_paper_is_set_aside_and_unchanged_is_not(state):
    """Readings go where ``keep`` puts them: those that stay the same are not written again."""
    kept = []
    for one in state.observations:
        one.keep = lambda reading: kept.append(reading) or (lambda: reading)
    brighter = state.with_paper(
        lambda one, reading: replace(reading, level=2 * reading.level) if one.view.name == "s1" else reading
    )
    assert len(kept) == 1
    for k in range(4):
        before, after = state.observations[k].reading, brighter.observations[k].reading
        np.testing.assert_array_equal(after.level, (2 if k == 1 else 1) * before.level)
    gone = state.with_paper(lambda one, reading: None)
    assert not any(one.has_paper for one in gone.observations) and state.observations[0].has_paper


def test_photos_without_a_correction_have_none(state):
    known = PhotometricCorrection(np.ones(1))
    assert replace(state, corrections={"s0": known}).correction("s0") is known
    assert state.correction("s0") is NO_CORRECTION
