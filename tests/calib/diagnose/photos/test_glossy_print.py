"""Black print that shows the lamp, and lamps that went astray: drawn set-ups through the real solvers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.adjust.alternate import settle
from photogonio.calib.detect.paper_near_balls import Close
from photogonio.calib.diagnose.photos.glossy_print import shining, white_alone
from photogonio.calib.diagnose.photos.unusable_photos import washed_out
from photogonio.calib.diagnose.procedure import ask
from photogonio.calib.diagnose.registry import Stage, asked_at
from photogonio.calib.shading.initial import square_ratios
from photogonio.calib.views import light_of
from tests.drawn.calibrations import Drawn
from tests.drawn.setups import BLACK, PAPER, draw_paper, observe

ROUGHNESS = 0.2  # of toner


def shone_on(drawn: Drawn, reading, number: int, f0: float = 0.04):
    """A reading whose black print is under a clear film: microfacets of GGX, a mirror's reflectance ``f0`` at its peak
    over 4 pi roughness squared."""
    points, black = reading.samples.points, ~reading.samples.white
    toward = [drawn.world.lamps[number] - points, drawn.world.views[number].center - points]
    lamp, eye = (one / np.linalg.norm(one, axis=1, keepdims=True) for one in toward)
    half = (lamp + eye) / np.linalg.norm(lamp + eye, axis=1, keepdims=True)
    peak = ROUGHNESS**2 / (np.pi * (half[:, 2] ** 2 * (ROUGHNESS**2 - 1) + 1) ** 2)
    film = f0 * peak / (4 * lamp[:, 2] * eye[:, 2])
    gain = np.where(black, 1 + np.pi * film / BLACK, 1.0)
    samples = replace(reading.samples, value=reading.samples.value * gain[:, None])
    return replace(reading, samples=samples, level=reading.level * gain, noise=reading.noise * gain**2)


def readings_of(drawn: Drawn, views: int):
    return {f"v{k}": draw_paper(drawn.world, k, drawn.rng) for k in range(views)}


def shares_of(readings):
    return {name: square_ratios(one) for name, one in readings.items()}


def test_a_print_that_shines_is_told_from_one_that_is_matt_or_once_had_light_on_it():
    """Where lamp and camera stand so that many squares see the lamp mirrored within some roughnesses, black is there
    several times as bright as elsewhere: an uneven share of white, if never so few photos show it; but one of six may
    be a mishap. A matt print's shares scatter by the squares' 0.2 %, shadows' edges and noise."""
    drawn = Drawn(3)
    matt = readings_of(drawn, 6)
    assert shining(shares_of(matt)) == []
    shiny = {name: shone_on(drawn, one, k) for k, (name, one) in enumerate(matt.items())}
    assert len(shining(shares_of(shiny))) >= 2
    one = shining(shares_of(shiny))[0]
    assert shining(shares_of(matt | {one: shiny[one]})) == []


def test_a_matt_print_in_little_light_does_not_shine():
    """Noise as large as the black itself scatters its share of the white from square to square, and is known."""
    drawn = Drawn(3)
    noisy = {}
    for name, reading in readings_of(drawn, 6).items():
        black = np.median(reading.level[~reading.samples.white])
        level = reading.level + black * drawn.rng.normal(size=len(reading.level))
        noisy[name] = replace(reading, level=level, noise=reading.noise + black**2)
    assert shining(shares_of(noisy)) == []


def test_white_alone_keeps_nothing_else():
    drawn = Drawn(3)
    reading = draw_paper(drawn.world, 0, drawn.rng)
    n, share = 60, np.linspace(0, 1, 60)
    close = Close(*np.zeros((1, n, 3)), np.where(share > 0.3, 1.0, share), *np.ones((2, n)), np.zeros(n, int),
                  np.zeros((n, 3)), np.zeros(n))  # fmt: skip
    found = white_alone(replace(reading, close=close))
    white = reading.samples.white
    assert found.samples.white.all()
    np.testing.assert_array_equal(found.level, reading.level[white])
    assert (found.noise >= reading.noise[white]).all()
    assert (found.close.white > 0.98).all() and len(found.close.level) == (share > 0.3).sum()
    assert found.close.aside is None
    few = np.flatnonzero(white)[:50]
    few = np.isin(np.arange(len(white)), few) | ~white
    samples = reading.samples.keep(few)
    assert (
        white_alone(replace(reading, samples=samples, level=reading.level[few], noise=reading.noise[few]))
        is None
    )


