"""Light from all over the sky on a ball and on a plane, against what radiometry says of it."""

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Pose
from photogonio.calib.setup import Light, ViewSetup
from photogonio.capture.photoset import Plane, Sphere
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.lighting.stray_light import SKY, StrayLight
from photogonio.reconstruct.table.cells import Cells

ALBEDO, STRENGTH = 0.5, 3.0
SKY_RADIANCE = np.array([0.2])
RNG = np.random.default_rng(0)


def lambert() -> Model:
    return Model(Basis("isotropic", 0), np.array([[2 * ALBEDO]]), LobeSet(), np.zeros((0, 1)))


def view() -> ViewSetup:
    light = Light("L", "directional", np.array([0.0, 0.0, 1.0]), np.zeros((3, 3)), "given")
    pose = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 1000.0]))
    return ViewSetup("s", light, pose, np.array([STRENGTH]), np.zeros(1), "white patch")


def cells_at(place: np.ndarray) -> Cells:
    n = len(place)
    return Cells(
        theta_i=np.full(n, 0.3), phi_i=np.zeros(n), theta_r=np.full(n, 0.3), phi_r=np.zeros(n), dphi=np.zeros(n),
        value=np.ones((n, 1)), variance=np.ones((n, 1)), count=np.ones(n), group=np.zeros(n, int), place=place,
        groups=("s",), channels=("gray",), binned=True,
    )  # fmt: skip


def test_a_matte_ball_sees_the_sky_that_its_tangent_plane_leaves():
    """Irradiance pi L (1 + n_z) / 2 of a hemisphere cut by the ball's own plane (form factor of a wedge)."""
    normal = RNG.normal(size=(60, 3))
    normal[:, 2] = np.abs(normal[:, 2]) + 0.1
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    light = StrayLight(Sphere(np.zeros(3), 10.0), [view()], [None], SKY_RADIANCE)
    added = light(cells_at(10.0 * normal), lambert())[:, 0]
    sky = np.pi * SKY_RADIANCE[0] * (1.0 + normal[:, 2]) / 2.0
    # of SKY directions, those at the plane's edge weigh little: an even rule's error of about 1 / SKY
    np.testing.assert_allclose(added, ALBEDO / np.pi * sky / (STRENGTH * normal[:, 2]), rtol=2.0 / SKY)


def test_a_plane_sees_all_of_the_sky():
    outline = np.array([[-10.0, -10], [10, -10], [10, 10], [-10, 10]])
    light = StrayLight(Plane(outline, 0.0), [view()], [None], SKY_RADIANCE)
    place = np.column_stack([RNG.uniform(-9, 9, (5, 2)), np.zeros(5)])
    added = light(cells_at(place), lambert())[:, 0]
    np.testing.assert_allclose(added, ALBEDO * SKY_RADIANCE[0] / STRENGTH, rtol=1.0 / SKY)


@pytest.mark.parametrize("sky", [None, np.zeros(1)])
def test_a_dark_room_adds_nothing(sky):
    light = StrayLight(Sphere(np.zeros(3), 10.0), [view()], [None], sky)
    assert (light(cells_at(np.array([[0.0, 0, 10]])), lambert()) == 0.0).all()
