"""The lamp's strength comes back from a drawn white patch; patches that lie are not believed; paper is tied."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.radiometry.patch import UNEVEN, NoStrength
from photogonio.calib.radiometry.readings import StrengthReadings, _mean
from photogonio.calib.radiometry.scale import tie
from photogonio.calib.remarks import Remarks
from photogonio.calib.rig.gaussian import RigExpected
from tests.drawn.patches import FAR, PAPER, PATCH, SET, STRENGTH, STRENGTHS, strength, tied, told
from tests.drawn.setups import BOARD


def test_paper_stands_in_for_a_patch_that_is_clipped():
    readings = told(STRENGTHS)
    readings["3.png"] = replace(readings["3.png"], patch=NoStrength("the patch is clipped"))
    values, scale, remarks = tied(readings)
    assert scale == "absolute"
    for name, true in STRENGTHS.items():
        np.testing.assert_allclose(values[name].value, true, rtol=1e-9)
    assert values["3.png"].source == "board"
    assert values["2.png"].source == "white patch"
    assert values["3.png"].error.min() > 0
    np.testing.assert_allclose(remarks.residuals["paper_reflectance"], PAPER * np.pi, rtol=1e-9)


def test_black_print_stands_in_where_the_paper_is_clipped_too():
    readings = told(STRENGTHS)
    readings["3.png"] = replace(
        readings["3.png"], patch=NoStrength("the patch is clipped"), paper=NoStrength("too little")
    )
    values, _, _ = tied(readings)
    np.testing.assert_allclose(values["3.png"].value, STRENGTHS["3.png"], rtol=1e-9)


def test_a_patch_that_contradicts_the_paper_is_not_believed():
    readings = told(STRENGTHS)
    readings["1.png"] = replace(readings["1.png"], patch=strength(0.8 * STRENGTHS["1.png"]))
    values, _, remarks = tied(readings)
    np.testing.assert_allclose(values["1.png"].value, STRENGTHS["1.png"], rtol=1e-9)
    assert any(w.startswith("1.png") and "not believed" in w for w in remarks.warnings)


@pytest.mark.parametrize(
    ("lost", "gained", "blamed"), [(0.12, 0.01, "paper"), (0.12, 0.0, "patch"), (0.01, 0.04, "")]
)
def test_where_white_has_spread_over_black_it_is_the_paper_that_is_not_believed(lost, gained, blamed):
    """White is darker and black lighter, as out of focus; black as it was, it is the patch that is too bright."""
    readings, true = told(STRENGTHS), STRENGTHS["1.png"]
    paper = (1 - lost) * true * PAPER
    readings["1.png"] = replace(
        readings["1.png"], paper=strength(paper), black=strength((0.05 + gained) * paper)
    )
    values, _, remarks = tied(readings)
    said = [w for w in remarks.warnings if w.startswith("1.png") and "not believed" in w]
    assert len(said) == (blamed != "")
    assert all(f"{blamed} is not believed" in w for w in said)
    if blamed == "paper":
        np.testing.assert_allclose(values["1.png"].value, true, rtol=1e-9)
        assert values["1.png"].source == "white patch"
    if blamed == "patch":
        np.testing.assert_allclose(values["1.png"].value, (1 - lost) * true, rtol=1e-9)


def test_of_three_patches_the_darker_ones_are_not_believed():
    """Too few to outvote: shadows only darken."""
    readings = told(dict(list(STRENGTHS.items())[:3]))
    for name in ("0.png", "2.png"):
        readings[name] = replace(readings[name], patch=strength(0.85 * STRENGTHS[name]))
    values, _, remarks = tied(readings)
    for name in readings:
        np.testing.assert_allclose(values[name].value, STRENGTHS[name], rtol=1e-9)
    assert remarks.codes().count("patch-not-believed") == 2


@pytest.mark.parametrize("gamma", [1.0, 2.2])
def test_photos_that_are_not_linear_as_told_show_in_patch_and_paper(gamma):
    """A lamp lights the patch more or less than the paper, as it stands; codes of a power of the light, taken for
    light and divided by what the geometry expects, keep that in their ratio."""
    readings = told(STRENGTHS)
    for name, aside in zip(STRENGTHS, (0.7, 0.8, 0.9, 1.1, 1.2, 1.4), strict=True):
        patch = STRENGTHS[name] * aside ** (1.0 / gamma - 1.0)
        readings[name] = replace(readings[name], patch=strength(patch))
    _, _, remarks = tied(readings)
    assert ("patch-and-paper-scatter" in remarks.codes()) == (gamma != 1.0)


def test_patches_that_contradict_one_another_in_all_photos_are_told():
    readings = told(STRENGTHS)
    alike = {n: replace(r, patch=_mean([r.patch, r.patch])) for n, r in readings.items()}
    wrong = {
        n: replace(r, patch=_mean([r.patch, strength(0.7 * r.patch.value)])) for n, r in readings.items()
    }
    assert not tied(alike)[2].warnings
    values, _, remarks = tied(wrong)
    assert any("contradict one another" in w for w in remarks.warnings)
    for name, true in STRENGTHS.items():
        np.testing.assert_allclose(values[name].value, true, rtol=1e-9)


def test_a_patch_that_makes_the_paper_whiter_than_white_lies_in_shadow():
    readings = told(STRENGTHS)
    for name in list(readings)[:4]:  # most of them: a median would believe these
        readings[name] = replace(readings[name], patch=strength(0.5 * STRENGTHS[name]))
    values, scale, remarks = tied(readings)
    assert scale == "absolute"
    for name, true in STRENGTHS.items():
        np.testing.assert_allclose(values[name].value, true, rtol=1e-9)
    assert sum("shadow" in w for w in remarks.warnings) == 4


def test_clipped_patches_are_named():
    readings = told(STRENGTHS)
    for name in ("1.png", "3.png"):
        readings[name] = replace(readings[name], patch=NoStrength("the patch is clipped"))
    _, _, remarks = tied(readings)
    assert "the patch is clipped, in 2 of 6 photos (1.png, 3.png)" in remarks.warnings


def test_without_a_patch_the_scale_is_relative_but_the_proportions_hold():
    readings = {
        n: replace(r, patch=NoStrength("the set has no white patch")) for n, r in told(STRENGTHS).items()
    }
    values, scale, _ = tied(readings, replace(SET, white_patches=()))
    assert scale == "relative"
    ratios = [values[n].value / s for n, s in STRENGTHS.items()]
    np.testing.assert_allclose(ratios, np.broadcast_to(ratios[0], (6, 3)), rtol=1e-9)


@pytest.mark.parametrize("patches, board", [((PATCH,), None), ((), BOARD), ((), None)])
def test_lamps_that_nothing_read_measures_are_equal_more_or_less_and_that_is_told(patches, board):
    """As surely as the manifest has it, where nothing was laid out to measure them."""
    patch = "the patch is clipped" if patches else "the set has no white patch"
    blind = StrengthReadings(*(NoStrength(p) for p in (patch, "too little lit paper is seen", "no print")))
    values, scale, remarks = tied(
        dict.fromkeys(STRENGTHS, blind), replace(SET, white_patches=patches, board=board)
    )
    measured = bool(patches or board)
    assert scale == "relative"
    for one in values.values():
        np.testing.assert_array_equal(one.value, 1.0)
        assert (0.01 < (one.error / one.value).max() < 0.05) == measured
        assert one.error.any() == measured
    assert any("equally strong" in w for w in remarks.warnings) == measured
    assert any("clipped" in w for w in remarks.warnings) == bool(patches)


def test_patches_that_are_unevenly_lit_are_better_than_none():
    """If all are, the scale is theirs, with their unevenness for its error; where one is evenly lit it alone counts."""
    uneven = {
        n: replace(r, patch=replace(NoStrength(UNEVEN), rough=replace(r.patch, error=0.06 * r.patch.value)))
        for n, r in told(STRENGTHS).items()
    }
    values, scale, remarks = tied(dict(uneven))
    assert scale == "absolute" and any("no white patch is evenly lit" in w for w in remarks.warnings)
    assert remarks.residuals["uneven_patches_error"] == pytest.approx(0.06)
    for name, true in STRENGTHS.items():
        np.testing.assert_allclose(values[name].value, true, rtol=1e-9)
    wrong = {
        n: replace(r, patch=replace(r.patch, rough=strength(0.7 * STRENGTHS[n]))) for n, r in uneven.items()
    }
    values, _, remarks = tied(wrong | {"2.png": told(STRENGTHS)["2.png"]})
    np.testing.assert_allclose(values["4.png"].value, STRENGTHS["4.png"], rtol=1e-9)
    assert not any("no white patch" in w for w in remarks.warnings)


def test_lamps_of_stated_proportions_are_put_on_the_papers_scale():
    """What shines beside them is measured in radiance, and can then be weighed against them."""
    unknown = NoStrength("the set has no white patch")
    readings = {n: replace(r, patch=unknown) for n, r in told(STRENGTHS).items()}
    given = {n: 1e-3 * s for n, s in STRENGTHS.items()}
    lights = dict.fromkeys(readings, FAR)
    values, scale = tie(replace(SET, white_patches=()), readings, lights, given, Remarks())
    assert scale == "relative"
    for name, true in STRENGTHS.items():  # as of paper that is perfectly white
        np.testing.assert_allclose(values[name].value, true * PAPER * np.pi, rtol=1e-9)
        assert values[name].source == "board" and not values[name].error.any()


def test_a_lamp_that_nothing_measures_is_taken_as_the_others_and_said_so():
    same = {n: STRENGTH for n in STRENGTHS}
    readings = told(same)
    readings["5.png"] = StrengthReadings(NoStrength("clipped"), NoStrength("dark"), NoStrength("dark"))
    values, _, remarks = tied(readings)
    np.testing.assert_allclose(values["5.png"].value, STRENGTH, rtol=1e-9)
    assert any(w.startswith("5.png") and "taken as the others" in w for w in remarks.warnings)


def test_lamps_that_agree_are_one_lamp_and_surer():
    rng = np.random.default_rng(4)
    values, _, remarks = tied(told({n: STRENGTH * (1 + 0.001 * rng.normal()) for n in STRENGTHS}))
    assert remarks.residuals["lamps_taken_as_equal"]
    found = np.array([v.value for v in values.values()])
    alone = [abs(0.001 * z) for z in np.random.default_rng(4).normal(size=6)]
    assert np.mean(np.abs(found / STRENGTH - 1)) < np.mean(alone)
    np.testing.assert_allclose(found, np.broadcast_to(STRENGTH, found.shape), rtol=0.002)
    differing, _, other = tied(told(STRENGTHS))
    assert "lamps_taken_as_equal" not in other.residuals
    assert np.ptp([v.value[0] for v in differing.values()]) > STRENGTH[0]


def test_a_lamp_that_differs_from_otherwise_equal_ones_keeps_its_own_strength():
    one_off = {n: STRENGTH * (1.1 if n == "3.png" else 1.0) for n in STRENGTHS}
    values, _, remarks = tied(told(one_off))
    assert remarks.residuals["lamps_taken_as_equal"]
    np.testing.assert_allclose(values["3.png"].value, 1.1 * STRENGTH, rtol=0.003)
    np.testing.assert_allclose(values["1.png"].value, STRENGTH, rtol=0.003)


def test_without_a_believed_patch_the_paper_keeps_the_proportions():
    refused = {
        n: replace(r, patch=NoStrength("the patch lies in shadow")) for n, r in told(STRENGTHS).items()
    }
    values, scale, _ = tied(refused)
    assert scale == "relative"
    ratios = [values[n].value / s for n, s in STRENGTHS.items()]
    np.testing.assert_allclose(ratios, np.broadcast_to(ratios[0], (6, 3)), rtol=1e-9)


def test_paper_that_other_sets_of_the_rig_know_makes_the_scale_absolute():
    readings = {n: replace(r, patch=NoStrength("no patch")) for n, r in told(STRENGTHS).items()}
    lights = dict.fromkeys(readings, FAR)
    given = {n: np.ones_like(np.atleast_1d(STRENGTHS[n])) for n in readings}
    channels = len(next(iter(given.values())))
    error = 0.004
    paper = RigExpected("paper", np.log(np.full(channels, PAPER * np.pi)), error**2 * np.eye(channels), 9)
    values, scale = tie(replace(SET, white_patches=()), readings, lights, given, Remarks(), paper)
    assert scale == "absolute"
    for name, true in STRENGTHS.items():
        np.testing.assert_allclose(values[name].value, true, rtol=1e-9)
        assert (values[name].error >= error * values[name].value * 0.99).all()  # all share the paper's
