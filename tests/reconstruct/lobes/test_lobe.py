"""Lobes against an evaluator written from docs/modes.md alone (tests/file_oracle.py), and their physics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf
from tests import file_oracle
from tests.drawn.brdfs import COATS, LISTS, MIRRORS, RETROS, brdf_of, coat, directions, mirror


@pytest.mark.parametrize("symmetry", LISTS)
def test_mirror_lobes_peaks_and_modes_are_the_pages(tmp_path, symmetry):
    incident, exit = directions(2000)
    for k, lobe in enumerate([*MIRRORS, *RETROS]):
        brdf = brdf_of(lobe, symmetry=symmetry, seed=k)
        brdf.save(tmp_path / "b.json")
        page = file_oracle.f_of(tmp_path / "b.json", incident, exit)
        scale = np.abs(page).max(0)  # modes cancel to nothing in places
        assert np.abs(brdf(incident, exit) - page).max() <= 1e-9 * scale.max()
        alone = brdf_of(lobe, symmetry=symmetry, order=0)
        alone = Brdf(0, alone.channels, alone.modes, 0 * alone.coefficients, alone.standard_errors,
                     symmetry=symmetry, lobes=(lobe,))  # fmt: skip
        alone.save(tmp_path / "b.json")
        page = file_oracle.f_of(tmp_path / "b.json", incident, exit)
        some = page > 1e-200
        np.testing.assert_allclose(alone(incident, exit)[some], page[some], rtol=1e-9)


@pytest.mark.parametrize(
    "lobe", COATS, ids=lambda lobe: f"{lobe.roughness} {lobe.distribution} {lobe.masking}"
)
def test_coats_are_the_pages_to_what_their_quadrature_gives(tmp_path, lobe):
    incident, exit = directions(60)
    brdf = brdf_of(lobe, order=0, seed=5)
    brdf = Brdf(0, brdf.channels, brdf.modes, np.abs(brdf.coefficients), brdf.standard_errors, lobes=(lobe,))
    brdf.save(tmp_path / "b.json")
    page = file_oracle.f_of(tmp_path / "b.json", incident, exit)
    np.testing.assert_allclose(brdf(incident, exit), page, rtol=1e-4)


@pytest.mark.parametrize(
    ("roughness", "distribution"),
    [((0.4, 0.2), "ggx"), ((0.45, 0.15), "beckmann"), ((0.1, 0.6), "ggx"), ((0.06, 0.35), "beckmann")],
)
def test_a_coat_of_two_roughnesses_is_the_pages(tmp_path, roughness, distribution):
    incident, exit = directions(40, lowest=85.0)
    lobe = coat(roughness, azimuth=0.7, distribution=distribution)
    brdf = brdf_of(lobe, symmetry="reciprocal", order=0, seed=2)
    brdf = replace(brdf, coefficients=np.abs(brdf.coefficients))  # nothing cancels
    brdf.save(tmp_path / "b.json")
    page = file_oracle.f_of(tmp_path / "b.json", incident, exit)
    np.testing.assert_allclose(brdf(incident, exit), page, rtol=1e-4)


@pytest.mark.parametrize("lobe", [*MIRRORS[::3], *RETROS, *COATS[::2], coat((0.4, 0.2), azimuth=0.7)])
def test_lobes_are_reciprocal_positive_and_send_out_no_more_than_comes_in(lobe):
    incident, exit = directions(500)
    brdf = Brdf(0, ("R", "G", "B"), np.empty((0, 3), int), np.empty((0, 3)), np.empty((0, 3)), lobes=(lobe,))
    f = brdf(incident, exit)
    assert (f >= 0.0).all()
    np.testing.assert_allclose(f, brdf(exit, incident), rtol=1e-9, atol=1e-300)
    assert (brdf.directional_albedo(np.radians([0.0, 40.0, 75.0, 85.0]), 0.3) <= 1.0 + 1e-6).all()


def test_albedos_are_the_integrals_of_f():
    """Against a plain rule over the exit hemisphere: 300 x 300 midpoints, even in cos^2 theta."""
    brdf = brdf_of(coat(0.4), mirror((0.5, 0.3), azimuth=0.4), order=0)
    cos = np.sqrt((np.arange(300) + 0.5) / 300)
    phi = 2 * np.pi * (np.arange(300) + 0.5) / 300
    theta_r, phi_r = (grid.ravel() for grid in np.meshgrid(np.arccos(cos), phi))
    for theta_i, phi_i in ((0.1, 0.0), (0.9, 1.0)):
        sent = np.pi * brdf.evaluate(theta_i, phi_i, theta_r, phi_r).mean(0)
        np.testing.assert_allclose(brdf.directional_albedo(theta_i, phi_i), sent, rtol=2e-3)
