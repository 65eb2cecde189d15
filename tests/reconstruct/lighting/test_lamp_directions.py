"""Lights whose directions are wrong are turned to where the shading of a ball has them."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.setup import Light, Setup, ViewSetup
from photogonio.capture.photoset import Plane, Sphere, WhitePatch
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.lighting.lamp_directions import relit, turned_lights
from photogonio.reconstruct.table.cells import Cells

RNG = np.random.default_rng(3)
RADIUS, DISTANCE = 100.0, 20000.0
NORMALS = RNG.normal(size=(900, 3))
NORMALS[:, 2] = np.abs(NORMALS[:, 2])
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)
LIGHTS = np.array([[0.5, 0.2, 0.8], [-0.5, 0.3, 0.8], [0.1, -0.6, 0.8], [0.0, 0.1, 1.0], [-0.4, -0.4, 0.8]])
LIGHTS /= np.linalg.norm(LIGHTS, axis=1, keepdims=True)
STATED = np.radians(0.3)
NOISE = 0.01
PATCH = WhitePatch(np.array([[290.0, -10], [310, -10], [310, 10], [290, 10]]), 0.0, np.array([0.9]))
PATCH_MIDDLE = np.array([300.0, 0.0, 0.0])


def lambert():
    return Model(Basis("isotropic", 0), np.array([[2 * 0.5]]), LobeSet(), np.zeros((0, 1)))


def turned_about(direction, angle):
    across = np.cross(direction, [0.3, 0.9, 0.1])
    across /= np.linalg.norm(across)
    return np.cos(angle) * direction + np.sin(angle) * across


def toward(direction, place, distance):
    """Unit vectors from ``place`` (n, 3) to a light in ``direction``, and their lengths over ``distance``."""
    offset = direction - place / distance
    reach = np.linalg.norm(offset, axis=1)
    return offset / reach[:, None], reach


def received(place):
    """Irradiance of the patch over the strength of a lamp at ``place``."""
    offset = place - PATCH_MIDDLE
    return offset[2] / np.linalg.norm(offset) ** 3


def world(angles, sample=None, *, distance=np.inf, stated=STATED):
    """A setup whose lights are off by ``angles``, and the cells that a photo under the true ones gives.

    Lamps at a finite ``distance`` are near; a patch below the ball has told how strong they are.
    """
    views, parts = [], []
    camera = np.array([0.0, 0.0, DISTANCE])
    for k, true in enumerate(LIGHTS):
        believed = turned_about(true, angles[k])
        lit = (NORMALS @ true > 0.05) & (NORMALS @ believed > 0.05)
        if np.isfinite(distance):  # a near lamp reaches less far round the ball
            lit = (NORMALS @ true > 0.05 + RADIUS / distance) & (
                NORMALS @ believed > 0.05 + RADIUS / distance
            )
        normal = NORMALS[lit]
        place = RADIUS * normal
        (true, reach), (believed, assumed) = (toward(one, place, distance) for one in (true, believed))
        back = camera - place
        back /= np.linalg.norm(back, axis=1, keepdims=True)
        cos_i, cos_r, cos_true = (np.einsum("ij,ij->i", normal, one) for one in (believed, back, true))
        value = 0.5 / np.pi * cos_true / cos_i * assumed**2 / reach**2
        value *= 1 + NOISE * RNG.normal(size=lit.sum())
        parts.append(
            (np.arccos(cos_i), np.arccos(np.clip(cos_r, -1, 1)), value, place, np.full(lit.sum(), k))
        )
        start = turned_about(LIGHTS[k], angles[k])
        near = np.isfinite(distance)
        if near:
            covariance = (stated * distance) ** 2 * np.eye(3)
            light = Light(f"L{k}", "point", distance * start, covariance, "mirror balls")
        else:
            light = Light(f"L{k}", "directional", start, stated**2 * np.eye(3), "probe")
        pose = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, DISTANCE]))
        strength = np.array([received(distance * LIGHTS[k]) / received(light.place)]) if near else np.ones(1)
        source = "white patch" if near else "none"
        views.append(ViewSetup(f"s{k}", light, pose, strength, 0.02 * strength, source))
    theta_i, theta_r, value, place, group = (np.concatenate(column) for column in zip(*parts, strict=True))
    n = len(value)
    cells = Cells(
        theta_i=theta_i,
        phi_i=np.zeros(n),
        theta_r=theta_r,
        phi_r=np.zeros(n),
        dphi=np.zeros(n),
        value=value[:, None],
        variance=np.full((n, 1), (0.01 * 0.16) ** 2),
        count=np.full(n, 10.0),
        group=group,
        place=place,
        groups=tuple(view.name for view in views),
        channels=("grey",),
        binned=True,
    )
    setup = Setup(
        Camera(np.eye(3), np.zeros(5), (640, 480)),
        sample or Sphere(np.zeros(3), RADIUS),
        tuple(views),
        "relative",
        ("grey",),
    )
    return setup, cells


def apart(one, other):
    return float(np.arccos(np.clip(one @ other, -1.0, 1.0)))


def test_a_light_that_the_shading_contradicts_is_turned_to_where_it_is():
    setup, cells = world(np.radians([0.0, 5.0, 0.0, 0.0, 0.0]))
    turned = turned_lights(cells, lambert(), setup)
    after = relit(setup, turned)
    # what is left is the highlights' share of the way, by their stated errors
    assert apart(after.views[1].light.place, LIGHTS[1]) <= np.radians(1.5)
    for k in (0, 2, 3, 4):
        assert apart(after.views[k].light.place, LIGHTS[k]) <= np.radians(0.3)
    assert after.views[1].light.source == "refined"


def test_lights_within_their_errors_stay():
    setup, cells = world(np.radians([0.3, 0.2, 0.1, 0.3, 0.2]))
    assert turned_lights(cells, lambert(), setup) == ()


def test_neither_planes_nor_few_lights_are_judged():
    outline = np.array([[0.0, 0], [1, 0], [1, 1]])
    setup, cells = world(np.radians([0.0, 5.0, 0.0, 0.0, 0.0]), Plane(outline, 0.0))
    assert turned_lights(cells, lambert(), setup) == ()


@pytest.mark.parametrize("angle", [30.0])
def test_another_light_altogether_is_no_error_of_direction(angle):
    setup, cells = world(np.radians([0.0, angle, 0.0, 0.0, 0.0]))
    assert "L1" not in {one.id for one in turned_lights(cells, lambert(), setup)}


def test_a_near_lamp_that_only_mirror_balls_told_is_turned_about_the_ball():
    """Stated to 1.5 degrees and off by as much; its strength stays what the patch says of its new place."""
    distance = 1500.0
    setup, cells = world(np.radians([1.5, -1.0, 2.0, 0.5, 1.0]), distance=distance, stated=np.radians(1.5))
    turned = turned_lights(cells, lambert(), setup)
    after = relit(setup, turned, (PATCH,))
    assert len(turned) == 5
    for true, before, view in zip(LIGHTS, setup.views, after.views, strict=True):
        assert np.linalg.norm(view.light.place) == pytest.approx(distance)
        assert apart(view.light.place / distance, true) <= np.radians(0.25)
        level = view.strength[0] * received(view.light.place)  # of the patch, which no turn may change
        assert level == pytest.approx(before.strength[0] * received(before.light.place), rel=1e-9)
        assert view.strength[0] == pytest.approx(1.0, abs=0.02)
        assert view.strength_error[0] < before.strength_error[0]


def test_a_near_lamp_that_calibration_settled_stays():
    setup, cells = world(np.radians([0.1, 0.0, 0.1, 0.0, 0.0]), distance=1500.0, stated=np.radians(0.05))
    assert turned_lights(cells, lambert(), setup) == ()


def test_a_lamp_that_moves_with_the_camera_is_not_turned():
    """One id, another place in each photo: there is no one direction that it could be turned to."""
    setup, cells = world(np.radians([1.5, -1.0, 2.0, 0.5, 1.0]), distance=1500.0, stated=np.radians(1.5))
    views = tuple(replace(view, light=replace(view.light, id="flash")) for view in setup.views)
    assert turned_lights(cells, lambert(), replace(setup, views=views)) == ()


def test_strengths_that_the_board_told_follow_a_turn():
    """What level ground below the ball receives stays."""
    setup, cells = world(np.radians([0.0, 5.0, 0.0, 0.0, 0.0]))
    views = tuple(
        replace(view, strength_source="board", strength_error=np.full(1, 0.01)) for view in setup.views
    )
    setup = replace(setup, views=views)
    after = relit(setup, turned_lights(cells, lambert(), setup))
    for before, view in zip(setup.views, after.views, strict=True):
        assert view.strength[0] * view.light.place[2] == pytest.approx(before.light.place[2], rel=1e-9)
