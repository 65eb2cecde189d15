"""The renderer against closed forms: furnace, sphere, plane, edges, shadows, mirror images."""

import numpy as np
import pytest

from photogonio.capture.photoset import CharucoBoard
from photogonio.synthetic.brdf.library import make_brdf
from photogonio.synthetic.render.bounce import room_extra
from photogonio.synthetic.render.highlight import area, coverage
from photogonio.synthetic.render.picture import lamp_directions, pixel_middles, plane_corners, render
from photogonio.synthetic.scene.plan import look_at
from tests.drawn.rooms import camera, overhead, room

LAMBERT = make_brdf("lambert", {"albedo": (1.0,)})


def pixel_rays(cam, pose):
    """Unit directions (h, w, 3) in the world through the pixels' middles."""
    plane = pixel_middles(plane_corners(cam))
    rays = np.concatenate([plane, np.ones((*plane.shape[:2], 1))], axis=-1) @ pose.rotation
    return rays / np.linalg.norm(rays, axis=-1, keepdims=True)


def test_white_furnace():
    """A white ball under an even sky cannot be told from the sky."""
    world = room(sphere=(0, 0, 0, 25), ambient=0.7)
    image = render(world, LAMBERT, camera(), overhead(200.0), extra=(room_extra(world, LAMBERT),))
    assert image == pytest.approx(0.7, rel=1e-9)


def test_ball_under_a_distant_light_is_the_analytic_image():
    """f E cos_i at each pixel's middle, some pixels away from limb and terminator.

    Pixels of 0.2 mm on a ball of 25 mm: a pixel's mean and its middle differ by about (0.2 / 25)^2 / 24 and, near
    the limb, twenty times that.
    """
    light, brdf = np.array([0.48, 0.36, 0.8]), make_brdf("oren-nayar", {"albedo": (0.8,)})
    world = room(sphere=(0, 0, 0, 25), lamps=[(1, *light, 0)], intensity=[3.0])
    cam, pose = camera(330, 310, 1000.0, (-0.2, 0.1, 0.001, -0.001)), overhead(200.0)
    image = render(world, brdf, cam, pose)[..., 0]
    rays, eye = pixel_rays(cam, pose), pose.center
    along = -rays @ eye
    miss = np.linalg.norm(eye + along[..., None] * rays, axis=-1)
    normal = (eye + (along - np.sqrt(np.maximum(625 - miss**2, 0)))[..., None] * rays) / 25
    x = np.stack([-normal[..., 1], normal[..., 0], 0 * normal[..., 0]], axis=-1)
    x /= np.linalg.norm(x, axis=-1, keepdims=True) + 1e-30
    frame = np.stack([x, np.cross(normal, x), normal], axis=-2)
    cos = normal @ light
    value = 3.0 * cos * brdf(frame @ light, np.einsum("...ij,...j->...i", frame, -rays))[..., 0]
    inner = (miss < 24) & (cos > 0.05)
    assert np.count_nonzero(inner) > 20_000
    error = np.abs(image - value)[inner] / value[inner].max()
    assert error.max() < 1e-3 and np.sqrt(np.mean(error**2)) < 1e-4


def test_whole_ball_returns_the_phase_integral():
    """Light of a Lambert ball seen from far: its image's sum is that of the full phase law, limb and all.

    The integral of cos_i / pi over the disc at phase a is (2 / 3 pi) r^2 (sin a + (pi - a) cos a).
    """
    phase, far, radius, focal = np.radians(50.0), 20_000.0, 25.0, 40_000.0
    world = room(sphere=(0, 0, 0, radius), lamps=[(1, np.sin(phase), 0, np.cos(phase), 0)], intensity=[1.0])
    image = render(world, LAMBERT, camera(focal=focal), overhead(far))
    per_pixel = (far / focal) ** 2  # area at the ball
    expected = 2 / (3 * np.pi) * radius**2 * (np.sin(phase) + (np.pi - phase) * np.cos(phase))
    # 100 pixels across: the limb's coverage errs by about 1e-4; perspective by (r / far)
    assert image.sum() * per_pixel == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("model", ["lambert", "plastic"])
