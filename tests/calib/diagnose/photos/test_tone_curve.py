"""Codes that were read by another curve than they have: drawn paper, coded and decoded wrongly."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.diagnose.photos.tone_curve import (
    ToneDoubt,
    believed,
    judged,
    tone_doubt,
    tone_warning,
)
from photogonio.calib.diagnose.photos.tone_levels import Steady, ToneVerdict
from photogonio.capture.containers.tone import LINEAR, SRGB
from photogonio.capture.linear.encoding import (
    gamma_to_linear,
    linear_to_gamma,
    linear_to_srgb,
    srgb_to_linear,
)
from tests.drawn.calibrations import Drawn
from tests.drawn.setups import observe

VIEWS = 6
BRIGHTEST = 0.85  # of full scale
CURVES = {
    "srgb": (linear_to_srgb, srgb_to_linear),
    "gamma": (lambda x: linear_to_gamma(x, 2.2), lambda x: gamma_to_linear(x, 2.2)),
}


@pytest.fixture(scope="module")
def seen():
    drawn = Drawn(3, views=VIEWS)
    state = drawn.camera()
    camera, observations = state.camera, state.observations
    for one in observations:
        observe(drawn.world, one, int(one.view.name[1:]), 0.0, drawn.rng, paper=True)
    return drawn, camera, observations


def read_by(reading: PaperReading, curve) -> PaperReading:
    full = float(reading.samples.value.max()) / BRIGHTEST
    value = full * curve(np.maximum(reading.samples.value, 0.0) / full)
    return replace(reading, samples=replace(reading.samples, value=value), level=value.mean(1))


def doubt_of(seen, curve=None, *, balls: bool = True):
    drawn, camera, observations = seen
    changed = []
    for one in observations:
        one = copy(one)
        if curve is not None:
            one.reading = read_by(one.reading, curve)
        if not balls:
            one.highlights = []
        changed.append(one)
    return tone_doubt(drawn.photoset, camera, changed)


def test_paper_that_is_read_rightly_raises_no_doubt(seen):
    assert doubt_of(seen) is None
    assert doubt_of(seen, balls=False) is None


@pytest.mark.parametrize("balls", [True, False])
@pytest.mark.parametrize("name", CURVES)
def test_a_curve_that_is_not_read_and_one_that_is_not_there(seen, name, balls):
    """With the lamp's place known or not."""
    code, decode = CURVES[name]
    coded, decoded = (doubt_of(seen, curve, balls=balls) for curve in (code, decode))
    assert coded.coded and not decoded.coded
    assert np.isfinite([coded.power, decoded.power]).all() == balls
    assert 'encoding = "srgb"' in tone_warning(seen[0].photoset, coded)
    assert 'encoding = "linear"' in tone_warning(seen[0].photoset, decoded)
    assert coded.to_dict()["looks"] == "coded" and (coded.to_dict()["power"] is None) != balls


@pytest.mark.parametrize(
    ("black", "powers", "coded"),
    [
        (0.049, [1.0, 0.9, 1.1, 1.05], None),
        (0.28, [1.0, 0.95, 1.1, 1.05], None),  # pale ink
        (0.28, [0.45, 0.5, 0.43, 0.47], True),
        (0.049, [0.45, 0.5, 0.43, 0.47], None),  # a room's light, not a curve
        (0.004, [2.1, 2.3, 2.2, 2.2], False),
        (0.049, [2.1, 2.3, 2.2, 2.2], None),  # a lamp with a narrow beam
        (np.nan, [0.45, 0.5, 0.43, 0.47], None),
        (0.28, [], True),
        (0.005, [], False),
        (0.6, [], None),
        (0.09, [], None),
        (np.nan, [], None),
    ],
)
def test_both_must_tell_it_where_both_are_known(black, powers, coded):
    found = judged(black, np.array(powers))
    assert found is None if coded is None else found.coded is coded


@pytest.mark.parametrize(
    ("ink", "surer", "black", "doubted"),
    [
        (0.0022, 29.0, 0.049, False),  # evenly lit: a veil passes for the ink
        (0.0022, 29.0, 0.004, True),
        (0.0022, 80.0, 0.049, True),  # the share is unsteady as well
        (0.0488, 8.0, 0.004, False),
    ],
)
def test_an_odd_ink_that_is_not_seen_is_no_evidence(ink, surer, black, doubted):
    own, other = Steady(1.0, ink, 0.0), Steady(1.0, 0.049, 0.0)
    verdict = ToneVerdict(SRGB, LINEAR, own, other, {LINEAR: 0.0, SRGB: surer})
    assert believed(verdict, black) == doubted


@pytest.mark.parametrize(("black", "way"), [(-0.02, "high"), (0.01, "high"), (0.3, "low")])
@pytest.mark.parametrize("given", [0.02, None])
def test_black_that_no_other_curve_explains_names_the_black_level(seen, black, way, given):
    """An encoding that is set already is not proposed."""
    photoset = seen[0].photoset
    for encoding, curve in (("linear", LINEAR), ("srgb", SRGB), ("auto", LINEAR)):
        read = replace(photoset.radiometry, encoding=encoding, black_level=given)
        said = tone_warning(replace(photoset, radiometry=read), ToneDoubt(curve, curve, black))
        assert "set encoding" not in said and said.startswith("[radiometry] black_level")
        assert f"is too {way}" in said and ("= 0.02" in said) == (given is not None)
        assert ("no ordinary black" in said) == (black > 0)


def test_too_much_black_taken_off_a_linear_photo_is_told_as_that(seen):
    """The print of photos read as they are, by another black level: what was read is known, and not proposed again."""
    drawn, camera, observations = seen
    changed = []
    for one in observations:
        one = copy(one)
        off = 0.08 * float(np.median(one.reading.samples.value.max(axis=0)))
        samples = replace(one.reading.samples, value=one.reading.samples.value - off)
        one.reading = replace(one.reading, samples=samples, level=one.reading.level - off)
        one.highlights = []
        changed.append(one)
    photoset = replace(
        drawn.photoset, radiometry=replace(drawn.photoset.radiometry, encoding="linear", black_level=0.02)
    )
    doubt = tone_doubt(photoset, camera, changed)
    assert doubt is not None and doubt.black < 0
    assert "black_level = 0.02 is too high" in tone_warning(photoset, doubt)
