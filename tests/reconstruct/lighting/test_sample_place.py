"""A glossy ball that stands beside its place by a hundredth of its radius is put where its shading has it."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.setup import Light, Setup, ViewSetup
from photogonio.capture.photoset import Plane, Sphere
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.lighting.sample_place import by_place, moved_sample, replaced
from photogonio.reconstruct.lobes.families import families
from photogonio.reconstruct.table.cells import Cells

CAMERA = np.array([0.0, -400.0, 500.0])
BELIEVED = Sphere(np.array([0.0, 0.0, 25.0]), 25.0)
KNOWN = np.diag([0.12, 0.2, 0.1, 0.08]) ** 2
NOISE = 0.01
LIGHTS = np.array([[0.5, 0.2, 0.8], [-0.5, 0.3, 0.8], [0.1, -0.6, 0.8], [0.0, 0.3, 1.0], [-0.4, -0.4, 0.8]])
LIGHTS /= np.linalg.norm(LIGHTS, axis=1, keepdims=True)


def metal():
    family = families(absolute=True)[0]
    return Model(
        Basis("isotropic", 0), np.zeros((1, 1)), LobeSet((family,), (np.array([0.35]),)), np.array([[0.6]])
    )


def hit(sphere, rays):
    """Normals (n, 3) where ``rays`` (n, 3) meet the ball, and which do."""
    offset = CAMERA - sphere.center
    along = rays @ offset
    inside = along**2 - offset @ offset + sphere.radius**2
    place = offset - (along + np.sqrt(np.maximum(inside, 0.0)))[:, None] * rays
    return place / sphere.radius, inside > 0.0


def pairs(normal, rays, light):
    """Polar angles and azimuths between of light and camera about ``normal``."""
    cos_i, cos_r = normal @ light, -np.einsum("ij,ij->i", normal, rays)
    sines = np.sqrt(np.maximum((1 - cos_i**2) * (1 - cos_r**2), 1e-20))
    cos_d = np.clip((-rays @ light - cos_i * cos_r) / sines, -1.0, 1.0)
    return np.arccos(np.clip(cos_i, -1, 1)), np.arccos(np.clip(cos_r, -1, 1)), np.arccos(cos_d)


def seen(true, model=None):
    """A setup that has the ball at ``BELIEVED``, and the cells that photos of it at ``true`` give."""
    rng, model = np.random.default_rng(5), model or metal()
    aim = rng.uniform(-24.0, 24.0, (1200, 3)) + BELIEVED.center - CAMERA
    rays = aim / np.linalg.norm(aim, axis=1, keepdims=True)
    (normal, there), (taken, here) = hit(true, rays), hit(BELIEVED, rays)
    views, parts = [], []
    pose = Pose(np.eye(3), -CAMERA)
    for k, light in enumerate(LIGHTS):
        lit = there & here & (normal @ light > 0.3) & (taken @ light > 0.3)
        lit &= -np.einsum("ij,ij->i", taken, rays) > 0.3
        one, cos = Cells.of_angles(*pairs(normal[lit], rays[lit], light)), (normal @ light)[lit]
        value = model.evaluate(one) * (cos / (taken @ light)[lit])[:, None]
        value *= rng.normal(1.0, NOISE, value.shape)
        cells = replace(Cells.of_angles(*pairs(taken[lit], rays[lit], light)), value=value, binned=True)
        place = BELIEVED.center + BELIEVED.radius * taken[lit]
        parts.append(
            replace(
                cells,
                variance=(NOISE * value) ** 2,
                place=place,
                group=np.full(len(value), k),
                channels=("grey",),
            )
        )
        lamp = Light(f"L{k}", "directional", light, 1e-8 * np.eye(3), "refined", 0.1)
        views.append(ViewSetup(f"v{k}", lamp, pose, np.ones(1), np.full(1, 0.002), "board"))
    names = ("theta_i", "phi_i", "theta_r", "phi_r", "dphi", "value", "variance", "count", "group", "place")
    joined = {name: np.concatenate([getattr(one, name) for one in parts]) for name in names}
    cells = replace(parts[0], **joined, groups=tuple(view.name for view in views))
    error = np.sqrt(np.diag(KNOWN))
    told = {
        "shift": [0.0, 0.0, 0.0],
        "shift_error": error[:3].tolist(),
        "radius_change": 0.0,
        "radius_error": float(error[3]),
        "covariance": KNOWN.tolist(),
    }
    camera = Camera(np.eye(3), np.zeros(5), (640, 480))
    setup = Setup(camera, BELIEVED, tuple(views), "absolute", ("grey",), residuals={"sample": told})
    return setup, cells


def test_a_glossy_ball_is_put_where_its_shading_has_it():
    true = Sphere(np.array([0.12, 0.08, 24.9]), 24.93)
    setup, cells = seen(true)
    moved = moved_sample(cells, metal(), setup)
    after = replaced(setup, moved)
    change = np.append(true.center - BELIEVED.center, true.radius - BELIEVED.radius)
    off = moved.change - change
    # four normal numbers of that covariance: beyond 4.3 once in a thousand; a step is linear to a tenth of a move
    assert off @ np.linalg.solve(moved.covariance + np.diag((0.1 * change) ** 2), off) < 4.3**2
    assert np.abs(off[0]) < 0.2 * np.abs(change[0])
    assert after.sample.radius == pytest.approx(BELIEVED.radius + moved.change[3])
    assert after.residuals["sample"]["shift"] == pytest.approx(moved.change[:3])


def test_a_ball_in_its_place_stays():
    setup, cells = seen(BELIEVED)
    assert moved_sample(cells, metal(), setup) is None


def test_neither_planes_nor_few_views_nor_wild_moves_are_heeded():
    setup, cells = seen(Sphere(np.array([0.12, 0.08, 24.9]), 24.93))
    plane = Plane(np.array([[0.0, 0.0], [50.0, 0.0], [50.0, 50.0]]), 0.0)
    assert moved_sample(cells, metal(), replace(setup, sample=plane)) is None
    assert moved_sample(cells.take(cells.group < 3), metal(), setup) is None
    sure = setup.residuals["sample"] | {"covariance": (1e-4 * KNOWN).tolist()}
    held = replace(setup, residuals={"sample": sure})
    moved = moved_sample(cells, metal(), held)
    assert moved is None or np.abs(moved.change[0]) < 0.06


def test_setups_that_do_not_say_how_sure_the_place_is_are_left_alone():
    setup, cells = seen(Sphere(np.array([0.12, 0.08, 24.9]), 24.93))
    told = {key: one for key, one in setup.residuals["sample"].items() if key != "covariance"}
    for sample in (None, told, told | {"covariance": np.zeros((4, 4)).tolist()}):
        assert moved_sample(cells, metal(), replace(setup, residuals={"sample": sample})) is None


def test_what_the_place_leaves_unsure_is_what_moving_the_ball_does():
    """Four moves of one standard deviation each, of which any is a sum: their squares add up to the covariance."""
    setup, cells = seen(BELIEVED)
    changes = by_place(setup)(cells, metal())
    assert changes.shape == (len(cells), 4, 1)
    inner = (cells.theta_i < 1.0) & (cells.theta_r < 1.0)
    root = np.linalg.cholesky(KNOWN)
    for k, move in enumerate(root.T):
        there = Sphere(BELIEVED.center + move[:3], BELIEVED.radius + move[3])
        rays = cells.place - CAMERA
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        true = np.empty(len(cells))
        for group, light in enumerate(LIGHTS):
            rows = cells.group == group
            normal = hit(there, rays[rows])[0] / there.radius * BELIEVED.radius
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            value = metal().evaluate(Cells.of_angles(*pairs(normal, rays[rows], light)))[:, 0]
            true[rows] = value * (normal @ light) / np.cos(cells.theta_i[rows])
        said = changes[:, k, 0]
        off = true - metal().evaluate(cells)[:, 0] - said
        assert np.sqrt(np.mean(off[inner] ** 2)) < 0.05 * np.sqrt(np.mean(said[inner] ** 2))  # second order
    assert by_place(replace(setup, residuals={})) is None
