"""The surroundings' radiance: of a Lambert plane it is known, cell by cell, and what is hidden is filled in."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.radiometry.surround import (
    FAR,
    NEAR,
    backdrop,
    completed,
    near_shown,
    radiance_around,
    surround_of,
)
from photogonio.calib.setup import Light, Setup, ViewSetup
from photogonio.capture.photoset import MirrorBall, Sphere
from photogonio.capture.radiance import RadianceImage
from tests.drawn.boards import looking_at, plane_points, radiance

SIZE = (400, 300)
CAMERA = Camera(np.array([[330.0, 0, 201.0], [0, 330.0, 148.0], [0, 0, 1]]), np.zeros(5), SIZE)
SAMPLE = Sphere(np.array([5.0, -3, 10]), 10.0)
LAMP = Light("lamp", "point", np.array([120.0, 60, 200]), np.zeros((3, 3)), "given")
STRENGTH = np.array([4e4, 3e4, 2e4])
ALBEDO = np.array([0.6, 0.5, 0.3])
# of a cell 1.2 radii wide at least 0.4 is read: the mean lies at most 0.3 widths off its middle, and the light
# changes by at most 3 over the lamp's height in a length
PARTLY = 0.3 * 1.2 * SAMPLE.radius * 3 / LAMP.place[2]


def setup(poses: list[Pose], light: Light = LAMP) -> Setup:
    views = tuple(
        ViewSetup(f"{k}.png", light, p, STRENGTH, 0.01 * STRENGTH, "white patch") for k, p in enumerate(poses)
    )
    return Setup(CAMERA, SAMPLE, views, "absolute", ("R", "G", "B"))


def eyes(*places: tuple[float, float, float]) -> list[Pose]:
    return [looking_at(np.array(p), SAMPLE.center) for p in places]


def photo(pose: Pose, light: Light = LAMP) -> RadianceImage:
    """A Lambert plane, lit without a shadow, wherever the camera looks."""
    x, y = (v.mean(0) for v in plane_points(CAMERA, pose))
    toward, falloff = light.toward(np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]))
    shape = (toward[:, 2] * falloff).reshape(x.shape)
    value = shape[..., None] * STRENGTH * ALBEDO / np.pi
    return replace(radiance(shape, 0.0, 3), value=value.astype(np.float32))


def lambert(points: np.ndarray, light: Light = LAMP) -> np.ndarray:
    offset = light.place - points
    shape = offset[:, 2] / np.linalg.norm(offset, axis=1) ** 3
    return shape[:, None] * STRENGTH * ALBEDO / np.pi


SIDES = eyes((5, -190, 210), (190, 60, 210), (-170, 80, 210))


def measure_surround(whole: Setup, view: ViewSetup, image: RadianceImage, balls: tuple[MirrorBall, ...] = ()):
    """What one photo in memory shows of the surroundings."""
    x0, y0 = image.origin
    height, width = image.valid.shape

    def read_at(pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        column, row = pixels[:, 0] - x0, pixels[:, 1] - y0
        return image.value[row, column], image.valid[row, column]

    bounds = (x0, y0, x0 + width, y0 + height)
    return surround_of(whole, view, radiance_around(whole, view, read_at, bounds, balls))


@pytest.fixture(scope="module")
def measured():
    whole = setup(SIDES)
    return [measure_surround(whole, v, photo(v.pose)) for v in whole.views]


def small(one):
    """(m,) which cells are so small that their middle stands for all of them."""
    return one.area < one.area.max()


def test_cells_tile_the_plane_about_the_samples_foot(measured):
    one = measured[0]
    np.testing.assert_array_equal(one.points[:, 2], 0.0)
    np.testing.assert_allclose(one.points.mean(0)[:2], SAMPLE.center[:2], atol=1e-9)
    # squares of side 2 FAR less the ring where coarse cells give way to fine ones
    reach = np.abs(one.points[:, :2] - SAMPLE.center[:2]).max()
    assert reach < FAR * SAMPLE.radius
    fine = np.isclose(one.area, one.area.min())
    assert one.area[fine].sum() == pytest.approx((2 * NEAR * SAMPLE.radius) ** 2)


def test_the_cells_are_all_of_the_plane_that_matters(measured):
    """A point of the ball's waist faces a plane without end in half of its view, weighted by the cosine."""
    one, waist = measured[0], SAMPLE.center + np.array([SAMPLE.radius, 0.0, 0.0])
    offset = one.points - waist
    squared = (offset**2).sum(1)
    facing, falling = np.maximum(offset[:, 0], 0.0), waist[2]
    share = (one.area * facing * falling / (np.pi * squared**2)).sum()
    # what lies lower than 2 degrees below the horizon is not there: 4 %; cells are points: 2 % near the foot
    assert share == pytest.approx(0.5, rel=0.07)


