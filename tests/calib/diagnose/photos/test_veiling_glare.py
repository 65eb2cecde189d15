"""Light over a whole picture, told by black print: drawn paper with and without it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.diagnose.photos.glossy_print import shining
from photogonio.calib.diagnose.photos.veiling_glare import correction_of, find_veils, lifted
from photogonio.calib.diagnose.procedure import ask
from photogonio.calib.diagnose.registry import Stage, asked_at
from photogonio.calib.shading.initial import square_ratios
from tests.drawn.boards import radiance
from tests.drawn.calibrations import Drawn
from tests.drawn.setups import MIDDLE, draw_paper, draw_world, observe

VIEWS = 6
SHARE = 0.005  # of white paper
LEAST = 1e-3  # of it that is told
CLEAN = 2e-3  # of it, that may lie unseen where nothing tells more
WIDEST = 5.0  # standard errors


@pytest.fixture(scope="module")
def readings() -> list[PaperReading]:
    rng = np.random.default_rng(11)
    world = draw_world(rng, fixed=True, views=VIEWS)
    return [draw_paper(world, k, rng) for k in range(VIEWS)]


def named(readings: list[PaperReading]) -> list[tuple[str, PaperReading]]:
    return [(f"v{k}", reading) for k, reading in enumerate(readings)]


def with_values(reading: PaperReading, value: np.ndarray) -> PaperReading:
    samples = replace(
        reading.samples, value=value, variance=np.broadcast_to(reading.noise[:, None], value.shape)
    )
    return replace(reading, samples=samples, level=value.mean(1))


def white_of(reading: PaperReading) -> np.ndarray:
    return np.median(reading.samples.value[reading.samples.white], axis=0)


def veiled(reading: PaperReading, share: float) -> tuple[PaperReading, np.ndarray]:
    veil = share * white_of(reading)
    return with_values(reading, reading.samples.value + veil), veil


def test_none_is_told_where_there_is_none(readings):
    assert find_veils(named(readings)) == {}


def readings_far(distance: float, share: float = 0.0) -> list[PaperReading]:
    """Paper under lamps as far away, and as bright there as near ones are, with light over the pictures."""
    rng = np.random.default_rng(12)
    world = draw_world(rng, fixed=True, views=VIEWS)
    offset = world.lamps - MIDDLE
    further = distance / np.linalg.norm(offset, axis=1)
    far = replace(world, lamps=MIDDLE + offset * further[:, None], strengths=world.strengths * further**2)
    return [veiled(draw_paper(far, k, rng), share)[0] for k in range(VIEWS)]


@pytest.mark.parametrize("distance", [2e3, 6e3, 1e5])
@pytest.mark.parametrize("shadows", [True, False])
def test_the_inks_own_reflectance_is_no_veil_under_lamps_far_away(distance, shadows):
    """Even light makes no line; what is not told is an error no larger than the darkest print, or a clean lens's."""
    found = readings_far(distance)
    if not shadows:
        found = [in_the_open(reading) for reading in found]
    veils = find_veils(named(found))
    assert not any(one.told for one in veils.values())
    assert all((one.error <= CLEAN * one.white).all() for one in veils.values())
    if not shadows and distance > 1e4:
        assert len(veils) == VIEWS
        assert all((one.error > 0.5 * CLEAN * one.white).all() for one in veils.values())


def in_the_open(reading: PaperReading) -> PaperReading:
    """Without what lies in any shadow."""
    white = reading.samples.white
    keep = reading.level > 0.9 * np.where(
        white, *(np.median(reading.level[tone]) for tone in (white, ~white))
    )
    samples = reading.samples.keep(keep)
    return replace(reading, samples=samples, level=reading.level[keep], noise=reading.noise[keep])


def test_a_veil_under_lamps_far_away_is_an_error_within_which_it_lies():
    """It is not taken off, where only shadows tell of it; but its error holds it."""
    share = 1e-3
    veils = find_veils(named(readings_far(1e5, share)))
    assert len(veils) == VIEWS
    for one in veils.values():
        assert abs(one.level[0] - share * one.white[0]) < WIDEST * one.error[0]


@pytest.mark.parametrize("share", [0.05, 0.3])
def test_light_on_the_board_is_none(readings, share):
    """A room's even light: black print sends on as much less of it than white as of the lamp's."""
    lit = []
    for reading in readings:
        black = np.median(reading.samples.value[~reading.samples.white]) / white_of(reading)[0]
        tone = np.where(reading.samples.white, 1.0, black)[:, None]
        lit.append(with_values(reading, reading.samples.value + share * white_of(reading) * tone))
    found = find_veils(named(lit))
    assert all(abs(one.level[0]) < SHARE * one.white[0] for one in found.values())


