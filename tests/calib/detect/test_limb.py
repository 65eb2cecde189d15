"""A ball by its limb: edges to a fraction of a pixel, and the place that they tell."""

import cv2
import numpy as np
import pytest

from photogonio.calib.detect.gray import GrayPart
from photogonio.calib.detect.limb import LIMB_POINTS, Limb, find_edges, find_limb, place_ball, settled_limb
from photogonio.calib.geometry.camera import Camera, focal
from photogonio.calib.geometry.cones import cone_residual, outline
from tests.drawn.boards import looking_at

SIZE, FINE = (240, 200), 8
CAMERA = Camera(
    np.array([[420.0, 0, 119.0], [0, 421.0, 101.0], [0, 0, 1]]), np.array([-0.1, 0.05, 0, 0, 0.0]), SIZE
)
BALL, RADIUS = np.array([2.0, -1.0, 12.0]), 12.0
POSES = [looking_at(np.array(e), BALL) for e in ([10.0, -60, 110], [70.0, 20, 90], [-50.0, 60, 80])]


def picture(pose, *, noise: float = 0.002, seed: int = 0) -> GrayPart:
    """A pale ball before dark ground, each pixel its covered share, a little blurred."""
    limb = (outline(CAMERA, pose, BALL, RADIUS, 400) + 0.5) * FINE - 0.5
    mask = np.zeros((SIZE[1] * FINE, SIZE[0] * FINE), np.uint8)
    cv2.fillPoly(mask, [np.round(limb * 16).astype(np.int32).reshape(-1, 1, 2)], 255, shift=4)
    level = 0.1 + 0.5 * cv2.resize(mask, SIZE, interpolation=cv2.INTER_AREA).astype(np.float32) / 255
    level = cv2.GaussianBlur(level, (0, 0), 0.5)
    level += noise * np.random.default_rng(seed).normal(size=level.shape).astype(np.float32)
    return GrayPart(level, np.ones(level.shape, bool))


def off_the_ball(limb: Limb, pose) -> np.ndarray:
    """Pixels (n,) by which its points lie beside the true outline."""
    return cone_residual(CAMERA.rays(limb.pixels), pose.apply(BALL), RADIUS, focal(CAMERA))


@pytest.mark.parametrize("angle", [0.0, 0.5, 1.9])
@pytest.mark.parametrize("shift", [-1.3, 0.0, 0.4])
def test_a_straight_edge_is_found_where_it_is(angle, shift):
    """A blurred step through the middle: its place along the normal, whatever its slant. OpenCV takes places
    between pixels to a 32nd of one, which the parabola through three of them four a pixel turns into twice as much."""
    normal = np.array([np.cos(angle), np.sin(angle)])
    y, x = np.mgrid[0:60, 0:60]
    level = 1 / (1 + np.exp(-2.5 * ((np.stack([x, y], axis=-1) - 29.5) @ normal - shift)))
    part = GrayPart((0.1 + 0.6 * level).astype(np.float32), np.ones((60, 60), bool))
    along = np.array([-normal[1], normal[0]])
    places = 29.5 + np.arange(-6, 7, 3.0)[:, None] * along
    edge, _, clear = find_edges(part, places, np.tile(normal, (5, 1)), 4.0)
    assert clear.all()
    np.testing.assert_allclose((edge - places) @ normal, shift, atol=2 / 32)
    np.testing.assert_allclose((edge - places) @ along, 0.0, atol=1e-9)


def test_no_edge_is_clear_where_there_is_none_or_something_is_not_usable():
    flat = np.full((60, 60), 0.3, np.float32)
    ramp = flat + np.linspace(0, 0.3, 60, dtype=np.float32)
    places, normals = np.array([[30.0, 30.0], [20.0, 40.0]]), np.array([[1.0, 0], [1.0, 0]])
    for level in (flat, ramp):
        assert not find_edges(GrayPart(level, np.ones((60, 60), bool)), places, normals, 4.0)[2].any()
    step = np.where(np.arange(60) < 30, 0.1, 0.6).astype(np.float32) * np.ones((60, 1), np.float32)
    usable = np.ones((60, 60), bool)
    usable[38:43, 28:32] = False
    assert find_edges(GrayPart(step, usable), np.array([[29.5, 20.0], [29.5, 40.0]]), normals, 4.0)[
        2
    ].tolist() == [
        True,
        False,
    ]


def test_a_part_of_the_picture_shows_the_same_edges():
    whole = picture(POSES[0])
    x0, y0 = 50, 31
    part = GrayPart(whole.level[y0:, x0:].copy(), whole.usable[y0:, x0:], (x0, y0))
    one, other = (find_limb(p, CAMERA, POSES[0], BALL, RADIUS, 4.0) for p in (whole, part))
    np.testing.assert_allclose(one.pixels, other.pixels, atol=1e-4)  # places are float32


@pytest.mark.parametrize("k", range(len(POSES)))
def test_the_limb_of_a_ball_beside_its_place_is_found(k):
    """It stands 0.4 mm, two pixels, beside where the manifest has it."""
    limb = settled_limb(
        picture(POSES[k], seed=k), CAMERA, POSES[k], BALL + np.array([0.4, -0.2, 0]), RADIUS, 5.0
    )
    assert len(limb) > 0.9 * LIMB_POINTS
    off = off_the_ball(limb, POSES[k])
    # all points of a limb may share a tenth of a pixel, which the adjustment reckons with
    assert abs(off.mean()) < 0.1 and off.std() < 0.1 and (np.abs(off) < limb.sigma).mean() > 0.95


def test_several_limbs_tell_where_it_stands():
    """Limbs of 72 points, drawn true: the manifest's place, off by a fiftieth of the radius, has no say."""
    limbs = [Limb(outline(CAMERA, pose, BALL, RADIUS, 72), np.full(72, 0.5)) for pose in POSES]
    center, radius = place_ball(CAMERA, POSES, limbs, BALL + np.array([0.2, -0.1, 0.15]), 1.002 * RADIUS)
    assert np.linalg.norm(center - BALL) < 0.03 and abs(radius - RADIUS) < 0.03
    alone, _ = place_ball(CAMERA, [], [], BALL, RADIUS)
    np.testing.assert_allclose(alone, BALL, atol=1e-9)  # without limbs the manifest's


def test_no_limb_is_found_of_a_ball_that_is_not_there():
    blank = GrayPart(np.full(SIZE[::-1], 0.3, np.float32), np.ones(SIZE[::-1], bool))
    assert settled_limb(blank, CAMERA, POSES[0], BALL, RADIUS, 5.0) is None
