"""Light off the board, and of the room."""

import numpy as np
import pytest

from photogonio.capture.photoset import CharucoBoard
from photogonio.synthetic.brdf.library import make_brdf
from photogonio.synthetic.render.bounce import (
    bounce_extra,
    bounced,
    exit_albedo,
    raise_above_horizon,
    room_extra,
    surroundings,
)
from photogonio.synthetic.render.picture import render, tangent_frames
from photogonio.synthetic.scene.plan import look_at
from tests.drawn.rooms import camera, room

LAMBERT = make_brdf("lambert", {"albedo": (1.0,)})
BOARD = CharucoBoard("DICT_4X4_50", squares=(9, 7), square_length=20.0, marker_length=15.0)
BALL = (90.0, 70.0, 25.0, 25.0)


def test_white_ball_on_a_white_table_in_an_even_room_vanishes():
    """Sky above and board below have one radiance, so the ball has it too: the bounce's own furnace."""
    world = room(sphere=BALL, board=BOARD, table_radius=4000, ambient=1.0, plain=(1, 1, 1, 1))
    pose = look_at(np.array([90.0, -330.0, 420.0]), np.array(BALL[:3]))
    extra = (room_extra(world, LAMBERT), bounce_extra(world, LAMBERT, pose.center))
    image = render(world, LAMBERT, camera(), pose, extra=extra)[..., 0]
    # rings of cells near the foot are a fifth of their distance wide: a per cent of the lower ball's light
    assert image == pytest.approx(1.0, abs=0.02) and image.mean() == pytest.approx(1.0, abs=0.003)


def test_infinite_floor_lights_a_tilted_facet_by_its_form_factor():
    """A floor of radiance 1 / pi gives a facet with normal n the irradiance (1 - n_z) / 2."""
    world = room(sphere=(0, 0, 25, 25), board=None, table_radius=20_000, lamps=[(1, 1e-9, 0, 1, 0)],
                 intensity=[1.0], plain=(1, 1, 1, 1))  # fmt: skip
    cells = surroundings(world, rings=150)
    cells = type(cells)(cells.place, cells.area, np.full_like(cells.radiance, 1 / np.pi))  # no shadow
    theta = np.radians([20.0, 60.0, 90.0, 120.0])
    normals = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], axis=-1)
    points = np.array([0, 0, 25.0]) + 25 * normals
    found = np.pi * bounced(cells, LAMBERT, points, normals, normals)[:, 0]
    # the strip between the floor's end and the horizon, height / 20000 high, is missing: 2 sin theta / pi of that
    strip = 2 * np.sin(theta) / np.pi * points[:, 2] / 20_000
    assert found == pytest.approx((1 - np.cos(theta)) / 2 - strip, rel=2e-3)


def test_map_agrees_with_fine_quadrature():
    """Satin paint on a board under a near lamp: the interpolated map against a quadrature ten times finer."""
    brdf = make_brdf("satin-paint", {"albedo": (0.6,)})
    world = room(sphere=BALL, board=BOARD, table_radius=900, lamps=[(0, 300, 100, 350, 7)], intensity=[1e5])
    eye = np.array([90.0, -330.0, 420.0])
    toward = (eye - np.array(BALL[:3])) / np.linalg.norm(eye - np.array(BALL[:3]))
    normals = np.random.default_rng(1).normal(size=(200, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals[(normals @ toward) > 0.2]
    points = np.array(BALL[:3]) + BALL[3] * normals
    exits = raise_above_horizon((eye - points) / np.linalg.norm(eye - points, axis=1, keepdims=True), normals)
    quick = bounce_extra(world, brdf, eye)(points, normals, exits)
    exact = bounced(surroundings(world, rings=80, spokes=150), brdf, points, normals, exits)
    assert np.sqrt(np.mean((quick - exact) ** 2)) < 0.05 * np.sqrt(np.mean(exact**2))
    assert exact.max() > 0


def test_bounce_is_there_only_for_a_ball_with_something_around_it():
    assert bounce_extra(room(sphere=BALL), LAMBERT, np.array([0, 0, 900.0])) is None
    flat = room(
        outlines=[[[0, 0], [1, 0], [0, 1]]], heights=[0.5], sample_sheet=0, sheet_colors=[0], board=BOARD
    )
    assert bounce_extra(flat, LAMBERT, np.array([0, 0, 900.0])) is None


@pytest.mark.parametrize("name", ["lambert", "plastic", "brushed-metal"])
def test_room_light_is_the_integral_over_incidence(name):
    """Against plain sampling of the hemisphere."""
    brdf = make_brdf(name)
    cos_r, table = exit_albedo(brdf)
    random = np.random.default_rng(3)
    n, cos = 400_000, 0.6
    phi, c = random.uniform(0, 2 * np.pi, n), np.sqrt(random.uniform(0, 1, n))  # cosine-weighted
    incident = np.stack([np.sqrt(1 - c**2) * np.cos(phi), np.sqrt(1 - c**2) * np.sin(phi), c], axis=-1)
    turn = random.uniform(0, 2 * np.pi, n)
    exit = np.stack([0.8 * np.cos(turn), 0.8 * np.sin(turn), np.full(n, cos)], axis=-1)
    values = np.pi * brdf(incident, exit)[:, 0]
    error = 4 * values.std() / np.sqrt(n) + 1e-3 * values.mean()
    assert np.interp(cos, cos_r, table[:, 0]) == pytest.approx(values.mean(), abs=error)


def test_frames_are_turned_axes():
    normals = np.random.default_rng(2).normal(size=(50, 3))
    normals = np.concatenate([normals / np.linalg.norm(normals, axis=1, keepdims=True), [[0, 0, 1.0]]])
    frames = tangent_frames(normals)
    assert np.einsum("nij,nkj->nik", frames, frames) == pytest.approx(
        np.broadcast_to(np.eye(3), (51, 3, 3)), abs=1e-12
    )
    assert np.linalg.det(frames) == pytest.approx(1.0)
