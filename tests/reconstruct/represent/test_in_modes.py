import json
from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct import fit
from photogonio.reconstruct.brdf.brdf import Brdf, load_brdf
from photogonio.reconstruct.brdf.errors import Uncertain
from photogonio.reconstruct.goniometer.sampled import GoniometerSamples
from photogonio.reconstruct.lobes.lobe import Lobe
from photogonio.reconstruct.represent.in_modes import CLOSE, DROPPED, JUDGED, said_in_modes
from photogonio.reconstruct.table.goniometer_csv import samples_table

PAGE = {"mirror", "coat", "retro"}  # models of lobes that a reader of version 2 knows
NAMES = ("S 0 0 0", "lobe 0 roughness", "lobe 0 weight", "lobe 1 roughness", "lobe 1 f0", "lobe 1 weight")


def pairs(count: int = 4000):
    """Half of them about the mirror direction."""
    rng = np.random.default_rng(3)
    theta_i, theta_r = np.arccos(1.0 - rng.random((2, count)) * (1.0 - np.cos(np.radians(75.0))))
    dphi = np.pi * rng.random(count)
    half = count // 2
    theta_r[:half] = np.abs(theta_i[:half] + 0.1 * rng.normal(size=half))
    dphi[:half] = np.pi - np.abs(0.1 * rng.normal(size=half))
    return theta_i, theta_r, dphi


def with_peak(roughness: float = 0.1) -> Brdf:
    """A round peak before a mirror lobe, over a ground, of two channels, with a covariance."""
    one = np.ones(2)
    lobes = (
        Lobe(roughness, one, np.array([0.3, 0.1]), "round", distribution="beckmann"),
        Lobe(0.4, 0.05 * one, one),
    )
    root = np.random.default_rng(1).normal(size=(2, len(NAMES), len(NAMES))) * 3e-3
    covariance = root @ np.swapaxes(root, 1, 2)
    errors = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).T
    return Brdf(
        order=0,
        channels=("a", "b"),
        modes=np.zeros((1, 3), int),
        coefficients=np.array([[0.5, 0.2]]),
        standard_errors=errors[:1],
        lobes=lobes,
        uncertainty=Uncertain(NAMES, errors, covariance),
    )


@pytest.mark.parametrize("roughness", [0.09, 0.2, 0.7])
def test_a_round_peak_said_in_modes_is_the_same_function(roughness):
    before = with_peak(roughness)
    said = said_in_modes(before)
    after = said.brdf
    assert {lobe.model for lobe in after.lobes} <= PAGE and len(said.peaks) == 1
    assert said.lost <= np.hypot(CLOSE["round"], DROPPED) * (1.0 + 1e-12)
    theta_i, theta_r, dphi = pairs()
    true, found = (one.evaluate(theta_i, 0.0, theta_r, dphi) for one in (before, after))
    # the waves left out gather about the peak, where they may be some ten times their root mean square
    assert np.abs(found - true).max() <= 10.0 * said.lost * true.max()
    np.testing.assert_allclose(after.bihemispherical_albedo(), before.bihemispherical_albedo(), rtol=1e-3)


@pytest.mark.parametrize("roughness", [0.25, 0.5])
def test_a_cosine_power_of_the_half_vector_said_in_modes_is_the_same_but_where_both_graze(roughness):
    one = np.array([0.3, 0.1])
    before = replace(
        with_peak(),
        lobes=(Lobe(roughness, np.ones(2), one, "blinn-phong", distribution="phong"),),
        uncertainty=None,
    )
    said = said_in_modes(before)
    assert not said.brdf.lobes and len(said.peaks) == 1
    assert said.lost <= np.hypot(1.0, 0.5) * CLOSE["blinn-phong"] * (1.0 + 1e-12)  # modes dropped add half
    theta_i, theta_r, dphi = pairs()
    true, found = (one.evaluate(theta_i, 0.0, theta_r, dphi) for one in (before, said.brdf))
    below = (np.maximum(theta_i, theta_r) < JUDGED) & (np.minimum(theta_i, theta_r) < np.radians(60.0))
    peak = before.lobes[0].evaluate(theta_i, theta_r, dphi)
    rms = np.sqrt(np.mean((found - true)[below] ** 2, axis=0) / np.mean(peak[below] ** 2, axis=0))
    assert (rms <= 2.0 * said.lost).all()