def test_energy_of_the_plane(model):
    """The pixel sum of a flat sample under a near lamp, against a quadrature of its radiance over its outline."""
    brdf = make_brdf(model, {"albedo": (0.6,)})
    outline = np.array([[-21.3, -14.1], [22.7, -11.9], [17.0, 15.3]])
    lamp, height = np.array([60.0, -40.0, 180.0]), 0.5
    world = room(
        outlines=[outline], heights=[height], sample_sheet=0, sheet_colors=[0],
        lamps=[(0, *lamp, 0)], intensity=[1e5], plain=(0, 0, 0, 0),
    )  # fmt: skip
    cam, pose = camera(focal=500.0), overhead(300.0)
    image = render(world, brdf, cam, pose)[..., 0]
    # a pinhole that looks straight down has pixels of equal area on the plane
    pixel_area = ((300.0 - height) / 500.0) ** 2
    node, weight = np.polynomial.legendre.leggauss(40)
    u, v = np.meshgrid(0.5 * (node + 1), 0.5 * (node + 1))
    (a, b, c), w = outline, 0.25 * np.outer(weight, weight)
    points = a + u[..., None] * ((b - a) + v[..., None] * (c - b))
    jacobian = u * abs(np.cross(np.append(b - a, 0), np.append(c - b, 0))[2])
    points = np.concatenate([points, np.full((*u.shape, 1), height)], axis=-1)
    to_lamp, to_eye = lamp - points, pose.center - points
    d2 = np.sum(to_lamp**2, axis=-1)
    i, r = to_lamp / np.sqrt(d2)[..., None], to_eye / np.linalg.norm(to_eye, axis=-1, keepdims=True)
    expected = np.sum(w * jacobian * 1e5 / d2 * i[..., 2] * brdf(i, r)[..., 0])
    assert image.sum() * pixel_area == pytest.approx(expected, rel=1e-3)


def test_edges_cover_their_share_of_a_pixel():
    """The rim of a plane at a slant: summed over the rim, coverage is the area."""
    corners = np.array([[-20.2, -15.4], [20.6, -9.1], [15.2, 13.9], [-22.4, 11.3]])
    world = room(outlines=[corners], heights=[0.0], sample_sheet=0, sheet_colors=[0],
                 lamps=[(1, 0, 0, 1, 0)], intensity=[np.pi], plain=(0, 0, 0, 0))  # fmt: skip
    image = render(world, LAMBERT, camera(focal=300.0), overhead(300.0))
    assert image.sum() == pytest.approx(area(corners), rel=5e-4)
    assert image.max() <= 1 + 1e-12


def test_board_is_seen_where_the_camera_says():
    """Every square's middle is black or white as printed, from a slant, through a distorting lens."""
    board = CharucoBoard("DICT_4X4_50", squares=(6, 5), square_length=10.0, marker_length=2.0)
    world = room(board=board, ambient=1.0, plain=(0.1, 0.9, 0.05, 0.05))
    cam = camera(400, 300, 900.0, (-0.2, 0.1, 0.002, -0.001))
    pose = look_at(np.array([20.0, -130.0, 160.0]), np.array([30.0, 25.0, 0.0]), roll=0.3)
    image = render(world, LAMBERT, cam, pose)[..., 0]
    column, row = np.meshgrid(np.arange(6), np.arange(5))
    places = np.stack([column * 10 + 1.5, row * 10 + 1.5, 0 * row], axis=-1).reshape(-1, 3)
    x, y = np.round(cam.project(pose, places)).astype(int).T
    black_from_top_left = (column + (4 - row)) % 2 == 0
    assert image[y, x] == pytest.approx(np.where(black_from_top_left.ravel(), 0.1, 0.9), abs=1e-9)


def test_shadow_of_the_ball_lies_where_the_lamp_puts_it():
    """A ball floating over the table: its shadow has the area of the projected disc, half lit at its rim."""
    lamp_radius, height, radius, lamp_height = 4.0, 40.0, 10.0, 400.0
    world = room(sphere=(0, 0, height, radius), lamps=[(0, 0, 0, lamp_height, lamp_radius)],
                 intensity=[np.pi * lamp_height**2], table_radius=500, plain=(0, 0, 1, 0))  # fmt: skip
    cam = camera(240, 240, 2000.0)
    pose = look_at(np.array([0.0, -900.0, 900.0]), np.zeros(3))
    image = render(world, make_brdf("lambert", {"albedo": (0.0,)}), cam, pose)[..., 0]
    slope = radius / np.sqrt((lamp_height - height) ** 2 - radius**2)
    rim = slope * lamp_height
    where = np.array([[rim, 0, 0], [rim - 1.5, 0, 0], [rim + 1.5, 0, 0], [-rim, 0, 0]])
    x, y = np.round(cam.project(pose, where)).astype(int).T
    lit = (lamp_height**2 / (lamp_height**2 + np.sum(where**2, axis=1))) ** 2
    # half a pixel is 0.3 mm, the penumbra 0.9 mm wide
    share = image[y, x] / lit
    assert share[1] == pytest.approx(0.0, abs=1e-9) and share[2] == pytest.approx(1.0, rel=1e-3)
    assert 0.1 < share[0] < 0.9 and 0.1 < share[3] < 0.9


