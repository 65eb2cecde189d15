"""A lampshade: full light in its cone, half at its half angle, none beyond its rim, and a bare lamp as it was."""

import numpy as np
import pytest

from photogonio.synthetic.render.light import see_lamp
from photogonio.synthetic.render.trace import floor_radiance
from photogonio.synthetic.render.world import world_of
from photogonio.synthetic.scene.hard_cases import changed
from photogonio.synthetic.scene.phone import Shade
from photogonio.synthetic.scene.plan import plan
from photogonio.synthetic.scene.scene import load_scene
from tests.drawn.rooms import room

HEIGHT = 300.0


def under(shades: np.ndarray | None):
    bare = room(
        lamps=[(0, 0.0, 0.0, HEIGHT, 0.0)], intensity=[1e5], table_radius=5000.0, plain=(0, 0, 0.5, 0)
    )
    return bare if shades is None else bare._replace(shades=shades)


@pytest.mark.parametrize("tilt", [0.0, 20.0])
def test_light_fades_about_the_half_angle(tilt):
    axis = np.array([np.sin(np.radians(tilt)), 0.0, -np.cos(np.radians(tilt))])
    shades = np.array([[*axis, *np.radians([40.0, 10.0])]])
    from_axis = np.array([0.0, 30.0, 34.9, 40.0, 45.1, 60.0])
    angle = np.radians(from_axis + tilt)
    points = np.stack([HEIGHT * np.tan(angle), 0 * angle, 0 * angle], axis=-1)
    share = floor_radiance(under(shades), points)[:, 0] / floor_radiance(under(None), points)[:, 0]
    np.testing.assert_allclose(share, [1, 1, 1, 0.5, 0, 0], atol=1e-9)
    # what stands above the floor is lit likewise
    np.testing.assert_allclose(see_lamp(under(shades), 0, points, -1, -1), share, atol=1e-9)


def test_lamps_elsewhere_have_the_shade_and_the_flash_has_none():
    scene = changed(load_scene("phone-plane"), lamp={"shade": Shade(half_angle=30.0, aim=(80.0, 60.0, 0.0))})
    flash, lamp = (shot for shot in plan(scene) if shot.view in (0, 1))
    assert np.all(world_of(scene, flash).shades == 0.0)
    ((x, y, z, half, rim),) = world_of(scene, lamp).shades
    toward = np.array([80.0, 60.0, 0.0]) - lamp.lamps[0].place
    np.testing.assert_allclose([x, y, z], toward / np.linalg.norm(toward))
    assert np.degrees([half, rim]) == pytest.approx([30.0, 10.0])
