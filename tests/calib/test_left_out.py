"""Photos that tell nothing: without light, or with a print that is not sharp."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.detect.observe import is_dark
from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.diagnose.photos.unusable_photos import UnusablePhotos, washed_out
from photogonio.calib.diagnose.procedure import ask
from photogonio.calib.shading.initial import square_ratios, white_level
from photogonio.capture.errors import InputError
from tests.calib.test_warnings import Drawn
from tests.drawn.setups import draw_paper


@pytest.mark.parametrize(("brightness", "dark"), [(0.0, True), (20.0, False)])
def test_a_photo_in_which_no_lamp_was_on(brightness, dark):
    """In units of the camera's noise; what lies below black is cut off by the file, so that darkness is not 0."""
    drawn = Drawn(3)
    reading = draw_paper(drawn.world, 0, drawn.rng)
    level = brightness * reading.level / np.quantile(reading.level, 0.9)
    level = np.maximum(level + drawn.rng.normal(size=len(level)), 0)
    assert is_dark(replace(reading, level=level, noise=np.ones_like(level))) == dark


@pytest.mark.parametrize("white", [1.0, 20.0])
def test_a_lit_photo_of_little_white_is_not_dark(white):
    """Black print at 1 standard error of a sample; of 30 samples one is white: it alone tells."""
    drawn = Drawn(3)
    samples = draw_paper(drawn.world, 0, drawn.rng).samples
    samples = replace(samples, white=np.arange(len(samples)) % 30 == 0)
    level = np.where(samples.white, white, 1.0) + drawn.rng.normal(size=len(samples))
    assert is_dark(PaperReading(samples, level, np.ones(len(samples)))) == (white < 3)


def test_a_lit_photo_whose_white_lies_in_shadow_is_not_dark():
    drawn = Drawn(3)
    samples = draw_paper(drawn.world, 0, drawn.rng).samples
    samples = replace(samples, white=np.arange(len(samples)) < 6)
    level = np.where(samples.white, 0.0, 20.0) + drawn.rng.normal(size=len(samples))
    assert not is_dark(PaperReading(samples, level, np.ones(len(samples))))


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