def test_glowing_ball_above_the_horizon_is_its_own_centre():
    """The parts of an extended lamp sum to I cos / d^2 exactly."""
    lamp = np.array([0.0, 30.0, -20.0, 200.0, 15.0])
    total = sum(falloff * direction[:, 2] for direction, falloff in lamp_directions(lamp, np.zeros((1, 3))))
    d2 = np.sum(lamp[1:4] ** 2)
    assert total == pytest.approx(200.0 / np.sqrt(d2) / d2, rel=1e-12)


def test_highlight_in_a_mirror_ball():
    """The lamp's image lies where reflection puts it, with the brightness of the lamp itself."""
    ball, lamp, lamp_radius = np.array([30.0, 20.0, 8.0]), np.array([-150.0, 90.0, 320.0]), 7.0
    world = room(balls=[[*ball, 8.0, 0.8]], lamps=[[0, *lamp, lamp_radius]], intensity=[1e5])
    cam = camera(320, 240, 30_000.0)
    pose = look_at(np.array([0.0, -400.0, 450.0]), np.array([28.0, 18.0, 15.0]))
    image = render(world, LAMBERT, cam, pose)[..., 0]
    row, column = np.indices(image.shape)
    x, y = np.sum(column * image) / image.sum(), np.sum(row * image) / image.sum()
    eye, point = pose.center, ball + np.array([0, 0, 8.0])
    for _ in range(200):  # the point whose normal halves the angle, by bisection of the error
        half = (eye - point) / np.linalg.norm(eye - point) + (lamp - point) / np.linalg.norm(lamp - point)
        point = ball + 8.0 * half / np.linalg.norm(half)
    assert np.array([x, y]) == pytest.approx(cam.project(pose, point[None])[0], abs=0.5)
    # a small mirror ball of radius R shows a far lamp as a disc of radius r R / (2 d) along its better axis
    d, far = np.linalg.norm(lamp - ball), np.linalg.norm(eye - ball)
    cos = np.dot(half / np.linalg.norm(half), (lamp - point) / np.linalg.norm(lamp - point))
    size = np.pi * (lamp_radius * 8.0 / 2 / d) ** 2 * (30_000.0 / far) ** 2
    radiance = 0.8 * 1e5 / (np.pi * lamp_radius**2)
    # finite distances enter at R / d, a few per cent
    assert image.sum() == pytest.approx(radiance * size, rel=0.06) and 0.5 < cos < 1


def test_mirror_ball_shows_the_board_and_the_dark_room():
    board = CharucoBoard("DICT_4X4_50", squares=(6, 5), square_length=10.0, marker_length=7.0)
    world = room(board=board, balls=[(30, 25, 10, 10, 0.5)], lamps=[(1, 0, 0, 1, 0)], intensity=[np.pi])
    cam, pose = (
        camera(200, 160, 900.0),
        look_at(np.array([30.0, -200.0, 120.0]), np.array([30.0, 25.0, 10.0])),
    )
    image = render(world, LAMBERT, cam, pose)[..., 0]
    up, down = np.array([30.0, 24.0, 19.5]), np.array([30.0, 15.5, 6.9])
    for point, low, high in ((up, 0.0, 1e-12), (down, 0.01, 0.5 * 0.85)):
        x, y = np.round(cam.project(pose, point[None])[0]).astype(int)
        assert low <= image[y, x] <= high


def test_clipped_polygon_keeps_its_area():
    polygon = np.array([[1.2, 0.7], [5.9, 1.4], [4.4, 4.8], [1.9, 3.3]])
    cells = coverage(polygon, 20, 20)
    assert sum(part for *_, part in cells) == pytest.approx(area(polygon), rel=1e-12)
    assert max(part for *_, part in cells) <= 1 + 1e-12 and len(cells) > 10
