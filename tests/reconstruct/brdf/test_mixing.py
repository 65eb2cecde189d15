"""Channels of channels."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.errors import Uncertain
from photogonio.reconstruct.brdf.mixing import mixed
from tests.drawn.brdfs import brdf_of, coat, directions, mirror, uncertain


def test_channels_are_mixed_as_their_values_and_errors_are():
    """Errors against draws of the parameters, the lobes' shapes being shared by the channels and all else their own."""
    matrix = np.array([[0.7, 0.2, 0.1], [0.1, 0.8, 0.1]])
    brdf = brdf_of(coat(0.3), mirror(0.4), order=1)
    incident, exit = directions(200)
    both = mixed(brdf, matrix, ("A", "B"))
    np.testing.assert_allclose(both(incident, exit), brdf(incident, exit) @ matrix.T, rtol=1e-9, atol=1e-9)
    known = uncertain(brdf)
    shared = [k for k, name in enumerate(known.uncertainty.parameters) if name.endswith("roughness")]
    shared += [known.uncertainty.parameters.index("lobe 0 f0")]
    covariance = known.uncertainty.covariance.copy()
    for k in range(3):  # shapes alike, and of no effect on the rest
        covariance[k, shared], covariance[k, :, shared] = 0.0, 0.0
        covariance[k, shared, shared] = 1e-6
    alike = Uncertain(
        known.uncertainty.parameters, np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).T, covariance
    )
    known = Brdf(known.order, known.channels, known.modes, known.coefficients, known.standard_errors,
                 lobes=known.lobes, uncertainty=alike)  # fmt: skip
    error = mixed(known, matrix, ("A", "B")).standard_error(0.4, 0.0, 0.7, 2.5)
    still = np.ix_(shared, shared)
    moved = covariance.copy()
    moved[0][still] = moved[1][still] = moved[2][still] = 0.0
    free = Uncertain(alike.parameters, alike.standard_errors, moved)
    only = Brdf(known.order, known.channels, known.modes, known.coefficients, known.standard_errors,
                lobes=known.lobes, uncertainty=free).standard_error(0.4, 0.0, 0.7, 2.5)  # fmt: skip
    own = np.sqrt(only**2 @ (matrix**2).T)
    rest = np.sqrt(np.maximum(known.standard_error(0.4, 0.0, 0.7, 2.5) ** 2 - only**2, 0.0))
    assert (error >= own * 0.999).all()
    assert (error**2 <= own**2 * 1.001 + (rest @ matrix.T) ** 2 * 1.01).all()


def test_mixing_by_nothing_changes_nothing_and_twice_is_once_by_the_product():
    brdf = uncertain(brdf_of(coat(0.3), mirror(0.4), order=1))
    same = mixed(brdf, np.eye(3), brdf.channels)
    np.testing.assert_allclose(same.coefficients, brdf.coefficients, rtol=1e-14)
    for one, other in zip(same.lobes, brdf.lobes, strict=True):
        np.testing.assert_allclose(one.f0, other.f0, rtol=1e-12)
        np.testing.assert_allclose(one.weight, other.weight, rtol=1e-12)
    first, second = np.array([[0.7, 0.2, 0.1], [0.0, 0.5, 0.5]]), np.array([[0.3, 0.7]])
    plain = brdf_of(coat(0.3), mirror(0.4), order=1)
    twice = mixed(mixed(plain, first, ("A", "B")), second, ("Y",))
    once = mixed(plain, second @ first, ("Y",))
    incident, exit = directions(50)
    np.testing.assert_allclose(twice(incident, exit), once(incident, exit), rtol=1e-12)
