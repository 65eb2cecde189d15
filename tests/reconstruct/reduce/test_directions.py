"""Pixels to directions: the geometry against what it must be in space."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from photogonio.capture.photoset import MirrorBall, WhitePatch
from photogonio.reconstruct.reduce.directions import (
    CANONICAL_AZIMUTH,
    OUTSIDE,
    USED,
    ReduceOptions,
    canonical,
    pairs_at,
    region_of,
    region_pixels,
    scene_of,
)
from photogonio.reconstruct.table.facet_table import LEFT_OUT

BARE = ReduceOptions()


def all_pairs(world, options=None):
    scene = scene_of(world.setup, world.view, options or world.options)
    pixels = region_pixels(region_of(world.setup, world.view.pose))
    return scene, pixels, pairs_at(scene, world.setup.camera, pixels)


def left_out(pairs, name):
    return pairs.reason == LEFT_OUT.index(name)


@pytest.mark.parametrize("kind", ["ball", "plane"])
def test_points_come_back_from_their_pixels(world, kind):
    """Points of the surface, projected, are met again by the rays of those pixels."""
    world = world(kind)
    scene, _, pairs = all_pairs(world, BARE)
    points = pairs.point[pairs.reason == USED][::37]
    pixels = world.setup.camera.project(world.view.pose, points)
    again = pairs_at(scene, world.setup.camera, pixels)
    # near the outline a ray's error is magnified by distance / (radius cos_r), some hundred times
    np.testing.assert_allclose(again.point, points, atol=1e-6)


def test_directions_of_a_ball_are_those_in_space(world):
    world = world("ball")
    _, _, pairs = all_pairs(world, BARE)
    used = pairs.reason == USED
    point, sample, view = pairs.point[used], world.setup.sample, world.view
    normal = (point - sample.center) / sample.radius
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, atol=1e-9)
    to_light = view.light.place - point
    distance = np.linalg.norm(to_light, axis=1)
    to_eye = view.pose.center - point
    to_eye /= np.linalg.norm(to_eye, axis=1)[:, None]
    cos_i = np.einsum("ij,ij->i", normal, to_light) / distance
    np.testing.assert_allclose(pairs.incident[used][:, 2], cos_i, atol=1e-9)
    np.testing.assert_allclose(pairs.exit[used][:, 2], np.einsum("ij,ij->i", normal, to_eye), atol=1e-9)
    np.testing.assert_allclose(pairs.irradiance[used], cos_i / distance**2, rtol=1e-8)
    # the angle between the two directions does not depend on the frame
    between = np.einsum("ij,ij->i", to_light / distance[:, None], to_eye)
    found = np.einsum("ij,ij->i", pairs.incident[used], pairs.exit[used])
    np.testing.assert_allclose(found, between, atol=1e-9)


def test_a_plane_keeps_its_azimuths(world):
    world = world("plane")
    _, _, pairs = all_pairs(world, replace(BARE, isotropic=False))
    used = pairs.reason == USED
    to_light = world.view.light.place - pairs.point[used]
    to_light /= np.linalg.norm(to_light, axis=1)[:, None]
    to_eye = world.view.pose.center - pairs.point[used]
    to_eye /= np.linalg.norm(to_eye, axis=1)[:, None]
    np.testing.assert_allclose(pairs.incident[used], to_light, atol=1e-9)
    np.testing.assert_allclose(pairs.exit[used], to_eye, atol=1e-9)


def test_a_directional_light_has_no_falloff(world):
    world = world("ball", light="directional")
    _, _, pairs = all_pairs(world, BARE)
    used = pairs.reason == USED
    np.testing.assert_allclose(pairs.irradiance[used], pairs.incident[used][:, 2], rtol=1e-12)


def test_canonical_keeps_angles_and_turns_the_azimuth():
    rng = np.random.default_rng(0)
    theta_i, theta_r = rng.uniform(0, np.pi / 2, (2, 500))
    phi_i, phi_r = rng.uniform(-np.pi, np.pi, (2, 500))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]  # any frame at all
    turn *= np.sign(np.linalg.det(turn))

    def unit(theta, phi):
        return np.column_stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])

    normal = np.broadcast_to(turn[:, 2], (500, 3))
    incident, exit_ = canonical(unit(theta_i, phi_i) @ turn.T, unit(theta_r, phi_r) @ turn.T, normal)
    dphi = phi_r - phi_i
    np.testing.assert_allclose(incident, unit(theta_i, np.full(500, CANONICAL_AZIMUTH)), atol=1e-12)
    # across the incident plane both 1 / sin_i and sqrt(1 - cos^2) lose digits near the pole
    np.testing.assert_allclose(exit_, unit(theta_r, CANONICAL_AZIMUTH + dphi), atol=1e-9)


def test_canonical_at_the_pole_and_in_the_mirror_direction():
    up = np.array([[0.0, 0.0, 1.0]])
    slant = np.array([[np.sin(0.7), 0.0, np.cos(0.7)]])
    incident, exit_ = canonical(up, slant, up)
    np.testing.assert_allclose(incident, up, atol=1e-15)
    np.testing.assert_allclose(exit_[:, 2], np.cos(0.7))
    np.testing.assert_allclose(np.linalg.norm(exit_, axis=1), 1.0)
    incident, exit_ = canonical(slant, slant * [-1, -1, 1], up)
    np.testing.assert_allclose(exit_, incident * [-1, -1, 1], atol=1e-15)


@pytest.mark.parametrize("kind", ["ball", "plane"])
def test_the_margin_is_kept_and_no_more(world, kind):
    """Against the outline projected to pixels: none nearer than the margin, all that are a pixel farther."""
    world = world(kind)
    _, pixels, pairs = all_pairs(world, BARE)
    polygon = outline_pixels(world).astype(np.float32)
    distance = np.array([cv2.pointPolygonTest(polygon, tuple(map(float, p)), True) for p in pixels])
    inside = ~left_out(pairs, "outline") & (pairs.reason != OUTSIDE)
    assert inside.sum() > 1000
    assert distance[inside].min() > BARE.margin - 0.05  # polygon chords, float32
    assert inside[distance > BARE.margin * 1.1 + 0.5].all()
    assert (pairs.reason[distance < -0.1] == OUTSIDE).all()
    assert (distance[pairs.reason == OUTSIDE] < 0.1).all()


def outline_pixels(world):
    """Pixels of the sample's outline, from first principles."""
    sample, pose = world.setup.sample, world.view.pose
    if hasattr(sample, "outline"):
        corners = np.column_stack([sample.outline, np.full(len(sample.outline), sample.height)])
        steps = np.linspace(0, 1, 200, endpoint=False)[:, None]
        sides = [a + steps * (b - a) for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)]
        return world.setup.camera.project(pose, np.concatenate(sides))
    axis = sample.center - pose.center
    distance = np.linalg.norm(axis)
    tangent = np.sqrt(distance**2 - sample.radius**2)  # length of the tangents from the eye
    along = tangent**2 / distance
    u, v = np.linalg.svd(axis[None] / distance)[2][1:]
    angle = np.linspace(0, 2 * np.pi, 2000, endpoint=False)[:, None]
    circle = sample.radius * tangent / distance * (np.cos(angle) * u + np.sin(angle) * v)
    return world.setup.camera.project(pose, pose.center + along * axis / distance + circle)