@pytest.mark.parametrize("share", [SHARE, -SHARE, 0.02])
def test_it_is_found_to_within_its_error_and_taken_off(readings, share):
    both = [veiled(reading, share) for reading in readings]
    found = find_veils(named([reading for reading, _ in both]))
    observations = [
        SimpleNamespace(view=SimpleNamespace(name=n), reading=r)
        for n, (r, _) in zip(found, both, strict=True)
    ]
    for one in observations:
        one.reading = lifted(one.reading, found.get(one.view.name))
    for (name, one), (_, veil), observation, bare in zip(
        found.items(), both, observations, readings, strict=True
    ):
        assert name == observation.view.name
        assert one.error[0] < 0.2 * abs(veil[0])
        assert abs(one.level[0] - veil[0]) < WIDEST * one.error[0]
        left = observation.reading.level - bare.level
        np.testing.assert_allclose(left, (veil - one.level)[0], rtol=0, atol=1e-9 * white_of(bare)[0])
        np.testing.assert_allclose(observation.reading.noise, bare.noise + one.error[0] ** 2, rtol=1e-12)
        np.testing.assert_allclose(
            observation.reading.samples.value.mean(1), observation.reading.level, rtol=1e-12
        )


def test_photos_that_tell_nothing_have_it_as_the_others(readings):
    both = [veiled(reading, SHARE) for reading in readings]
    last, veil = both[-1]
    few = np.flatnonzero(~last.samples.white)[100:]
    kept = np.ones(len(last.level), bool)
    kept[few] = False
    last = replace(last, samples=last.samples.keep(kept), level=last.level[kept], noise=last.noise[kept])
    found = find_veils(named([*(reading for reading, _ in both[:-1]), last]))
    one = found[f"v{VIEWS - 1}"]
    assert abs(one.level[0] - veil[0]) < WIDEST * one.error[0]


def test_channels_that_contradict_one_another_tell_none(readings):
    """As where compression mixes the colours of black and white: what one gains another loses."""
    mixed = []
    for reading in readings:
        value = np.repeat(reading.samples.value, 3, axis=1)
        mixed.append(with_values(reading, value + np.array([-SHARE, 0.3 * SHARE, SHARE]) * white_of(reading)))
    found = find_veils(named(mixed))
    assert not any(one.told for one in found.values())
    assert all((one.error > LEAST * one.white).all() for one in found.values())


def test_nothing_is_made_of_a_board_without_black_or_white(readings):
    samples = readings[0].samples
    for tone in (samples.white, ~samples.white):
        part = replace(readings[0], samples=samples.keep(tone), level=readings[0].level[tone])
        assert not any(one.told for one in find_veils([("a", part)]).values())
    assert find_veils([]) == {}


def test_pictures_are_freed_of_it(readings):
    found = find_veils(named([veiled(reading, SHARE)[0] for reading in readings]))
    one, picture = found["v0"], radiance(np.full((4, 5), 2.0), 0.0)
    np.testing.assert_allclose(
        correction_of(one).of_image(picture, None).value, 2.0 - one.level[0], rtol=1e-6
    )
    assert correction_of(replace(one, told=False)).of_image(picture, None) is picture


@pytest.mark.parametrize("share", [0.05, -0.03])
def test_a_veil_is_not_taken_for_a_print_that_shines(share):
    """It makes black print an uneven share of the white too, by as much as white is unevenly lit; less light than none,
    a black level that is too high, as well. Without it the shares are even, and black print may be read."""
    drawn = Drawn(3)
    state = drawn.camera()
    for observation in state.observations:
        observe(drawn.world, observation, int(observation.view.name[1:]), 0.0, drawn.rng, paper=True)
        observation.reading = veiled(observation.reading, share)[0]
    before = {s.view.name: square_ratios(s.reading) for s in state.observations}
    assert len(shining(before)) >= 2
    after = ask(state, asked_at(Stage.PHOTO)[1:-1])
    assert len(after.observations) == len(state.observations)
    assert drawn.told("veiling-glare") and not drawn.told("glossy-print")
    assert drawn.remarks.residuals["veil"]["share_of_white"] == pytest.approx(share, rel=0.2)
    for observation in after.observations:
        found, white = after.correction(observation.view.name), white_of(observation.reading)
        assert found.offset is not None and not observation.reading.samples.white.all()
        off = np.abs(found.offset - share * white).max()
        assert off < WIDEST * np.hypot(found.offset_error, LEAST * white).max()
