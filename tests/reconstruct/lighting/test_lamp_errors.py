"""What lamps' directions leave unsure is what turning them does to the cells, of lamps whose errors do not average."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.setup import Light
from photogonio.capture.photoset import Plane
from photogonio.reconstruct.lighting.lamp_errors import FEW, MUCH, by_lamps, doubted_views
from tests.reconstruct.lighting.test_sample_place import BELIEVED, LIGHTS, metal, pairs, seen

ERROR = np.radians(0.3)  # about any axis across a lamp's direction


def setup_and_cells(kind="directional"):
    setup, cells = seen(BELIEVED)
    views = []
    for view in setup.views:
        light = replace(view.light, covariance=ERROR**2 * np.eye(3))
        if kind == "point":
            place = BELIEVED.center + 400.0 * light.place
            light = Light(light.id, "point", place, 400.0**2 * light.covariance, "mirror balls")
        views.append(replace(view, light=light))
    return replace(setup, views=tuple(views)), cells


def test_the_changes_are_those_of_turned_lamps():
    setup, cells = setup_and_cells()
    found = by_lamps(setup)(cells, metal())
    assert found.shape == (len(cells), 2 * len(LIGHTS), 1)
    model, eye = metal(), setup.views[0].pose.center
    for k, light in enumerate(LIGHTS):
        rows = cells.group == k
        own = found[:, 2 * k : 2 * k + 2]
        assert not own[~rows].any()
        normal = (cells.place[rows] - BELIEVED.center) / BELIEVED.radius
        rays = cells.place[rows] - eye
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)

        def radiance(toward, normal=normal, rays=rays):
            toward = toward / np.linalg.norm(toward)
            there = type(cells).of_angles(*pairs(normal, rays, toward))
            return model.evaluate(there)[:, 0] * (normal @ toward)

        now = radiance(light)
        across = np.linalg.svd(light[None])[2][1:]
        slopes = [(radiance(light + 1e-4 * a) - radiance(light - 1e-4 * a)) / (2e-4 * now) for a in across]
        value = model.evaluate(cells.take(rows))[:, 0]
        expected = ERROR**2 * sum((value * one) ** 2 for one in slopes)
        np.testing.assert_allclose(
            (own[rows, :, 0] ** 2).sum(1), expected, rtol=1e-3, atol=1e-9 * value.max() ** 2
        )


def test_a_near_lamp_turns_as_its_distance_has_it():
    sets = [setup_and_cells(kind) for kind in ("directional", "point")]
    far, near = (by_lamps(setup)(cells, metal()) for setup, cells in sets)
    size = [np.sqrt((one**2).mean()) for one in (far, near)]
    assert size[1] == pytest.approx(size[0], rel=0.2)  # the ball is a sixteenth of the distance away


def test_a_flat_sample_is_as_bright_as_its_patch():
    setup, cells = setup_and_cells()
    flat = replace(setup, sample=Plane(np.array([[-30.0, -30.0], [30.0, -30.0], [0.0, 30.0]])))
    model = replace(metal(), coefficients=np.full((1, 1), 0.3), lobe_coefficients=np.zeros((1, 1)))
    flat, round_ = (np.abs(by_lamps(one)(cells, model)).max() for one in (flat, setup))
    assert (
        flat < 0.01 * round_
    )  # a matte piece, however its lamps stand: its lobe of no weight keeps a trifle


def test_of_many_lamps_only_those_of_many_views_are_heeded():
    setup, cells = setup_and_cells()
    times = -(-FEW // len(LIGHTS))
    views = [replace(v, name=f"{v.name} {k}") for k in range(times) for v in setup.views]
    group = np.arange(len(cells)) % len(views)
    many = replace(cells, group=group, groups=tuple(v.name for v in views))
    own = [replace(v, light=replace(v.light, id=v.name)) for v in views]
    shared = by_lamps(replace(setup, views=tuple(views)))(many, metal())
    assert shared.shape[1] == 2 * len(LIGHTS)
    apart = replace(setup, views=tuple(own))
    assert by_lamps(apart)(many, metal()).shape[1] == 0
    assert by_lamps(apart, every=True)(many, metal()).shape[1] == 2 * len(views)


def test_of_a_flat_sample_a_lamp_whose_place_is_all_but_unknown_is_heeded_and_its_view_doubted():
    setup, cells = setup_and_cells()
    times = -(-FEW // len(LIGHTS))
    views = [
        replace(
            v, name=f"{v.name} {k}", light=replace(v.light, id=f"{v.name} {k}", covariance=1e-6 * np.eye(3))
        )
        for k in range(times)
        for v in setup.views
    ]
    unsure = views[1].light
    views[1] = replace(views[1], light=replace(unsure, covariance=np.radians(3.0) ** 2 * np.eye(3)))
    flat = Plane(np.array([[-30.0, -30.0], [30.0, -30.0], [0.0, 30.0]]))
    flat = replace(setup, sample=flat, views=tuple(views))
    many = replace(cells, group=np.arange(len(cells)) % len(views), groups=tuple(view.name for view in views))
    found, every = by_lamps(flat)(many, metal()), by_lamps(flat, every=True)(many, metal())
    np.testing.assert_array_equal(found, every[:, 2:4])
    assert not found[many.group != 1].any()
    doubt = doubted_views(flat)(many, metal())
    own, value = found[many.group == 1], metal().evaluate(many.take(many.group == 1))
    assert doubt[1] == pytest.approx(np.sqrt(np.mean((own**2).sum(1) / value**2))) and doubt[1] > MUCH
    assert not np.delete(doubt, 1).any()
    assert not doubted_views(replace(flat, sample=setup.sample))(many, metal()).any()
