"""Which curve makes black print a steady share of white: drawn levels, coded by one curve and read by another."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.diagnose.photos.tone_levels import (
    CURVES,
    Power,
    PrintLevels,
    read_curve,
    told_by_levels,
)
from photogonio.capture.containers.tone import ADOBE_GAMMA, LINEAR, SRGB, Curve
from photogonio.capture.linear.encoding import Encoding

INK, UNEVEN = 0.0488, 0.01
STEPS = 65535.0
BT709, (MAC, ADOBE) = CURVES[2], CURVES[3:5]


def drawn(curve: Curve, read: Curve, *, ink: float = INK, veil: float = 0.0, lift: float = 0.0):
    """Eight photos whose paper is lit from a third of its brightest on, coded by ``curve`` and read as ``read``;
    ``veil`` is a share of the photo's middle white, ``lift`` of full scale."""
    rng, code = np.random.default_rng(5), np.linspace(0.0, 1.0, 1 << 16)
    photos = []
    for brightest in np.linspace(0.25, 0.9, 8):
        white = brightest * rng.uniform(0.3, 1.0, (2000, 3))
        black = ink * white * (1 + UNEVEN * rng.normal(size=(2000, 1)))
        over = veil * np.median(white) + lift
        levels = [np.interp(one + over, curve.light(code), code) for one in (white, black)]
        levels = [read.light(np.round(one * STEPS) / STEPS) for one in levels]
        photos.append(PrintLevels(*levels, Encoding("curves", curves=(read,)), STEPS))
    return photos


@pytest.mark.parametrize("read", CURVES, ids=lambda curve: curve.name)
@pytest.mark.parametrize("off", [{}, {"veil": 0.03}, {"lift": 0.02}], ids=str)
def test_codes_that_are_read_rightly_raise_no_doubt(read, off):
    """Whatever light lies over the pictures."""
    found = told_by_levels(drawn(read, read, **off))
    assert not found.contradicted
    assert found.read.ink == pytest.approx(INK, rel=0.02)


@pytest.mark.parametrize(
    ("curve", "read"),
    [
        (SRGB, ADOBE),
        (ADOBE, SRGB),
        (SRGB, MAC),
        (MAC, SRGB),
        (BT709, SRGB),
        (SRGB, BT709),
        (BT709, ADOBE),
        (ADOBE, BT709),
        (SRGB, LINEAR),
        (BT709, LINEAR),
        (LINEAR, SRGB),
        (LINEAR, BT709),
        (LINEAR, MAC),
        (LINEAR, ADOBE),
    ],
    ids=lambda curve: curve.name,
)
def test_the_curve_that_makes_black_a_steady_share_is_found(curve, read):
    found = told_by_levels(drawn(curve, read))
    assert found.contradicted
    if (
        curve.kind == "gamma"
    ):  # powers of one another leave the same share steady: only inks are more or less common
        assert found.curve.kind == "gamma"
        assert found.odds[curve] > found.surer / 2
    else:
        assert found.curve == curve
    assert found.unsteady == (curve != LINEAR or read.kind != "gamma")


def test_powers_of_one_another_are_left_to_how_white_grows_with_light():
    photos = drawn(ADOBE, LINEAR)
    assert not told_by_levels(photos).contradicted  # an ink of a quarter of white there may be
    assert not told_by_levels(photos, Power(1.0, 0.03)).contradicted
    assert told_by_levels(photos, Power(0.455, 0.03)).curve == ADOBE
    assert told_by_levels(photos, Power(0.455, 0.03)).contradicted


def test_a_beam_or_a_second_light_alone_is_no_curve():
    for power in (0.45, 0.8, 1.3, 2.2):
        assert not told_by_levels(drawn(LINEAR, LINEAR), Power(power, 0.02)).contradicted
        assert not told_by_levels(drawn(SRGB, SRGB), Power(power, 0.02)).contradicted


def test_levels_of_the_files_are_undone_with_the_curve():
    """A black level of the sensor that the manifest gives."""
    own = Encoding("srgb", black=0.06, white=0.95)
    code = np.linspace(0.06, 0.95, 1 << 14)
    light = own.linear(code[:, None], 1)[:, 0]
    right = Encoding("gamma", 2.2, black=0.06, white=0.95).linear(code[:, None], 1)[:, 0]
    photos = []
    for one in drawn(LINEAR, LINEAR):
        white, black = (np.interp(level, light, right) for level in (one.white, one.black))
        photos.append(replace(one, white=white, black=black, encoding=replace(own, kind="gamma", gamma=2.2)))
    found = told_by_levels(photos)
    assert found.contradicted and found.curve == SRGB
    assert found.best.ink == pytest.approx(INK, rel=0.02)


def test_of_two_curves_that_both_fit_badly_neither_contradicts_the_other():
    """Print whose black is no share of white at all: shine, that comes and goes."""
    rng = np.random.default_rng(8)
    shiny = []
    for one in drawn(LINEAR, LINEAR):
        shine = 1 + 0.3 * np.sin(20 * one.white[:, :1] + rng.uniform(0, 6))
        shiny.append(replace(one, black=one.black * shine))
    assert not told_by_levels(shiny).contradicted


def test_too_little_print_tells_nothing():
    few = [replace(one, white=one.white[:5], black=one.black[:5]) for one in drawn(SRGB, SRGB)]
    assert told_by_levels(few) is None


def test_curves_by_name():
    assert read_curve(Encoding("srgb")) == SRGB
    assert read_curve(Encoding()) == LINEAR
    assert read_curve(Encoding("gamma", ADOBE_GAMMA)) == ADOBE
    assert read_curve(Encoding("curves", curves=(BT709,))) == BT709


def test_a_power_cannot_choose_a_curve_that_the_print_speaks_against():
    """Light of the room, or a lamp that small mirror balls place poorly, makes white grow by any power; under BT.709
    this ink's share would go with the light."""
    found = told_by_levels(drawn(LINEAR, LINEAR, ink=0.08), Power(0.53, 0.07))
    assert not found.contradicted
    assert found.odds.get(BT709, 0.0) <= 0.0
