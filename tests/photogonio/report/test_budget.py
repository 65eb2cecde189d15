"""The uncertainty budget: shares of the variance that the file gives, each where it belongs."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.errors import RelativeTable, Uncertain
from photogonio.reconstruct.brdf.spread import albedo_error
from photogonio.reconstruct.lobes.lobe import Lobe
from photogonio.reconstruct.modes.basis import isotropic_modes
from photogonio.report.budget import BEYOND, MOST_MODES, budget_numbers, budget_sections, budgets

NAMES = ("roughness", "f0", "weight", "ground")
EVERYWHERE = RelativeTable(np.array([45.0]), np.array([45.0]), np.array([90.0]), np.full((1, 1, 1), 0.003))


def plastic(order=0, correlation=0.0):
    modes, one = isotropic_modes(order), np.ones(2)
    names = tuple(f"S {n} {m} {l}" for n, m, l in modes) + tuple(f"lobe 0 {name}" for name in NAMES)
    errors = np.full((len(names), 2), 1e-3)
    covariance = np.full((2, len(names), len(names)), correlation * 1e-6)
    covariance[:, range(len(names)), range(len(names))] = 1e-6
    coat = Lobe(0.3, 0.04 * one, one, "coat", fresnel="dielectric", ground=np.array([0.3, 0.1]))
    known = Uncertain(names, errors, covariance, 0.005, EVERYWHERE)
    value = np.full((len(modes), 2), 0.01)
    return Brdf(order, ("R", "G"), modes, value, errors[: len(modes)], lobes=(coat,), uncertainty=known)


@pytest.mark.parametrize("correlation", [0.0, 0.4])
def test_shares_add_up_and_errors_are_the_files(correlation):
    brdf = plastic(correlation=correlation)
    albedo, straight, mirrored = budgets(brdf)
    for one in (albedo, straight, mirrored):
        np.testing.assert_allclose(sum(source.share for source in one.sources), 1.0, rtol=1e-9)
    np.testing.assert_allclose(albedo.error, albedo_error(brdf), rtol=1e-9)
    angles = np.radians([45.0, 0.0, 0.0, 180.0])
    np.testing.assert_allclose(straight.error, brdf.standard_error(*angles), rtol=1e-9)
    np.testing.assert_allclose(straight.value, brdf.evaluate(*angles), rtol=1e-12)


def test_without_correlation_a_share_is_the_square_of_sensitivity_times_error():
    for one in budgets(plastic()):
        for source in one.sources:
            np.testing.assert_allclose(
                source.share, (source.sensitivity * source.error / one.error) ** 2, rtol=1e-9, atol=1e-15
            )
    names = [source.name for source in budgets(plastic())[0].sources]
    assert names == ["S 0 0 0", *(f"lobe 0 {name}" for name in NAMES), BEYOND["scale"], BEYOND["misfit"]]


def test_sensitivities_are_derivatives():
    """By the ground, in the mirror direction: what enters and leaves through the coat, over pi."""
    brdf = plastic()
    mirrored = budgets(brdf)[2]
    ground = next(source for source in mirrored.sources if source.name == "lobe 0 ground")
    lobe = brdf.lobes[0]
    more = replace(brdf, lobes=(replace(lobe, ground=lobe.ground + 0.1),))
    angles = np.radians([45.0, 0.0, 45.0, 180.0])
    np.testing.assert_allclose(
        ground.sensitivity, (more.evaluate(*angles) - brdf.evaluate(*angles)) / 0.1, rtol=1e-6
    )


def test_many_modes_are_one_source_and_what_is_unknown_has_no_budget():
    brdf = plastic(order=4)
    assert len(brdf.modes) > MOST_MODES
    first = budgets(brdf)[0].sources[0]
    assert first.name == f"{len(brdf.modes)} modes together" and np.isnan(first.value).all()
    np.testing.assert_allclose(sum(source.share for source in budgets(brdf)[0].sources), 1.0, rtol=1e-9)
    assert budgets(replace(brdf, uncertainty=None)) == ()


def test_the_report_shows_the_channel_that_is_known_worst():
    brdf = plastic()
    sections = budget_sections(brdf)
    assert [section.title for section in sections] == [one["of"] for one in budget_numbers(brdf)]
    albedo = budgets(brdf)[0]
    worst = brdf.channels[int(np.argmax(albedo.error / albedo.value))]
    assert f"Albedo in {worst}" in sections[0].text
    assert sections[0].table.rows[-1][-1] == "100 %"
