"""What is expected of a rig, as a set of it is begun: a beam, a dark lens and a camera."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.calib.adjust.rig_values import _camera, model_of_rig, with_rig
from photogonio.calib.rig.gaussian import NOTHING, RigExpected, RigPrior
from photogonio.calib.rig.values import LAMP, camera_name

SIZE = (800, 600)


@dataclass(frozen=True)
class State:
    """As much of a state as is asked for."""

    rig: RigPrior
    vignetting: str = "auto"
    narrow: float = 0.0
    falloff: tuple[float, float] = (0.0, 0.0)

    @property
    def photoset(self):
        return SimpleNamespace(radiometry=SimpleNamespace(vignetting=self.vignetting))


def lamps(beam: float, error: float = 0.1) -> RigPrior:
    sigma = np.array([0.1, 0.1, error, 0.01, 0.01])
    return RigPrior((RigExpected(LAMP, np.array([1.0, -3.0, beam, -0.2, 0.05]), np.diag(sigma**2), 9),))


def test_where_nothing_is_expected_nothing_changes():
    state = State(NOTHING)
    assert with_rig(state) is state


@pytest.mark.parametrize(
    ("beam", "error", "known"), [(2.0, 0.1, True), (0.3, 0.1, False), (0.1, 0.001, False)]
)
def test_lamps_have_a_beam_where_those_of_other_sets_surely_have_one(beam, error, known):
    found = with_rig(State(lamps(beam, error)))
    assert found.narrow == (beam if known else 0.0)
    kept = found.rig.get(LAMP)
    assert kept.value[2] == found.narrow
    assert known or kept.covariance[2, 2] < error**2  # held at none


def test_the_lens_is_as_dark_as_that_of_other_sets_unless_the_manifest_says():
    assert with_rig(State(lamps(2.0))).falloff == pytest.approx((-0.2, 0.05))
    told = with_rig(State(lamps(2.0), vignetting="cos4"))
    assert told.falloff == (0.0, 0.0)
    assert np.sqrt(told.rig.get(LAMP).covariance[3, 3]) < 0.01


def test_the_camera_that_is_expected_is_that_of_the_values():
    value = np.array([1000.0, 1001.0, 399.0, 301.0, -0.1])
    expected = RigExpected(camera_name((0,)), value, np.diag([1.0, 1.0, 1.0, 1.0, 0.01]) ** 2, 6)
    camera, model = model_of_rig(expected, SIZE)
    np.testing.assert_allclose(np.diag(camera.matrix)[:2], value[:2])
    np.testing.assert_allclose(camera.matrix[:2, 2], value[2:4])
    assert camera.distortion[0] == pytest.approx(-0.1) and not camera.distortion[1:].any()
    np.testing.assert_allclose(model.block(camera), value)
    assert replace(model, expected=None).size == SIZE


@pytest.mark.parametrize(("apart", "told"), [(1e-3, True), (1e-9, False)])
def test_lens_terms_that_stand_for_one_another_tell_nothing_of_the_rig(apart, told):
    """Two terms whose difference alone matters have a covariance that cannot be inverted, but for rounding: eigenvalues
    did not converge."""
    error = np.array([0.9, 0.9, 0.01, 0.2, 0.002, 0.002])
    correlation = np.eye(6)
    correlation[4, 5] = correlation[5, 4] = 1.0 - apart**2
    value = np.array([945.0, 944.0, 213.0, 134.0, -122.0, -122.0])
    expected = RigExpected(camera_name((0, 1)), value, np.diag(error**2), 1)
    model = replace(model_of_rig(expected, SIZE)[1], expected=None)
    covariance = {"camera": correlation * np.outer(error, error)}
    settled = SimpleNamespace(model=model, values={"camera": value}, covariance=covariance, shading={})
    assert bool(list(_camera(None, settled))) == told
