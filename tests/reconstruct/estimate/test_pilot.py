"""Stray light and views of wrong scale, found by turns with pilot fits."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.pilot import _hides, _with, clean
from photogonio.reconstruct.fit import FitOptions, fit_table
from photogonio.reconstruct.goniometer.read import believed
from photogonio.reconstruct.lobes.families import CORRELATED_SCHLICK, families
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples, samples_table
from photogonio.synthetic.brdf.files import read_brdf
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.goniometer import lobe, regular
from tests.drawn.tables import Plan, simulate

PLAN = Plan(views=14, pixels=1500, level=2, spoiled=0.0)


def seen_of(model="oren-nayar", **parameters):
    return cells_of(simulate(make_brdf(model, parameters), PLAN))


def test_a_view_whose_scale_is_wrong_is_named_and_corrected_and_the_others_stay():
    seen = seen_of()
    wrong = seen.group == 4
    spoiled = seen.with_value(np.where(wrong[:, None], 1.15 * seen.value, seen.value))
    work = clean(spoiled, np.full(14, 0.003), lobes=0, absolute=True)
    assert np.flatnonzero(work.scales.freed).tolist() == [4]
    # found against a model of order 4 of a surface that it cannot follow everywhere
    np.testing.assert_allclose(work.scales.factor[4], 1.15, atol=0.02)
    # the others lose nothing but the binning error, some per cent where facets of twelve degrees meet the horizon
    np.testing.assert_allclose(np.median(work.cells.value[~wrong] / seen.value[~wrong]), 1.0, atol=2e-3)


def test_stray_light_is_taken_away_as_the_pilot_says_and_doubted():
    seen = seen_of()
    true = 0.02 * seen.value

    def stray(cells, model):
        # what a perfect calibration would know: two per cent of what the surface sends out
        return 0.02 * np.maximum(model.evaluate(cells), 0.0)

    without = clean(seen, np.full(14, 0.003), lobes=0, absolute=True)
    work = clean(seen.with_value(seen.value + true), np.full(14, 0.003), lobes=0, absolute=True, stray=stray)
    assert (work.deviation >= without.deviation * 0.99).all()
    # the pilot misses the surface by some per cent, of which two per cent are removed
    np.testing.assert_allclose(np.median(work.cells.value / without.cells.value), 1.0, atol=1e-3)
    np.testing.assert_allclose(np.median(work.stray / true), 1.0, atol=0.02)


def test_of_the_likeliest_so_far_one_lobe_is_tried_again_and_two_are_found_from_one():
    kinds = [LobeSet(), LobeSet((CORRELATED_SCHLICK,), (np.array([0.25]),))]
    other = CORRELATED_SCHLICK.with_beckmann
    for lobes, more in [
        (kinds[1], 0),
        (LobeSet((other,), (np.array([0.2]),)), 1),
        (LobeSet((CORRELATED_SCHLICK, other), (np.array([0.1]), np.array([0.3]))), 0),
    ]:
        work = SimpleNamespace(reference=SimpleNamespace(model=SimpleNamespace(lobes=lobes)))
        assert _with(kinds, work) == kinds + [lobes] * more


def test_a_metal_in_the_light_of_paper_is_no_peak_that_is_as_high_at_any_incidence():
    """Paper opposite the camera, which a metal mirrors toward grazing: a peak of no interface sends on a part of that,
    and the rest of it looks like such a peak."""
    family = next(f for f in families(absolute=True) if f.fresnel == "schlick").with_beckmann
    metal = Model(
        Basis("isotropic", 0),
        np.zeros((1, 3)),
        LobeSet((family,), (np.array([0.2]),)),
        np.array([[0.9, 0.7, 0.4]]),
    )

    def paper(cells, model):
        cosines = np.maximum(np.cos(cells.theta_i), 0.2)[:, None]
        return sum(
            0.15 * np.cos(theta) / cosines * np.maximum(model.evaluate(opposite(cells, theta)), 0.0)
            for theta in np.radians([60.0, 70.0, 80.0])
        )

    def opposite(cells, theta):
        return Cells.of_angles(np.full(len(cells), theta), cells.theta_r, np.full(len(cells), np.pi))

    seen = seen_of("ggx-conductor", roughness=0.2)
    noise = 1.0 + 0.01 * np.random.default_rng(4).normal(size=seen.value.shape)
    true = paper(seen, metal)
    seen = replace(seen.with_value((metal.evaluate(seen) + true) * noise), turn=None)
    work = clean(seen, np.full(14, 0.003), lobes=None, absolute=True, free_peaks=True, stray=paper)
    assert not any(family.peak for family in work.reference.model.lobes.families)
    assert np.sqrt(np.mean((work.stray - true) ** 2)) < 0.05 * np.sqrt(np.mean(true**2))


@pytest.mark.parametrize("tails", [0.0, 0.3])
def test_core_and_tails_of_one_interface_are_tried_where_photos_tell_two_lobes(tails, tmp_path):
    """Slopes of 0.12, of a part of the surface thrice that, over a ground: wider than what is called narrow. Of two
    coats each may have an index of its own, which toward grazing is another surface."""
    lobe = {
        "model": "mirror",
        "distribution": "ggx",
        "masking": "correlated",
        "fresnel": "dielectric",
        "f0": 0.04,
    }
    parts = [lobe | {"roughness": 0.12, "weight": [1.0 - tails]}]
    parts += [lobe | {"roughness": 0.36, "weight": [tails]}] if tails else []
    surface = {
        "format": "photogonio-brdf",
        "version": 2,
        "quantity": "brdf",
        "symmetry": "isotropic",
        "order": 0,
        "channels": ["Y"],
        "modes": [[0, 0, 0]],
        "coefficients": [[0.3]],
        "lobes": parts,
        "scale": "absolute",
    }
    (tmp_path / "surface.json").write_text(json.dumps(surface))
    seen = cells_of(simulate(read_brdf(tmp_path / "surface.json"), PLAN))
    assert not seen.peaked
    found = clean(seen, np.full(14, 0.003), lobes=None, absolute=True).pilots
    both = [one for one in found if [f.fresnel for f in one.model.lobes.families] == ["dielectric"] * 2]
    assert len(both) == (1 if tails else 0)
    assert not tails or found[-1].cost == min(one.cost for one in found)


@pytest.mark.parametrize(("straight", "hides"), [(0.0, True), (0.02, False)])
def test_no_lobe_hides_from_cells_to_shine_beyond_them(straight, hides):
    """An interface that reflects nothing straight down is all there is toward grazing, where nothing was seen."""
    whole, part = families(absolute=True)[0], replace(families(absolute=True)[0], absolute=False)
    lobes = LobeSet((whole, part), (np.array([0.02]), np.array([0.08])))
    own = np.concatenate([[straight], np.full(len(part.upper_bounds()), 0.02)])[:, None]
    one = SimpleNamespace(model=Model(Basis("isotropic", 0), np.zeros((1, 1)), lobes, own))
    assert len(whole.upper_bounds()) == 1 and not whole.has_ground
    assert _hides(one) == hides
    alone = Model(Basis("isotropic", 0), np.zeros((1, 1)), LobeSet((whole,), (np.array([0.3]),)), own[:1])
    assert not _hides(SimpleNamespace(model=alone))  # with nothing beside it, it is what the cells show


def test_asked_numbers_of_lobes_are_the_only_ones_tried():
    seen = seen_of("plastic", roughness=0.3)
    tried = {
        asked: {
            len(p.model.lobes.families)
            for p in clean(seen, np.full(14, 0.003), lobes=asked, absolute=True).pilots
        }
        for asked in (0, 1)
    }
    assert tried == {0: {0}, 1: {1}}


def test_what_is_doubted_of_a_contradicting_photos_cells_goes_with_them():
    """Of a narrow gloss, whose cells are doubted where a peak may be displaced. One photo's values are those of a light
    half a radian away."""
    seen = seen_of("plastic", roughness=0.1)
    wrong = seen.group == 4
    other = np.cos(np.clip(seen.theta_i + 0.5 * np.cos(seen.dphi), 0.0, 1.4)) / np.cos(seen.theta_i)
    value = np.where(wrong[:, None], other[:, None] * seen.value, seen.value)
    spoiled = replace(seen.with_value(value), peaked=True, doubt=1e-3 * seen.value)
    work = clean(spoiled, np.full(14, 0.003), lobes=1, absolute=True)
    assert seen.groups[4] in work.discordant
    left = ~np.isin(np.array(seen.groups)[seen.group], work.discordant)
    assert len(work.cells) == len(work.stray) == len(work.binning) == left.sum()


def silver(roughness):
    """Metal whose slopes have no tails: black but for its lobe."""
    lobes = LobeSet((CORRELATED_SCHLICK.with_beckmann,), (np.array([roughness]),))
    return Model(Basis("isotropic", 0), np.zeros((1, 3)), lobes, np.full((1, 3), 0.95))


def flank_of(roughness, clipped, remnant):
    """Cells of silver whose pixels within ``clipped`` degrees of the half vector were saturated; elsewhere something
    of the stray light, up to ``remnant``, is left on them."""
    seen = seen_of("lambert")
    between = np.cos(seen.theta_i) * np.cos(seen.theta_r)
    between += np.sin(seen.theta_i) * np.sin(seen.theta_r) * np.cos(seen.dphi)
    cos_n = (np.cos(seen.theta_i) + np.cos(seen.theta_r)) / np.sqrt(2 + 2 * between)
    seen = seen.take(cos_n < np.cos(np.radians(clipped)))
    rng = np.random.default_rng(0)
    value = silver(roughness).evaluate(seen) * (1 + 0.01 * rng.normal(size=(len(seen), 3)))
    return replace(seen.with_value(value + remnant * rng.uniform(0, 1, (len(seen), 1))), turn=None)


def test_the_flank_of_a_clipped_metal_tells_its_roughness():
    """With tails a coat over a ground does better than the metal that it is."""
    work = clean(flank_of(0.15, 14.0, 3e-3), np.full(14, 0.003), lobes=1, absolute=True)
    lobe = work.reference.model.lobes
    assert (lobe.families[0].distribution, lobe.families[0].fresnel) == ("beckmann", "schlick")
    np.testing.assert_allclose(lobe.shapes[0][0], 0.15, rtol=0.03)


def test_cells_that_are_all_but_black_contradict_nothing():
    work = clean(flank_of(0.2, 12.0, 1e-3), np.full(14, 0.003), lobes=1, absolute=True)
    assert work.contradiction < 0.05 and not work.discordant


def test_rows_of_next_to_nothing_but_tails_tell_a_gloss_without_any():
    """A metal of Gaussian slopes seen anywhere, to 1 % and 2e-4 / sr: of lobes with tails the likeliest is one of the
    wrong kind of Fresnel's term, and that kind without tails is worse; the right one was not tried."""
    rng = np.random.default_rng(2)
    theta_i, theta_r = np.arccos(rng.uniform(0.2, 1.0, (2, 900)))
    dphi = rng.uniform(0.0, 2.0 * np.pi, 900)
    metal = LobeSet((CORRELATED_SCHLICK.with_beckmann,), (np.array([0.2]),))
    basis = Basis("isotropic", 0)
    model = Model(basis, np.zeros((1, 1)), metal, np.full((1, 1), 0.8))
    true = model.evaluate(Cells.of_angles(theta_i, theta_r, dphi))
    sigma = np.hypot(0.01 * true, 2e-4)
    value = true + sigma * rng.standard_normal(true.shape)
    rows = GoniometerSamples(theta_i, np.zeros(900), theta_r, dphi, value, sigma, ("Y",))
    found = clean(cells_of(samples_table(rows)), np.full(1, 0.003), lobes=None, absolute=True).reference
    family, shape = found.model.lobes.families[0], found.model.lobes.shapes[0]
    assert (family.distribution, family.fresnel) == ("beckmann", "schlick")
    # some 60 rows lie within the peak: 1 % of f there is 1 % of the density, half as much of the roughness
    np.testing.assert_allclose(shape[0], 0.2, rtol=0.005)


@pytest.mark.parametrize(
    ("power", "step"), [(50.0, 0.005), pytest.param(200.0, 0.01, marks=pytest.mark.long)]
)
def test_a_black_gloss_whose_digits_are_cut_off_is_neither_doubted_nor_guessed(power, step):
    """Most rows are truly 0, and the peak lies between rows 10 degrees and more apart: the albedo is that of the lobe,
    0.2 but for what lies below the horizon, within the share of it that the digits cut off."""
    theta_i, theta_r, dphi = regular()
    value = 0.3 * (power + 2.0) / (2.0 * np.pi) * lobe(theta_i, theta_r, dphi, power)
    value = np.round(value / step) * step
    samples = believed(GoniometerSamples(theta_i, 0.0 * theta_i, theta_r, dphi, value[:, None], None, ("Y",)))
    assert samples.left_out == 0 and np.mean(value == 0.0) > 0.7
    found = fit_table(samples_table(samples), FitOptions(symmetry="isotropic"))
    assert [one.about == "mirror" for one in found.model.lobes.families] == [True] and not found.brdf.lobes
    assert found.brdf.bihemispherical_albedo()[0] == pytest.approx(0.2, rel=0.01)
