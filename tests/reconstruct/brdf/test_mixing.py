"""Channels of channels."""

from __future__ import annotations

import json

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf, load_brdf
from photogonio.reconstruct.brdf.errors import Uncertain
from photogonio.reconstruct.brdf.lobe_schema import MIXED
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


def test_a_colour_beyond_what_a_surface_reflects_is_exact_and_read_again(tmp_path):
    """As of copper in narrow primaries; the file says that its channels were mixed, or it would be refused."""
    brdf = brdf_of(coat(0.3), mirror(0.4), order=0)
    strong = np.array([[1.8, -0.8, 0.0], [-1.9, 2.9, 0.0]])
    assert (strong @ brdf.lobes[0].ground < 0.0).any() or (strong @ brdf.lobes[1].weight < 0.0).any()
    mixed(brdf, strong, ("A", "B")).save(tmp_path / "a.json")
    back = load_brdf(tmp_path / "a.json")
    incident, exit = directions(50)
    np.testing.assert_allclose(back(incident, exit), brdf(incident, exit) @ strong.T, rtol=1e-9, atol=1e-9)
    document = json.loads((tmp_path / "a.json").read_text())
    del document[MIXED]
    (tmp_path / "b.json").write_text(json.dumps(document))
    with pytest.raises(InputError, match=r"b\.json: lobes\[\d\]\.(f0|weight|ground): "):
        load_brdf(tmp_path / "b.json")
    assert MIXED not in mixed(brdf, np.eye(3), brdf.channels).extra
