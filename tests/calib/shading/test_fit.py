"""A lamp by how it lights the paper: of two places the one that explains the photo."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.calib.detect.paper_reading import local_noise
from photogonio.calib.diagnose.lights.ambient_light import AmbientLight, ambient_irradiance
from photogonio.calib.geometry.camera import Pose
from photogonio.calib.setup import Light, ViewSetup
from photogonio.calib.shading.fit import fit_shading, fits_better
from photogonio.capture.diagnosis import Diagnosis
from tests.drawn.setups import draw_paper, draw_world, scene_of

BOUNCE = slice(4, 6)
POSE = Pose(np.eye(3), np.zeros(3))


@pytest.fixture(scope="module")
def drawn():
    rng = np.random.default_rng(5)
    world = draw_world(rng, fixed=True, views=4)
    return world, [draw_paper(world, k, rng) for k in range(4)]


@pytest.mark.parametrize("k", range(4))
def test_a_wrong_place_is_no_better_for_supposing_much_bounce(drawn, k):
    """Errors grow with the bounce supposed, and with them the misfit in its own errors would shrink."""
    world, readings = drawn
    scene, lamp = scene_of(world), world.lamps[k]
    right = fit_shading(readings[k], scene, lamp)
    local = right.local.copy()
    local[:3] += 0.1 * np.linalg.norm(lamp) * np.array([0.6, -0.6, 0.5])
    local[BOUNCE] = 20.0 * np.abs(local[BOUNCE]) + 1.0
    wrong = replace(right, local=local)
    assert fits_better(readings[k], scene, right, wrong)
    assert not fits_better(readings[k], scene, wrong, right)
    assert not fits_better(readings[k], scene, right, right)


def test_noise_is_told_apart_by_tone(drawn):
    """White with noise of 1 %, black with 4 %: each to the error of a median of so many differences."""
    _, readings = drawn
    samples, rng = readings[0].samples, np.random.default_rng(0)
    true = np.where(samples.white, 0.01, 0.04)
    level = np.where(samples.white, 0.5, 0.02) * (1.0 + true * rng.normal(size=len(true)))
    found = local_noise(samples, level)
    for white in (True, False):
        own = samples.white == white
        assert len(set(found[own])) == 1
        assert found[own][0] == pytest.approx(0.01 if white else 0.04, rel=5 * 1.2 / np.sqrt(own.sum()))


@pytest.mark.parametrize("k", range(2))
def test_a_room_that_is_known_leaves_the_lamp_where_it_is(drawn, k):
    """Light from everywhere, a tenth of the lamp's: not known it draws the lamp nearer many errors; known, none."""
    world, readings = drawn
    scene, lamp, dark = scene_of(world), world.lamps[k], readings[k]
    room = 0.1 * np.median(dark.level[dark.samples.white])
    level = dark.level + room * np.where(dark.samples.white, 1.0, scene.black)
    right = fit_shading(dark, scene, lamp)
    known = fit_shading(replace(dark, level=level, beside=(room, 0.01 * room)), scene, lamp)
    ignored = fit_shading(replace(dark, level=level), scene, lamp)
    error = np.sqrt(np.diag(right.covariance()))
    assert (np.abs(known.place - right.place) < 2.0 * error).all()
    assert np.abs((ignored.place - right.place) / error).max() > 3.0
    assert known.local[6] * known.level == pytest.approx(room, rel=0.05)


def test_the_room_is_as_bright_as_its_share_of_a_lamp(drawn):
    """E = share E_lamp in the middle of the paper that is seen, whatever the lamp's strength."""
    world, readings = drawn
    views, observations = [], []
    for k, reading in enumerate(readings):
        points = reading.samples.points
        light = Light(f"L{k}", "point", world.lamps[k], np.zeros((3, 3)), "refined")
        toward, falloff = light.toward(points)
        middle = np.median(toward[:, 2] * falloff)
        strength = np.array([2.0, 4.0]) * (k + 1)
        views.append(ViewSetup(f"v{k}", light, POSE, strength, 0.01 * strength, "white patch"))
        local = np.zeros(9)
        local[6] = 0.5 / (strength[0] * middle)
        view = SimpleNamespace(name=f"v{k}")
        observations.append(SimpleNamespace(view=view, reading=reading, has_paper=True, shading=local))
    np.testing.assert_allclose(ambient_irradiance(views, observations), [0.5, 1.0], rtol=1e-9)
    other = [replace(view, strength_source="intensity") for view in views]
    assert ambient_irradiance(other, observations) is None


@pytest.mark.parametrize(("ambient", "said"), [(np.ones(1), "allowed for"), (None, "left in")])
def test_it_is_said_whether_the_room_is_allowed_for(ambient, said):
    room = Diagnosis("ambient-light", "", 0.08, 0.001, 0.015, 5.0)
    warning = AmbientLight().message(room, allowed=ambient is not None)
    assert "by 8%" in warning and said in warning