def test_a_cell_reads_what_the_plane_sends(measured):
    for one in measured:
        seen = np.isfinite(one.radiance).all(1) & small(one)
        assert seen.sum() > 50
        # a cell is a mean over its width: curvature of the falloff, and the nearest pixel, stay below a percent
        np.testing.assert_allclose(one.radiance[seen], lambert(one.points[seen]), rtol=0.01)


def test_the_lamps_irradiance_is_cosine_over_square(measured):
    one = measured[0]
    true = lambert(one.points) * np.pi / ALBEDO
    np.testing.assert_allclose(one.lamp[small(one)], true[small(one)], rtol=1e-12)
    wide = np.flatnonzero(~small(one))
    side = np.sqrt(one.area[wide[0]])
    offset = (np.stack(np.meshgrid(*2 * [np.arange(40)]), axis=-1).reshape(-1, 2) - 19.5) / 40 * side
    for k in wide:
        within = one.points[k] + np.column_stack([offset, np.zeros(len(offset))])
        np.testing.assert_allclose(one.lamp[k], (lambert(within) * np.pi / ALBEDO).mean(0), rtol=0.02)


def test_nothing_is_read_behind_the_sample(measured):
    for one, pose in zip(measured, SIDES, strict=True):
        ray = one.points - pose.center
        along = ray @ (SAMPLE.center - pose.center) / (ray**2).sum(1)
        apart = np.linalg.norm(pose.center + along[:, None] * ray - SAMPLE.center, axis=1)
        deep = apart < 0.7 * SAMPLE.radius
        assert deep.sum() > 3
        assert np.isnan(one.radiance[deep]).all()


def test_nothing_is_read_behind_a_mirror_ball():
    whole = setup(SIDES[:1])
    ball = MirrorBall(np.array([-25.0, -5, 9]), 9.0)
    view = whole.views[0]
    without = measure_surround(whole, view, photo(view.pose))
    beside = measure_surround(whole, view, photo(view.pose), (ball,))
    lost = np.isfinite(without.radiance).all(1) & ~np.isfinite(beside.radiance).all(1)
    assert lost.sum() > 3
    kept = np.isfinite(beside.radiance)
    np.testing.assert_allclose(beside.radiance[kept], without.radiance[kept], rtol=PARTLY)


def test_what_one_photo_hides_the_others_fill_in(measured):
    filled = completed(measured)
    for before, after in zip(measured, filled, strict=True):
        assert np.isfinite(after.radiance).all()
        seen = np.isfinite(before.radiance)
        np.testing.assert_array_equal(after.radiance[seen], before.radiance[seen])
        guessed = ~seen.all(1) & small(before)
        assert guessed.any()
        expected = lambert(after.points[guessed]) * after.lit[guessed, None]
        np.testing.assert_allclose(after.radiance[guessed], expected, rtol=0.02, atol=1e-12)


def test_the_sample_shades_cells_away_from_the_lamp_and_none_toward_it(measured):
    one = measured[0]
    offset = one.points[:, :2] - SAMPLE.center[:2]
    toward = offset @ (LAMP.place[:2] - SAMPLE.center[:2])
    assert (one.lit < 0.5).any()
    assert (toward[one.lit < 0.5] < 0.3 * SAMPLE.radius * np.linalg.norm(LAMP.place[:2])).all()
    # a ball's shadow on the plane: the ellipse of the lamp's cone, pi r^2 / cos wide for a distant lamp
    rays = SAMPLE.center - LAMP.place
    cosine = -rays[2] / np.linalg.norm(rays)
    stretch = (LAMP.place[2] / (LAMP.place[2] - SAMPLE.center[2])) ** 2
    shadow = ((1 - one.lit) * one.area).sum()
    assert shadow == pytest.approx(np.pi * SAMPLE.radius**2 / cosine * stretch, rel=0.1)


