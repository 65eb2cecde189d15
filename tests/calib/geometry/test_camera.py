"""Points to pixels and back, and rigid motions as a group."""

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Camera, Pose

MATRIX = np.array([[1010.0, 0, 322.5], [0, 995.0, 236.25], [0, 0, 1]])
LENSES = {
    "none": np.zeros(0),
    "k1 k2 p1 p2 k3": np.array([-0.13, 0.09, 6e-4, -4e-4, 0.02]),
    "rational": np.array([0.2, -0.05, 3e-4, -2e-4, 0.01, 0.15, -0.03, 0.004]),
}


def pose(seed: int) -> Pose:
    rng = np.random.default_rng(seed)
    return Pose.from_rodrigues(rng.normal(size=3), rng.normal(size=3) * 20)


@pytest.fixture(params=LENSES)
def camera(request: pytest.FixtureRequest) -> Camera:
    return Camera(MATRIX, LENSES[request.param], (640, 480))


@pytest.fixture
def pixels() -> np.ndarray:
    x, y = np.meshgrid(np.linspace(0, 639, 9), np.linspace(0, 479, 7))
    return np.column_stack([x.ravel(), y.ravel()])


def test_a_ray_projects_back_to_its_pixel_at_any_depth(camera, pixels):
    rays = camera.rays(pixels)
    depth = np.linspace(0.1, 900.0, len(rays))[:, None]
    here = Pose(np.eye(3), np.zeros(3))
    np.testing.assert_allclose(camera.project(here, depth * rays), pixels, atol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1.0, atol=1e-14)


def test_world_rays_start_at_the_camera_and_pass_through_what_the_pixel_shows(camera, pixels):
    stand = pose(3)
    rays = camera.world_rays(stand, pixels)
    seen = stand.center + 70.0 * rays
    np.testing.assert_allclose(camera.project(stand, seen), pixels, atol=1e-7)
    np.testing.assert_allclose(stand.apply(stand.center), 0.0, atol=1e-12)


def test_of_no_points_there_are_no_pixels_and_no_rays(camera):
    assert camera.project(pose(1), np.zeros((0, 3))).shape == (0, 2)
    assert camera.rays(np.zeros((0, 2))).shape == camera.world_rays(pose(1), np.zeros((0, 2))).shape == (0, 3)


def test_distortion_follows_the_stated_polynomial():
    k1, k2, p1, p2, k3 = LENSES["k1 k2 p1 p2 k3"]
    x, y = 0.21, -0.14
    square = x * x + y * y
    radial = 1 + k1 * square + k2 * square**2 + k3 * square**3
    bent = [
        x * radial + 2 * p1 * x * y + p2 * (square + 2 * x * x),
        y * radial + p1 * (square + 2 * y * y) + 2 * p2 * x * y,
        1.0,
    ]
    camera = Camera(MATRIX, LENSES["k1 k2 p1 p2 k3"], (640, 480))
    found = camera.project(Pose(np.eye(3), np.zeros(3)), np.array([[x, y, 1.0]]) * 5)
    np.testing.assert_allclose(found[0], (MATRIX @ bent)[:2], atol=1e-9)


def test_the_principal_point_is_where_the_axis_goes(camera):
    np.testing.assert_allclose(camera.rays(MATRIX[None, :2, 2]), [[0, 0, 1]], atol=1e-12)


def test_right_and_down_in_the_picture_are_x_and_y_of_the_camera(camera):
    rays = camera.rays(np.array([[600.0, 236.25], [322.5, 470.0]]))
    assert rays[0, 0] > 0.2
    assert rays[1, 1] > 0.2


def test_composing_poses_is_applying_one_after_the_other():
    first, second = pose(1), pose(2)
    points = np.random.default_rng(0).normal(size=(20, 3)) * 10
    both = (second @ first).apply(points)
    np.testing.assert_allclose(both, second.apply(first.apply(points)), atol=1e-12)


def test_composition_is_associative_but_does_not_commute():
    a, b, c = pose(1), pose(2), pose(3)
    left, right = (a @ b) @ c, a @ (b @ c)
    np.testing.assert_allclose(left.rotation, right.rotation, atol=1e-14)
    np.testing.assert_allclose(left.translation, right.translation, atol=1e-12)
    assert np.abs((a @ b).rotation - (b @ a).rotation).max() > 0.1


@pytest.mark.parametrize("seed", range(4))
def test_the_inverse_undoes_a_pose_from_either_side(seed):
    one = pose(seed)
    for both in (one @ one.inverse(), one.inverse() @ one):
        np.testing.assert_allclose(both.rotation, np.eye(3), atol=1e-14)
        np.testing.assert_allclose(both.translation, 0.0, atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_rotation_vectors_round_trip_and_keep_their_angle(seed):
    one = pose(seed)
    again = Pose.from_rodrigues(one.rodrigues(), one.translation)
    np.testing.assert_allclose(again.rotation, one.rotation, atol=1e-12)
    angle = np.linalg.norm(one.rodrigues())
    assert np.trace(one.rotation) == pytest.approx(1 + 2 * np.cos(angle), abs=1e-12)
    assert np.linalg.det(one.rotation) == pytest.approx(1.0, abs=1e-12)
