"""What each photo shows: darkness, and one lamp in several balls."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.detect.observe import is_dark, of_one_lamp
from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.capture.photoset import MirrorBall
from tests.drawn.calibrations import Drawn
from tests.drawn.mirror_balls import BALLS, LAMP, highlight
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


@pytest.mark.parametrize(("dimmer", "kept"), [(0.5, 2), (0.1, 2), (0.01, 1)])
def test_a_ball_that_does_not_show_the_lamp_shows_something_dimmer(dimmer, kept):
    """A glossy sample or a bright wall in the second ball, where something hides the lamp."""
    bright, other = highlight(0, LAMP), highlight(1, LAMP)
    found = of_one_lamp([bright, replace(other, peak=dimmer * bright.peak)], BALLS)
    assert [h.ball for h in found] == [0, 1][:kept]


def test_a_clipped_lamp_is_a_lamp_in_a_ball_of_any_size():
    large = MirrorBall(BALLS[1].center, 8.0 * BALLS[0].radius)
    found = of_one_lamp([highlight(0, LAMP), replace(highlight(1, LAMP), clipped=True)], (BALLS[0], large))
    assert len(found) == 2


def test_a_small_ball_shows_the_same_lamp_dimmer():
    small = MirrorBall(
        BALLS[1].center, BALLS[1].radius / 10
    )  # its image of the lamp is a hundredth of the area
    found = of_one_lamp([highlight(0, LAMP), replace(highlight(1, LAMP), peak=0.01)], (BALLS[0], small))
    assert len(found) == 2
