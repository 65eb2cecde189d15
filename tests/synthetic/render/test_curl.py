"""A page that curls: rays meet its parabola, its print keeps its length, and it is lit by how it faces."""

import numpy as np
import pytest

from photogonio.capture.photoset import CharucoBoard
from photogonio.synthetic.brdf.library import make_brdf
from photogonio.synthetic.render.picture import render
from photogonio.synthetic.render.room import BOARD
from photogonio.synthetic.render.trace import along_page, nearest
from photogonio.synthetic.scene.plan import look_at
from tests.drawn.rooms import camera, room

SQUARES = CharucoBoard("DICT_5X5_250", (9, 7), 20.0, 15.0)
LIFT, HALF = 6.0, 90.0
CURL = LIFT / HALF**2


def page(curl=CURL, **more):
    return room(board=SQUARES, **more)._replace(curl=curl)


def test_rays_meet_the_parabola():
    world, random = page(), np.random.default_rng(2)
    eye = np.array([300.0, -200.0, 400.0])
    for x, y in random.uniform([5, 5], [175, 135], (40, 2)):
        point = np.array([x, y, CURL * (x - HALF) ** 2])
        distance = np.linalg.norm(point - eye)
        kind, _, t = nearest(world, *eye, *((point - eye) / distance), -1)
        assert kind == BOARD and t == pytest.approx(distance, rel=1e-12)


def test_the_print_keeps_its_length():
    x = np.linspace(0.0, 180.0, 20001)
    step = np.hypot(np.diff(x), np.diff(CURL * (x - HALF) ** 2))
    whole = along_page(page(), 180.0) - along_page(page(), 0.0)
    assert whole == pytest.approx(step.sum(), rel=1e-5) and whole > 180.1  # the next order is slope^4 / 40


def test_paper_is_lit_by_how_it_faces_a_distant_lamp():
    light = np.array([np.sin(0.9), 0.0, np.cos(0.9)])
    flat, curled = (
        page(curl, lamps=[(1, *light, 0.0)], intensity=[np.pi], plain=(1.0, 1.0, 0.0, 0.0))
        for curl in (0.0, CURL)
    )
    cam, white = camera(90, 70, 130.0), make_brdf("lambert", {"albedo": (1.0,)})
    pose = look_at(np.array([90.0, 70.0, 400.0]), np.array([90.0, 70.0, 0.0]))
    plain, bent = (render(world, white, cam, pose)[35, :, 0] for world in (flat, curled))
    inner = slice(20, 70)
    assert plain[inner] == pytest.approx(light[2])
    rays = np.stack([(np.arange(90) - 44.5) / 130.0, np.zeros(90), np.ones(90)], axis=-1) @ pose.rotation
    for k in range(20, 70):
        ray = rays[k] / np.linalg.norm(rays[k])
        _, _, t = nearest(curled, *pose.center, *ray, -1)
        slope = 2 * CURL * (pose.center[0] + t * ray[0] - HALF)
        facing = (light[2] - slope * light[0]) / np.hypot(1.0, slope)
        assert bent[k] == pytest.approx(facing, rel=2e-3)
    assert np.ptp(bent[inner]) > 0.03