def test_its_errors_go_into_the_modes():
    """Of f everywhere, and of the lobe that is left, whose number has become another."""
    before = with_peak(0.2)
    after = said_in_modes(before).brdf
    theta_i, theta_r, dphi = (angle[::10] for angle in pairs())
    true, found = (one.standard_error(theta_i, 0.0, theta_r, dphi) for one in (before, after))
    left_out = 10.0 * CLOSE["round"] * before.evaluate(theta_i, 0.0, theta_r, dphi).max()
    assert left_out < 0.5 * true.max()
    np.testing.assert_allclose(found, true, rtol=0.02, atol=left_out)
    names = after.uncertainty.parameters
    assert names[len(after.modes) :] == ("lobe 0 roughness", "lobe 0 f0", "lobe 0 weight")
    np.testing.assert_allclose(
        after.uncertainty.standard_errors[-3:], before.uncertainty.standard_errors[-3:], rtol=1e-3
    )


def test_what_modes_leave_out_is_among_the_errors():
    narrow = replace(
        with_peak(0.06), uncertainty=replace(with_peak().uncertainty, covariance=np.zeros((2, 6, 6)))
    )
    said = said_in_modes(narrow)
    assert said.lost > 2.0 * CLOSE["round"]
    theta_i, theta_r, dphi = (angle[::8] for angle in pairs())
    missed = said.brdf.evaluate(theta_i, 0.0, theta_r, dphi) - narrow.evaluate(theta_i, 0.0, theta_r, dphi)
    stated = said.brdf.standard_error(theta_i, 0.0, theta_r, dphi)
    assert 0.5 < np.sqrt(np.mean(stated**2) / np.mean(missed**2)) < 2.0


def test_what_the_file_has_lobes_for_stays_as_it_is():
    plain = replace(with_peak(), lobes=with_peak().lobes[1:], uncertainty=None)
    assert said_in_modes(plain).brdf is plain


def test_an_old_file_with_a_round_peak_is_still_read(tmp_path):
    with_peak().save(tmp_path / "old.json")
    assert [lobe.model for lobe in load_brdf(tmp_path / "old.json").lobes] == ["round", "mirror"]


@pytest.mark.parametrize(
    ("form", "power"), [pytest.param("phong", 50.0, marks=pytest.mark.long), ("blinn", 200.0)]
)
def test_files_of_glossy_tables_hold_nothing_but_lobes_of_the_page(form, power, tmp_path):
    steps = (
        np.radians([0, 15, 30, 45, 60]),
        np.radians([0, 15, 30, 45, 60]),
        np.radians(np.arange(0, 181, 20)),
    )
    theta_i, theta_r, dphi = (grid.ravel() for grid in np.meshgrid(*steps, indexing="ij"))
    across = np.sin(theta_i) * np.sin(theta_r) * np.cos(dphi)
    both = np.cos(theta_i) * np.cos(theta_r)
    about = np.maximum(both - across, 0.0)
    if form == "blinn":
        about = (np.cos(theta_i) + np.cos(theta_r)) / np.sqrt(2.0 + 2.0 * (both + across))
    rng = np.random.default_rng(0)
    value = 0.05 + 0.02 * (power + 2.0) * about**power + 0.002 * rng.normal(size=len(theta_i))
    samples = GoniometerSamples(theta_i, 0.0 * theta_i, theta_r, dphi, value[:, None], None, ("Y",))
    found = fit.fit_table(samples_table(samples), fit.FitOptions(symmetry="isotropic"))
    found.brdf.save(tmp_path / "found.json")
    document = json.loads((tmp_path / "found.json").read_text())
    assert {lobe["model"] for lobe in document["lobes"]} <= PAGE
    assert np.isfinite(document["coefficients"]).all()


@pytest.mark.parametrize(
    ("asked", "tried"),
    [({}, True), ({"order": 2}, False), ({"lobes": 1}, False), ({"order": 0, "lobes": 0}, False)],
)
def test_whoever_asks_for_an_order_or_for_lobes_gets_no_other_modes(asked, tried, monkeypatch):
    class Cleaning(Exception):
        pass

    def caught(*args, free_peaks, **others):
        raise Cleaning(free_peaks)

    monkeypatch.setattr(fit, "clean", caught)
    theta = np.radians(np.linspace(0.0, 60.0, 12))
    value = np.full((12, 1), 0.05)
    samples = GoniometerSamples(theta, 0.0 * theta, theta, 0.0 * theta, value, None, ("Y",))
    with pytest.raises(Cleaning) as found:
        fit.fit_table(samples_table(samples), fit.FitOptions(**asked))
    assert found.value.args == (tried,)