def test_what_the_lamp_does_not_wholly_shine_on_is_left_out(world):
    """Rim points of the lamp, straight: used pixels see all of them above their horizon."""
    world = world("ball")
    options = replace(BARE, theta_i_max=np.pi / 2, theta_r_max=np.pi / 2)
    _, _, pairs = all_pairs(world, options)
    lamp, sample = world.view.light, world.setup.sample
    normal = (pairs.point - sample.center) / sample.radius
    lowest = np.einsum("ij,ij->i", normal, lamp.place - pairs.point) - lamp.radius
    assert (lowest[pairs.reason == USED] > 0).all()
    assert (lowest[left_out(pairs, "unlit")] < 0.1).all()
    assert left_out(pairs, "unlit").sum() > 100


def test_grazing_pixels_are_left_out(world):
    world = world("ball")
    limits = replace(BARE, theta_i_max=np.radians(60.0), theta_r_max=np.radians(50.0))
    _, _, pairs = all_pairs(world, limits)
    used = pairs.reason == USED
    assert np.arccos(pairs.incident[used][:, 2]).max() <= np.radians(60.0)
    assert np.arccos(pairs.exit[used][:, 2]).max() <= np.radians(50.0)
    out = left_out(pairs, "grazing")
    beyond = (pairs.incident[:, 2] < np.cos(np.radians(60.0))) | (pairs.exit[:, 2] < np.cos(np.radians(50.0)))
    assert beyond[out].all() and out.any()


def hits(origin, ray, center, radius):
    """Whether rays (n, 3) of unit length from origin (n, 3) or (3,) meet a ball."""
    offset = center - origin
    along = np.einsum("...j,...j->...", offset, ray)
    return (along > 0) & (np.einsum("...j,...j->...", offset, offset) - along**2 < radius**2)


