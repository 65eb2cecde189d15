"""Modes that stand for lobes add no light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.lobes.lobe import Lobe
from photogonio.reconstruct.modes.integrals import albedo_of
from photogonio.reconstruct.represent.developed import developed
from photogonio.reconstruct.represent.held_modes import held
from tests.drawn.exports import rms_between


def _metal(roughness, azimuth=0.0) -> Brdf:
    lobe = Lobe(roughness, np.array([0.6]), np.ones(1), azimuth=azimuth)
    return Brdf(0, ("Y",), np.zeros((0, 3), int), np.zeros((0, 1)), np.zeros((0, 1)), lobes=(lobe,))


@pytest.mark.parametrize(
    ("brdf", "alone"), [(_metal(0.12), True), (_metal((0.45, 0.15), 0.4), False)], ids=["narrow", "brushed"]
)
def test_no_light_is_added_and_what_is_taken_is_said(brdf, alone):
    found = developed(brdf, 12, alone=alone).brdf
    kept, taken = held(brdf, found)

    def most(one: Brdf) -> float:
        """Of its albedo over the source's, by the quadrature of all BRDFs."""
        return max(
            float(albedo_of(one, angle, turn)[0] / albedo_of(brdf, angle, turn)[0]) - 1.0
            for angle in np.radians([0.0, 35.0, 62.0, 76.0, 83.0, 87.5])
            for turn in ((0.0,) if not brdf.turning else (0.2, 1.1, 2.4))
        )

    assert most(found) > 0.01 and most(kept) < 0.005
    # what is left of the reciprocal sum: nothing else changed
    theta, phi = np.radians([20.0, 75.0]), np.array([0.3, 1.9])
    less = found.evaluate(theta[0], phi[0], theta[1], phi[1]) - kept.evaluate(
        theta[0], phi[0], theta[1], phi[1]
    )
    twin = found.evaluate(theta[1], phi[1], theta[0], phi[0]) - kept.evaluate(
        theta[1], phi[1], theta[0], phi[0]
    )
    assert less[0] > 0.0 and less == pytest.approx(twin, rel=1e-6)
    if not brdf.turning:
        lost = rms_between(kept, found) * np.sqrt(np.mean(_values(found) ** 2))
        assert taken[0] == pytest.approx(lost, rel=0.1)


def _values(brdf: Brdf) -> np.ndarray:
    """At the pairs of :func:`rms_between`."""
    rng = np.random.default_rng(5)
    theta = np.arcsin(np.sin(np.radians(70.0)) * np.sqrt(rng.uniform(size=(2, 20_000))))
    return brdf.evaluate(theta[0], 0.0, theta[1], rng.uniform(0.0, np.pi, 20_000))


def test_what_adds_nothing_stays_as_it_is():
    brdf = _metal(0.5)
    kept, taken = held(brdf, brdf)
    assert kept is brdf and not taken.any()
    divided = replace(developed(brdf, 4, alone=True).brdf, quantity="brdf_cos")
    assert held(brdf, divided)[0] is divided
