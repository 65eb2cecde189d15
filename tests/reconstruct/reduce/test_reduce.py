"""Photos to tables: a known surface must come back, with the noise that the photo has and no bias."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.setup import Light, Setup, ViewSetup
from photogonio.capture.linear.prepare import prepare
from photogonio.capture.manifest.load import load_photoset
from photogonio.reconstruct.reduce.directions import (
    USED,
    ReduceOptions,
    pairs_at,
    region_of,
    region_pixels,
    scene_of,
)
from photogonio.reconstruct.reduce.reduce import reduce_view
from photogonio.reconstruct.table.facet_table import LEFT_OUT, add_tables
from tests.places import DATA

FLOAT32 = 1e-7


def geometry(world):
    """cos * falloff at every pixel, NaN off the sample, from the plain form."""
    scene = scene_of(world.setup, world.view, ReduceOptions())
    region = region_of(world.setup, world.view.pose)
    pairs = pairs_at(scene, world.setup.camera, region_pixels(region))
    width, height = world.setup.camera.size
    image = np.full((height, width), np.nan)
    x0, y0, x1, y1 = region
    image[y0:y1, x0:x1] = np.where(pairs.reason == USED, pairs.irradiance, np.nan).reshape(y1 - y0, x1 - x0)
    return image


@pytest.mark.parametrize("kind", ["ball", "plane"])
@pytest.mark.parametrize("light", ["point", "directional"])
def test_a_matte_sample_comes_back(world, kind, light):
    """f = albedo / pi in every cell; what lies off the sample is NaN and must not be looked at."""
    world = world(kind, light=light)
    albedo = np.array([0.8, 0.5, 0.2])
    photo = world.photo(albedo / np.pi * world.view.strength * geometry(world)[..., None], 1e-3)
    table = reduce_view(world.setup, world.view, photo, 3, world.options)
    assert len(table) >= 8
    f = table.value / table.weight[:, None]
    # the mean of f, weighted by irradiance, of float32 pixels
    np.testing.assert_allclose(f, np.broadcast_to(albedo / np.pi, f.shape), rtol=FLOAT32 * 2)
    square = table.value2 / table.weight[:, None]
    np.testing.assert_allclose(square, f**2, rtol=FLOAT32 * 8)


def test_mean_directions_are_those_of_the_samples(world):
    """Of a function linear in both directions, the cell's mean is its value at the mean directions."""
    world = world("ball")
    scene = scene_of(world.setup, world.view, ReduceOptions())
    region = x0, y0, x1, y1 = region_of(world.setup, world.view.pose)
    pairs = pairs_at(scene, world.setup.camera, region_pixels(region))
    f = 0.3 + pairs.incident @ [0.02, -0.03, 0.1] + pairs.exit @ [0.05, 0.04, -0.06]
    width, height = world.setup.camera.size
    value = np.full((height, width, 3), np.nan)
    value[y0:y1, x0:x1] = ((f * pairs.irradiance)[:, None] * world.view.strength).reshape(y1 - y0, x1 - x0, 3)
    table = reduce_view(world.setup, world.view, world.photo(value, 1e-3), 2, world.options)
    w = table.weight[:, None]
    model = 0.3 + table.incident / w @ [0.02, -0.03, 0.1] + table.exit / w @ [0.05, 0.04, -0.06]
    np.testing.assert_allclose(table.value / w, np.repeat(model[:, None], 3, 1), rtol=4 * FLOAT32)


def test_a_dark_photo_is_not_pulled_down_by_its_own_noise(world):
    """Some ten electrons a pixel, each pixel's variance judged from its own reading.

    Weights of one over that variance would pull the mean down by about a tenth.
    """
    world = world("ball", scale=2.0)
    gain = 1e-3  # radiance of one electron
    radiance = 0.3 * world.view.strength * geometry(world)[..., None]
    scale = 0.02 / np.nanmax(radiance)  # at most 20 electrons
    rng = np.random.default_rng(4)
    electrons = rng.poisson(np.nan_to_num(scale * radiance) / gain)
    photo = replace(
        world.photo(gain * electrons), variance=(gain**2 * np.maximum(electrons, 1)).astype(np.float32)
    )
    view = replace(world.view, strength=scale * world.view.strength)
    table = reduce_view(world.setup, view, photo, 3, replace(world.options, theta_i_max=np.radians(70.0)))
    total = table.value.sum(0) / table.weight.sum()
    error = np.sqrt(table.variance.sum(0)) / table.weight.sum()
    assert (error / 0.3 < 0.01).all()
    assert (np.abs(total - 0.3) < 4.0 * error).all()


def test_weights_are_one_over_the_variance_of_a_typical_pixel(world):
    """Photon noise: the weight of every cell is its count over the variance of one of its samples."""
    world = world("ball")
    radiance = 0.3 * world.view.strength * geometry(world)[..., None]
    gain = 1e-5
    photo = replace(world.photo(radiance), variance=(gain * radiance).astype(np.float32))
    table = reduce_view(world.setup, world.view, photo, 3, world.options)
    inverse = table.weight**2 / table.variance.mean(1)  # one over the variance of the cell's mean
    ratio = table.weight / inverse
    # channels differ in strength, by which the mean over them of var(f) is not that of E: some per cent
    np.testing.assert_allclose(ratio, 1.0, atol=0.1)
    assert np.ptp(ratio) < 0.02