def test_an_invalid_picture_shows_nothing():
    whole = setup(SIDES[:1])
    view = whole.views[0]
    image = photo(view.pose)
    blind = replace(image, valid=np.zeros_like(image.valid))
    one = measure_surround(whole, view, blind)
    assert np.isnan(one.radiance).all()
    np.testing.assert_array_equal(completed([one])[0].radiance, 0.0)


def test_a_cut_out_is_read_at_its_own_place():
    whole = setup(SIDES[:1])
    view = whole.views[0]
    image = photo(view.pose)
    x, y = 90, 60
    part = RadianceImage(
        *(a[y:240, x:330] for a in (image.value, image.variance, image.valid, image.saturated)), origin=(x, y)
    )
    all_, some = (measure_surround(whole, view, i) for i in (image, part))
    both = np.isfinite(all_.radiance) & np.isfinite(some.radiance) & small(all_)[:, None]
    assert both.all(1).sum() > 50
    np.testing.assert_allclose(some.radiance[both], all_.radiance[both], rtol=PARTLY)


def test_a_distant_lamp_lights_all_cells_alike():
    far = Light("far", "directional", np.array([0.48, 0.36, 0.8]), np.zeros((3, 3)), "given")
    whole = setup(SIDES[:1], far)
    one = measure_surround(whole, whole.views[0], photo(SIDES[0], far))
    np.testing.assert_allclose(one.lamp, np.broadcast_to(0.8 * STRENGTH, one.lamp.shape), rtol=1e-12)


def test_views_without_a_surround_have_none_to_fill_in():
    assert completed([None, None]) == (None, None)


def test_what_any_photo_shows_near_the_sample_is_shown(measured):
    """A camera above one side sees all but what the ball hides of cells near it; three sides leave the foot."""
    single = [near_shown([one.radiance]) for one in measured]
    together = near_shown([one.radiance for one in measured])
    foot = np.pi / (2 * NEAR) ** 2  # the ball's own disc among the near cells
    assert max(single) < together
    assert 1.0 - 2.0 * foot < together < 1.0
    assert near_shown([np.full_like(measured[0].radiance, np.nan), None]) == 0.0
    assert near_shown([None]) == 0.0


def backdrop_of(image: RadianceImage, *balls: MirrorBall) -> np.ndarray:
    whole = setup(SIDES[:1])
    bounds = (1, 1, SIZE[0] - 1, SIZE[1] - 1)

    def read_at(pixels):
        x, y = pixels.T
        return image.value[y, x], image.valid[y, x]

    return backdrop(whole, whole.views[0], read_at, bounds, balls)


def test_a_backdrop_is_the_mean_of_what_is_seen_beside_the_balls():
    ball = MirrorBall(np.array([-25.0, -5, 9]), 9.0)
    image = photo(SIDES[0])
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    rays = CAMERA.world_rays(SIDES[0], np.column_stack([x.ravel(), y.ravel()]).astype(float))
    even = np.full_like(image.value, 0.25)
    for one in (SAMPLE, ball):
        offset = one.center - SIDES[0].center
        covered = np.linalg.norm(np.cross(rays, offset), axis=1).reshape(SIZE[::-1]) < one.radius
        assert covered.sum() > 300
        even[covered] = 7.0
    np.testing.assert_allclose(backdrop_of(replace(image, value=even), ball), 0.25, rtol=1e-6)
    assert (backdrop_of(replace(image, value=even)) > 0.25).all()  # the mirror ball, if nobody names it


def test_a_clipped_backdrop_or_one_that_the_ball_fills_tells_nothing():
    image = photo(SIDES[0])
    blind = replace(image, valid=np.zeros_like(image.valid))
    assert np.isnan(backdrop_of(blind)).all()
    whole = setup(SIDES[:1])
    whole = replace(whole, sample=Sphere(SAMPLE.center, 250.0))
    found = backdrop(whole, whole.views[0], lambda pixels: pytest.fail("nothing to read"), (1, 1, 399, 299))
    assert np.isnan(found).all()
