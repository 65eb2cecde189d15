"""Light on the board whatever the lamp does."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.calib.diagnose.lights.ambient_light import AmbientLight, ambient_irradiance, room_doubt
from photogonio.calib.diagnose.procedure import tell_lights
from photogonio.calib.geometry.camera import Pose
from photogonio.calib.setup import Light, ViewSetup
from photogonio.calib.shading.fit import fit_shading
from photogonio.capture.diagnosis import Diagnosis
from tests.drawn.calibrations import Drawn
from tests.drawn.setups import (
    draw_paper,
    scene_of,
)


@pytest.mark.parametrize("share", [0.0, 0.06])
def test_a_room_that_is_not_dark_is_told(share):
    """Light that is everywhere, the same in all photos whatever the lamp; shadows show it, and so does the falloff."""
    drawn = Drawn(3)
    readings = [draw_paper(drawn.world, k, drawn.rng) for k in range(5)]
    usual = np.median([np.median(r.level[r.samples.white]) for r in readings])
    scene, fits = scene_of(drawn.world), {}
    for k, reading in enumerate(readings):
        room = share * usual * np.where(reading.samples.white, 1.0, scene.black)
        lit = replace(reading, level=reading.level + room)
        fits[f"v{k}"] = fit_shading(lit, scene, drawn.world.lamps[k])
    state = replace(drawn.camera(), settled_or_none=SimpleNamespace(shading=fits))
    (beside,) = AmbientLight().evidence(state)
    assert not replace(beside, amount=0.01).told  # too little to be allowed for, and sure
    known = replace(beside, allowed=beside.told)
    assert (room_doubt(replace(state, found={beside.code: known})) < 0.005) == (share == 0.0 or beside.told)
    little = {beside.code: replace(beside, amount=0.01, error=0.001)}
    assert room_doubt(replace(state, found=little)) == pytest.approx(0.01, rel=0.1)
    tell_lights(replace(state, found={beside.code: known}), [AmbientLight()])
    found = drawn.remarks.residuals["light_beside_lamps"]
    # squares are uneven by 0.002, as one part of what shadows leave, and some of a shadow is penumbra
    assert found["share"] == pytest.approx(share, abs=5 * found["error"] + 0.1 * share)
    assert found["error"] < 0.004
    assert drawn.told("ambient-light") == (share > 0)


POSE = Pose(np.eye(3), np.zeros(3))


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