@pytest.mark.parametrize("kind", ["ball", "plane"])
def test_mirror_balls_cover_and_shade(world, kind):
    """By following rays: what a ball hides from the camera, or the lamp's rim from the point, is not used."""
    world = world(kind)
    eye, lamp, ball = world.view.pose.center, world.view.light, world.options.mirror_balls[0]
    if kind == "ball":  # one on a stand, in the lamp's way
        center = world.setup.sample.center
        toward = (lamp.place - center) / np.linalg.norm(lamp.place - center)
        ball = MirrorBall(center + 50.0 * toward + np.array([4.0, 0.0, 0.0]), 8.0)
    scene, pixels, pairs = all_pairs(world, replace(BARE, mirror_balls=(ball,)))
    rays = world.setup.camera.rays(pixels) @ scene.rotation
    hidden = hits(eye, rays, ball.center, ball.radius)
    assert not (hidden & (pairs.reason == USED)).any()
    if kind == "plane":
        assert left_out(pairs, "covered").sum() > 50
    rng = np.random.default_rng(1)
    used = pairs.reason == USED
    shaded = left_out(pairs, "shadowed")
    assert shaded.sum() > 20
    rim = lamp.place + lamp.radius * unit_rows(rng.normal(size=(40, 3)))
    core = np.zeros(shaded.sum(), bool)
    for place in rim:
        ray = unit_rows(place - pairs.point[used])
        assert not hits(pairs.point[used], ray, ball.center, ball.radius).any()
        wide = ball.radius * 1.12 + 1.0  # slack, and penumbra of points between the rim's
        core |= hits(pairs.point[shaded], unit_rows(place - pairs.point[shaded]), ball.center, wide)
    assert core.all()


def unit_rows(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def test_a_ball_that_took_the_samples_place_does_not_cover_it(world):
    world = world("ball")
    probe = MirrorBall(world.setup.sample.center + np.array([1.0, 0, 0]), world.setup.sample.radius * 1.1)
    _, _, pairs = all_pairs(world, replace(BARE, mirror_balls=(probe,)))
    assert not left_out(pairs, "covered").any() and (pairs.reason == USED).any()


def test_a_white_patch_covers_the_plane_it_lies_on(world):
    world = world("plane")
    _, pixels, pairs = all_pairs(world, replace(BARE, white_patches=world.options.white_patches))
    patch = world.options.white_patches[0]
    top = np.column_stack([patch.outline, np.full(4, patch.height)])
    polygon = world.setup.camera.project(world.view.pose, top).astype(np.float32)
    distance = np.array([cv2.pointPolygonTest(polygon, tuple(map(float, p)), True) for p in pixels])
    assert not ((distance > -BARE.margin + 0.1) & (pairs.reason == USED)).any()
    # its shadow: plane points from which the patch hides the lamp
    toward = world.view.light.place - pairs.point
    at = pairs.point + toward * ((patch.height - pairs.point[:, 2]) / toward[:, 2])[:, None]
    low, high = patch.outline.min(0), patch.outline.max(0)
    shaded = ((at[:, :2] > low) & (at[:, :2] < high)).all(axis=1)
    assert shaded.sum() > 100 and not (shaded & (pairs.reason == USED)).any()
    far = distance < -20.0
    assert not left_out(pairs, "covered")[far].any()


def test_a_patch_beneath_the_sample_or_behind_a_ball_covers_nothing(world):
    plane = world("plane")
    patch = WhitePatch(plane.options.white_patches[0].outline, 0.0, (0.9,))
    _, _, pairs = all_pairs(plane, replace(BARE, white_patches=(patch,)))
    assert not left_out(pairs, "covered").any()
    ball = world("ball")
    behind = WhitePatch(np.array([[60.0, 60], [130, 60], [130, 160], [60, 160]]), 0.3, (0.9,))
    _, _, pairs = all_pairs(ball, replace(BARE, white_patches=(behind,)))
    assert left_out(pairs, "covered").mean() < 0.001


def test_a_sample_outside_the_picture_has_no_region(world):
    world = world("ball")
    away = replace(world.view.pose, translation=world.view.pose.translation + np.array([1000.0, 0, 0]))
    assert region_of(world.setup, away) == (0, 0, 0, 0)
    behind = replace(world.view.pose, translation=world.view.pose.translation - np.array([0, 0, 1000.0]))
    assert region_of(world.setup, behind) == (0, 0, 0, 0)


@pytest.mark.parametrize("kind", ["ball", "plane"])
def test_the_region_holds_the_whole_sample(world, kind):
    world = world(kind)
    x0, y0, x1, y1 = region_of(world.setup, world.view.pose)
    low, high = outline_pixels(world).min(0), outline_pixels(world).max(0)
    assert x0 <= low[0] and y0 <= low[1] and x1 - 1 >= high[0] and y1 - 1 >= high[1]
    assert (x1 - x0) * (y1 - y0) < 1.2 * np.prod(high - low + 2)
