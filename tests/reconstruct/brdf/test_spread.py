"""What a covariance says of albedos and of BRDFs drawn from it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.errors import RelativeTable, Uncertain
from photogonio.reconstruct.brdf.parameters import mode_names
from photogonio.reconstruct.brdf.spread import albedo_error, drawn
from photogonio.reconstruct.lobes.lobe import Lobe
from photogonio.reconstruct.modes.basis import isotropic_modes

EVERYWHERE = RelativeTable(np.array([45.0]), np.array([45.0]), np.array([90.0]), np.full((1, 1, 1), 0.03))
DRAWS = 1500


def known(brdf: Brdf, names: tuple[str, ...], covariance: np.ndarray, **more) -> Brdf:
    """With a covariance (p, p) that is the same in all channels, each knowing nothing of the others'."""
    both = np.stack([covariance] * len(brdf.channels))
    errors = np.sqrt(np.diagonal(both, axis1=1, axis2=2)).T
    return replace(brdf, uncertainty=Uncertain(names, errors, both, **more))


def matte(value: float = 0.8) -> Brdf:
    one = np.full((1, 1), value)
    return Brdf(0, ("Y",), np.zeros((1, 3), int), one, 0.0 * one)


def with_lobe() -> Brdf:
    lobe = Lobe(0.4, np.array([0.3, 0.6]), np.array([0.5, 0.7]))
    modes = isotropic_modes(2)
    values = np.random.default_rng(0).normal(size=(len(modes), 2))
    return Brdf(2, ("A", "B"), modes, values, np.zeros_like(values), lobes=(lobe,))


def test_the_albedo_of_a_matte_surface_is_half_its_coefficient_and_so_is_its_error():
    brdf = known(matte(), ("S 0 0 0",), np.full((1, 1), 0.02**2), scale=0.01, misfit=EVERYWHERE)
    albedo = 0.4
    np.testing.assert_allclose(brdf.bihemispherical_albedo(), albedo)
    expected = np.hypot(0.5 * 0.02, albedo * np.hypot(0.01, 0.03))
    np.testing.assert_allclose(albedo_error(brdf), expected, rtol=1e-9)


def test_a_lobes_weight_leaves_the_albedo_unsure_by_its_share():
    brdf = with_lobe()
    names = (*mode_names("isotropic", brdf.modes), "lobe 0 weight")
    covariance = np.zeros((len(names), len(names)))
    covariance[-1, -1] = 0.05**2
    bare = replace(brdf, modes=brdf.modes[:0], coefficients=brdf.coefficients[:0])
    whole = bare.bihemispherical_albedo() / brdf.lobes[0].weight  # of a lobe of weight 1
    np.testing.assert_allclose(albedo_error(known(brdf, names, covariance)), 0.05 * whole, rtol=1e-6)


def test_where_nothing_is_known_nothing_is_said():
    assert np.isnan(albedo_error(matte())).all()
    with pytest.raises(InputError, match="does not say how sure"):
        drawn(matte(), 3, 0)
    unsure = replace(matte(), uncertainty=Uncertain(("S 0 0 0",), np.full((1, 1), np.nan)))
    with pytest.raises(InputError, match="does not say how sure"):
        drawn(unsure, 3, 0)


def test_draws_scatter_as_the_covariance_says():
    """A variance of n draws is known to sqrt(2 / n) of itself, a covariance to that of sqrt(both variances)."""
    brdf = with_lobe()
    names = (*mode_names("isotropic", brdf.modes), "lobe 0 weight", "lobe 0 roughness")
    root = 1e-3 * np.random.default_rng(4).normal(size=(len(names), len(names)))
    covariance = root @ root.T
    draws = drawn(known(brdf, names, covariance), DRAWS, seed=1)
    for channel in range(2):
        rows = np.array(
            [[*d.coefficients[:, channel], d.lobes[0].weight[channel], d.lobes[0].axes[0]] for d in draws]
        )
        size = np.sqrt(np.diag(covariance))
        off = (np.cov(rows.T) - covariance) / np.outer(size, size)
        assert np.abs(off).max() < 5.0 * np.sqrt(2.0 / DRAWS)
        centre = [*brdf.coefficients[:, channel], brdf.lobes[0].weight[channel], 0.4]
        assert np.abs((rows.mean(0) - centre) / size).max() < 5.0 / np.sqrt(DRAWS)


