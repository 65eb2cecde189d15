"""Photos that tell nothing: without light, with a print that is not sharp, with something else for a lamp."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.adjust.alternate import settle
from photogonio.calib.diagnose.photos.unusable_photos import UnusablePhotos, contradiction, washed_out
from photogonio.calib.diagnose.procedure import ask
from photogonio.calib.shading.initial import square_ratios, white_level
from photogonio.capture.errors import InputError
from tests.drawn.calibrations import Drawn
from tests.drawn.setups import (
    draw_paper,
)


def test_highlights_of_two_things_are_not_one_lamp():
    drawn = Drawn(13)
    state = drawn.watched()
    observations = state.observations
    wrong = observations[3].highlights[1]
    observations[3].highlights[1] = replace(wrong, pixel=wrong.pixel + np.array([6.0, -6.0]))
    state = settle(state)
    found, observations = state.settled, state.observations
    said = {s.light: contradiction(found, [s]) for s in observations}
    assert said.pop("s3") is not None
    assert set(said.values()) == {None}


def test_dark_photos_are_left_out_by_name_and_a_set_of_them_refused():
    drawn = Drawn(3, fixed=True)
    state = drawn.camera()
    observations = state.observations
    observations[0].dark, observations[0].limb = True, "of all photos"
    kept = ask(state, [UnusablePhotos()]).observations
    assert [one.view.name for one in kept] == [one.view.name for one in observations[1:]]
    assert drawn.said(f"{observations[0].view.name}: left out, the photo is dark")
    assert kept[0].limb == "of all photos"
    for observation in observations:
        observation.dark = True
    with pytest.raises(InputError, match="dark"):
        ask(state, [UnusablePhotos()])


@pytest.mark.parametrize(("share", "said"), [(0.15, ["v2"]), (0.01, [])])
def test_a_print_that_is_not_sharp(share, said):
    """Where ``share`` of the white light has spread over the black; the lamp changes both alike."""
    drawn = Drawn(3)
    readings = {f"v{k}": draw_paper(drawn.world, k, drawn.rng) for k in range(5)}
    sharp = readings["v2"]
    white = np.median(sharp.level[sharp.samples.white])
    level = np.where(sharp.samples.white, sharp.level, sharp.level + share * white)
    readings["v2"] = replace(sharp, level=level)
    found = washed_out({name: square_ratios(one) for name, one in readings.items()})
    assert list(found) == said
    assert all("not sharp" in why for why in found.values())


def test_a_photo_with_the_lamp_off_is_not_told_to_be_blurred():
    """What little light there is in it is no sign of the lens."""
    drawn = Drawn(3)
    readings = {f"v{k}": draw_paper(drawn.world, k, drawn.rng) for k in range(5)}
    lit = readings["v2"]
    black = lit.level + 0.15 * white_level(lit)
    readings["v2"] = replace(lit, level=0.002 * np.where(lit.samples.white, lit.level, black))
    shares = {name: square_ratios(one) for name, one in readings.items()}
    found = washed_out(shares, whites={name: white_level(one) for name, one in readings.items()})
    assert list(found) == ["v2"]
    assert "lamp off" in found["v2"] and "sharp" not in found["v2"]