def test_the_channels_share_one_weight_and_scale_with_strength(world):
    world = world("plane")
    photo = world.photo(np.random.default_rng(0).uniform(0.2, 0.4, (180, 240, 3)), 0.01)
    once = reduce_view(world.setup, world.view, photo, 3, world.options)
    view = replace(world.view, strength=2.0 * world.view.strength)
    twice = reduce_view(world.setup, view, photo, 3, world.options)
    f1, f2 = (table.value / table.weight[:, None] for table in (once, twice))
    np.testing.assert_allclose(f2, f1 / 2.0, rtol=1e-12)
    np.testing.assert_allclose(twice.weight, 4.0 * once.weight, rtol=1e-6)  # var(f) is a quarter


def test_every_pixel_of_the_sample_is_used_or_counted(world):
    world = world("ball")
    photo = world.photo(np.full((180, 240, 3), 0.3), 0.01)
    photo.saturated[60:80] = True
    photo.valid[60:100] = False
    table = reduce_view(world.setup, world.view, photo, 3, world.options)
    scene = scene_of(world.setup, world.view, world.options)
    pairs = pairs_at(scene, world.setup.camera, region_pixels(region_of(world.setup, world.view.pose)))
    assert table.count.sum() + table.left_out.sum() == np.isfinite(pairs.point[:, 0]).sum()
    counts = dict(zip(LEFT_OUT, table.left_out[0], strict=True))
    assert counts["saturated"] > 0 and counts["invalid"] > 0


def test_nothing_usable_gives_an_empty_table(world):
    world = world("ball")
    photo = world.photo(np.full((180, 240, 3), 0.3), 0.01)
    photo.valid[:] = False
    table = reduce_view(world.setup, world.view, photo, 3, world.options)
    assert len(table) == 0 and table.left_out[0, LEFT_OUT.index("invalid")] > 1000


@pytest.mark.parametrize("name, median", [("traced-eggshell-ball", 0.02), ("traced-green-plane", 0.01)])
def test_traced_photos_with_their_true_geometry(name, median):
    """Cells below 70 degrees against the truth; the rest of the difference is light bounced off the board.

    The lamp's strength is read off the white patch with the true geometry.
    """
    if not (DATA / name).is_dir():
        pytest.skip(f"{name} is not here")
    photoset, truth = load_photoset(DATA / name), np.load(DATA / f"{name}.truth.npz")
    reader = prepare(photoset)
    camera = Camera(truth["K"], truth["dist"], reader.size)
    views = {view.name: view for view in photoset.views("sample")}
    options = ReduceOptions(mirror_balls=photoset.mirror_balls, white_patches=photoset.white_patches)
    tables = []
    for k in range(0, len(truth["files"]), 4):
        file = str(truth["files"][k])
        light = Light(file, "point", truth["light"][k], np.zeros((3, 3)), "given", 7.0)
        photo, pose = reader.read(views[file]), Pose(truth["R"][k], truth["t"][k])
        strength = patch_strength(photoset.white_patches[0], light, camera, pose, photo)
        if strength is None:
            continue
        view = ViewSetup(file, light, pose, strength, 0 * strength, "white patch")
        setup = Setup(camera, photoset.sample, (view,), "absolute", ("R", "G", "B"))
        tables.append(reduce_view(setup, view, photo, 3, options))
    table = add_tables(tables)
    f, expected, below = compared(table, truth)
    ratio = f[below] / expected[below]
    assert below.sum() > 20
    assert (np.abs(np.median(ratio, axis=0) - 1.0) < median).all()
    assert (np.sqrt(np.mean((ratio - 1.0) ** 2, axis=0)) < 0.05).all()


def patch_strength(patch, light, camera, pose, photo):
    """Median over the middle of the patch; None if it is not seen, or clipped."""
    low, high = patch.outline.min(0), patch.outline.max(0)
    x, y = np.meshgrid(
        *(np.linspace(a + 0.25 * (b - a), b - 0.25 * (b - a), 12) for a, b in zip(low, high, strict=True))
    )
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, patch.height)])
    u, v = np.rint(camera.project(pose, points)).astype(int).T
    height, width = photo.valid.shape
    if not ((u >= 0) & (v >= 0) & (u < width) & (v < height)).all() or not photo.valid[v, u].all():
        return None
    toward, falloff = light.toward(points)
    return np.median(
        photo.value[v, u] * np.pi / (patch.reflectance[0] * (toward[:, 2] * falloff)[:, None]), axis=0
    )


def compared(table, truth):
    """f, the truth at each cell's mean directions, and whether both angles are below 70 degrees."""
    from scipy.interpolate import RegularGridInterpolator

    incident, exit_ = (v / np.linalg.norm(v, axis=1)[:, None] for v in (table.incident, table.exit))
    cos_i, cos_r = incident[:, 2], exit_[:, 2]
    cos_dphi = (np.einsum("ij,ij->i", incident, exit_) - cos_i * cos_r) / np.sqrt(
        (1 - cos_i**2) * (1 - cos_r**2) + 1e-12
    )
    angles = np.column_stack([np.arccos(cos_i), np.arccos(cos_r), np.arccos(np.clip(cos_dphi, -1, 1))])
    axes = [np.unique(np.round(column, 9)) for column in truth["grid"].T]
    shape = [len(axis) for axis in axes]
    look_up = RegularGridInterpolator(
        axes, truth["brdf"].reshape(*shape, 3), bounds_error=False, fill_value=None
    )
    below = (angles[:, :2] < np.radians(70.0)).all(axis=1)
    return table.value / table.weight[:, None], look_up(angles), below