def test_the_same_seed_draws_the_same_and_numbers_stay_what_they_may_be():
    brdf = with_lobe()
    names = (*mode_names("isotropic", brdf.modes), "lobe 0 weight", "lobe 0 roughness", "lobe 0 f0")
    brdf = known(brdf, names, 4.0 * np.eye(len(names)))
    first, again = drawn(brdf, 50, 7), drawn(brdf, 50, 7)
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.coefficients, other.coefficients)
        (lobe,) = one.lobes
        assert (lobe.weight >= 0.0).all() and 0.0 < lobe.axes[0] <= 1.0
        assert ((lobe.f0 > 0.0) & (lobe.f0 < 1.0)).all()
    assert len({one.coefficients[0, 0] for one in first}) == 50


def test_f_scatters_as_said_where_numbers_are_held_at_nothing():
    """Two lobes of hardly known weights and a mode that makes up for both: the sum is known far better than any.

    One weight is below nothing on one side and the other on the other, so that mirrored draws are too.
    """
    brdf = with_lobe()
    brdf = replace(brdf, lobes=(brdf.lobes[0], replace(brdf.lobes[0], roughness=0.2)))
    names = (*mode_names("isotropic", brdf.modes), "lobe 0 weight", "lobe 1 weight")
    weight, narrow = float(brdf.lobes[0].weight[0]), 1e-4
    direction = weight * np.array([-0.5, *np.zeros(len(names) - 3), 1.5, -1.0])
    covariance = np.outer(direction, direction) + narrow**2 * np.eye(len(names))
    draws = drawn(known(brdf, names, covariance), DRAWS, seed=5)
    rows = np.array([[one.coefficients[0, 0], *(lobe.weight[0] for lobe in one.lobes)] for one in draws])
    assert 0.1 < np.mean(rows[:, 1:].min(1) < 1e-9) < 0.9
    assert rows.sum(1).std() == pytest.approx(np.sqrt(3.0) * narrow, rel=0.1)


def test_a_roughness_as_unsure_as_it_is_large_draws_no_peak_without_bound():
    lobe, names = Lobe(0.2, np.array([0.04]), np.ones(1)), ("S 0 0 0", "lobe 0 roughness")
    for relative in (0.3, 0.5, 1.0, 2.0):
        covariance = np.diag([1e-6, (0.2 * relative) ** 2])[None]
        known = Uncertain(names, np.sqrt(np.diag(covariance[0]))[:, None], covariance, scale=0.0)
        modes, one = np.zeros((1, 3), int), np.ones((1, 1))
        brdf = Brdf(0, ("Y",), modes, 0.6 * one, 1e-3 * one, lobes=(lobe,), uncertainty=known)
        peak = [float(other.evaluate(0.5, 0.0, 0.5, np.pi)[0]) for other in drawn(brdf, 200, 1)]
        # a peak is at most 3^2 times as high; to first order it moves by twice the roughness's error
        assert np.std(peak) < 2.5 * float(brdf.standard_error(0.5, 0.0, 0.5, np.pi)[0])


@pytest.mark.parametrize("seed", ["x", -1, 1.5, None, True])
def test_a_seed_is_a_whole_number(seed):
    with pytest.raises(InputError, match="seed"):
        drawn(known(matte(), ("S 0 0 0",), np.eye(1)), 1, seed)


@pytest.mark.parametrize("kind", [{}, {"fresnel": "dielectric"}], ids=["schlick", "dielectric"])
def test_a_metals_reflectance_and_weight_that_all_but_cancel_leave_f_as_sure_as_it_is(kind):
    """f is known by their product, to a thousandth, either alone to a tenth: what draws scatter is that of f."""
    f0, weight = (0.7, 0.9) if not kind else (0.05, 0.9)
    lobe = Lobe(0.3, np.full(2, f0), np.full(2, weight), **kind)
    none = np.empty((0, 2))
    bare = Brdf(0, ("A", "B"), np.empty((0, 3), int), none, none, lobes=(lobe,))
    names = ("lobe 0 f0", "lobe 0 weight")
    against, along = np.array([f0, -weight]), np.array([f0, weight])
    covariance = 0.08**2 * np.outer(against, against) + 0.0007**2 * np.outer(along, along)
    brdf = known(bare, names, covariance)
    where = (np.radians([5.0, 30.0, 45.0]), 0.0, np.radians([5.0, 30.0, 45.0]), np.pi)
    error = brdf.standard_error(*where)
    draws = np.array([one.evaluate(*where) for one in drawn(brdf, DRAWS, seed=3)])
    # 1500 draws know a deviation to 2 %; those held at a reflectance of 1 add to it
    np.testing.assert_allclose(draws.std(0), error, rtol=0.25)
    assert (np.abs(draws.mean(0) - brdf.evaluate(*where)) < 0.25 * error).all()
