"""Light from all over the sky on a ball and on a plane, against what radiometry says of it."""

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Pose
from photogonio.calib.radiometry.surround import Surround
from photogonio.calib.setup import Light, ViewSetup
from photogonio.capture.photoset import Plane, Sphere
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.lighting.stray_light import SKY, StrayLight
from photogonio.reconstruct.lobes.families import families
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


def coat(roughness: float) -> Model:
    """A narrow gloss alone: of every patch but the mirrored one next to nothing is seen."""
    lobes = LobeSet((families(absolute=True)[1],), (np.array([roughness]),))
    return Model(Basis("isotropic", 0), np.zeros((1, 1)), lobes, np.full((1, 1), 0.05))


def around(parts: int) -> Surround:
    """White paper about a ball of radius 10 that stands on it, in squares of 4 that are cut into ``parts`` a side."""
    step = 4.0 / parts
    line = (np.arange(-9 * parts, 9 * parts) + 0.5) * step
    flat = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    one = np.ones((len(flat), 1))
    return Surround(np.column_stack([flat, 0.0 * one]), np.full(len(flat), step**2), one, one, one[:, 0])


@pytest.mark.parametrize("roughness", [0.05, 0.1])
def test_what_a_gloss_mirrors_of_the_paper_does_not_hang_on_how_it_is_cut(roughness):
    """Squares of 4 seen from 10 are ten times as wide as the gloss of 0.05: as one source each, what is mirrored is
    nothing or many times too much. In parts it is what 144 squares for each give, but for the parts' own width, and the
    tangent plane that cuts them."""
    ball = Sphere(np.array([0.0, 0.0, 10.0]), 10.0)
    height = np.radians([10.0, 15.0, 20.0, 35.0])
    normal = np.column_stack([np.zeros(4), -np.cos(height), np.sin(height)])
    place = ball.center + 10.0 * normal
    pose = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 1000.0]))
    lamp = Light("L", "directional", np.array([0.0, -0.6, 0.8]), np.zeros((3, 3)), "given")
    seen = ViewSetup("s", lamp, pose, np.ones(1), np.zeros(1), "white patch")
    cells = cells_at(place)
    found, fine = (
        StrayLight(ball, [seen], [around(parts)])(cells, coat(roughness))[:, 0] for parts in (1, 12)
    )
    keep = fine > 0.1 * fine.max()
    assert keep.sum() >= 2
    np.testing.assert_allclose(found[keep], fine[keep], rtol=0.05)