def test_a_shining_print_costs_no_photo_unless_it_is_not_sharp():
    """Squares that see the lamp are brighter than others, and where lamp and camera stand opposite, low, all see it;
    white spread over black brightens all alike."""
    drawn = Drawn(3)
    shiny = {name: shone_on(drawn, one, k) for k, (name, one) in enumerate(readings_of(drawn, 6).items())}
    assert washed_out(shares_of(shiny), shining(shares_of(shiny))) == {}
    every = shining(shares_of(shiny))[0]
    lit = np.where(shiny[every].samples.white, 1.0, 4.0)
    low = shiny | {every: replace(shiny[every], level=shiny[every].level * lit)}
    assert washed_out(shares_of(low), shining(shares_of(low))) == {}
    assert every in washed_out(shares_of(low))
    name = next(n for n in shiny if n not in shining(shares_of(shiny)))
    spread = np.where(
        shiny[name].samples.white, 1.0, 1.0 + 0.15 * PAPER / BLACK
    )  # a part of the white beside it
    blurred = shiny | {name: replace(shiny[name], level=shiny[name].level * spread)}
    assert list(washed_out(shares_of(blurred), shining(shares_of(blurred)))) == [name]


def test_white_is_unsure_where_a_film_over_the_sheet_may_shine_and_nowhere_else():
    """A film adds as much to white as to the black beside it: black's excess over the darkest squares' bounds it, in
    all samples of a square alike."""
    drawn = Drawn(3)
    matt = draw_paper(drawn.world, 0, drawn.rng)
    white, middle = matt.samples.white, np.median(matt.samples.points[:, 0])
    aside = matt.samples.points[:, 0] > middle
    film = np.where(~white & aside, 1 + 0.1 * PAPER / BLACK, 1.0)
    samples = replace(matt.samples, value=matt.samples.value * film[:, None])
    shiny = white_alone(replace(matt, samples=samples, level=matt.level * film))
    doubt = np.sqrt(shiny.noise - matt.noise[white]) / shiny.level
    crowd = np.sqrt(white.sum() / len(np.unique(matt.samples.square[white])))
    far = np.abs(shiny.samples.points[:, 0] - middle) > 30.0  # a square and a half, from the film's edge
    lit = aside[white]
    # squares' own 0.2 % and shadows' edges are a few hundredths of black, and that a twentieth of white
    assert np.median(doubt[far & lit]) == pytest.approx(0.1 * crowd, rel=0.1)
    assert np.median(doubt[far & ~lit]) < 0.005 * crowd


@pytest.mark.parametrize("f0", [0.0, 0.04])
def test_lamps_over_a_shining_print_are_found_by_its_white(f0):
    drawn = Drawn(3)
    state = drawn.camera()
    for observation in state.observations:
        number = int(observation.view.name[1:])
        observe(drawn.world, observation, number, 0.0, drawn.rng, paper=True)
        observation.reading = shone_on(drawn, observation.reading, number, f0)
    state = ask(state, asked_at(Stage.PHOTO)[1:-1])
    observations = state.observations
    assert len(observations) == 6
    assert drawn.told("glossy-print") == (f0 > 0)
    assert all(s.reading.samples.white.all() for s in observations) == (f0 > 0)
    state = settle(state)
    found, observations = state.settled, state.observations
    lights = [(light_of(found, s), drawn.world.lamps[int(s.view.name[1:])]) for s in observations]
    off = [(light.place - lamp, light.covariance) for light, lamp in lights]
    # squares of standard errors of three numbers: a mean of 18 is beyond 4 once in 10^8
    assert np.mean([d @ np.linalg.solve(cov, d) / 3 for d, cov in off]) < 4
