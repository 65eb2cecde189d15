"""The compiled kernel against the plain numpy form, and against itself with other threads."""

from dataclasses import fields, replace

import numpy as np
import pytest

from photogonio.capture.radiance import RadianceImage
from photogonio.reconstruct.reduce.fused import compiled_before
from photogonio.reconstruct.reduce.reduce import reduce_view, reduce_view_plainly
from photogonio.reconstruct.table.facet_table import LEFT_OUT

AGREEMENT = 1e-9  # of a cell's value


def noisy_photo(world, seed=0, sigma=0.01):
    """A photo of nothing in particular, some pixels full, some invalid, NaN where nothing may look."""
    rng = np.random.default_rng(seed)
    width, height = world.setup.camera.size
    shape = (height, width, len(world.setup.channels))
    photo = world.photo(0.4 + sigma * rng.normal(size=shape), sigma)
    photo.saturated[rng.random(shape[:2]) < 0.02] = True
    photo.valid[photo.saturated | (rng.random(shape[:2]) < 0.02)] = False
    photo.value[~photo.valid] = np.nan
    return photo


def largest_difference(a, b):
    """Of any sum of any cell, relative to the cell's own.

    The exit's azimuth is uncertain by the rays' rounding over sin_i, so that difference counts times sin_i.
    """
    worst = 0.0
    sin_i = np.linalg.norm(a.incident[:, :2], axis=1) / np.linalg.norm(a.incident, axis=1)
    for name in ("weight", "value", "value2", "variance", "incident", "exit", "place"):
        x, y = getattr(a, name), getattr(b, name)
        scale = np.abs(x).max(-1, keepdims=True) if x.ndim == 2 else np.abs(x)
        difference = np.abs(x - y) / scale
        if name == "exit" and a.isotropic:
            difference = difference * sin_i[:, None]
        worst = max(worst, float(np.max(difference)))
    return worst


@pytest.mark.parametrize("level", [1, 3, 5])
@pytest.mark.parametrize("kind", ["ball", "plane"])
@pytest.mark.parametrize("light", ["point", "directional"])
def test_agrees_with_the_plain_form(world, kind, level, light):
    world = world(kind, light=light)
    photo = noisy_photo(world)
    for isotropic in (True, False):
        options = replace(world.options, isotropic=isotropic)
        fused = reduce_view(world.setup, world.view, photo, level, options)
        plain = reduce_view_plainly(world.setup, world.view, photo, level, options)
        np.testing.assert_array_equal(fused.facet_i, plain.facet_i)
        np.testing.assert_array_equal(fused.facet_r, plain.facet_r)
        np.testing.assert_array_equal(fused.count, plain.count)
        np.testing.assert_array_equal(fused.left_out, plain.left_out)
        assert fused.isotropic == plain.isotropic == (isotropic or kind == "ball")
        assert largest_difference(plain, fused) < AGREEMENT
        assert fused.count.sum() > 2000


def test_every_reason_occurs_in_these_worlds(world):
    """Else agreement on them would show nothing."""
    seen = np.zeros(len(LEFT_OUT), np.int64)
    for kind in ("ball", "plane"):
        made = world(kind)
        seen += reduce_view(made.setup, made.view, noisy_photo(made), 3, made.options).left_out[0]
    assert (seen[: LEFT_OUT.index("stray")] > 0).all()  # stray light is weighed when all photos are reduced


@pytest.mark.parametrize("channels", [1, 5])
def test_any_number_of_channels(world, channels):
    world = world("ball", channels=channels)
    photo = noisy_photo(world)
    fused = reduce_view(world.setup, world.view, photo, 3, world.options)
    plain = reduce_view_plainly(world.setup, world.view, photo, 3, world.options)
    assert fused.value.shape == (len(fused), channels)
    assert largest_difference(plain, fused) < AGREEMENT


def assert_same_bytes(a, b):
    for f in fields(a):
        x, y = getattr(a, f.name), getattr(b, f.name)
        assert x.tobytes() == y.tobytes() if isinstance(x, np.ndarray) else x == y, f.name


def test_the_same_bytes_for_any_number_of_threads(world):
    world = world("ball", scale=2.0)
    photo = noisy_photo(world)
    tables = [reduce_view(world.setup, world.view, photo, 4, world.options, threads=n) for n in (1, 2, 3, 1)]
    assert len(tables[0]) > 1024  # more than the kernel makes room for at first
    for table in tables[1:]:
        assert_same_bytes(tables[0], table)


def test_that_the_kernel_was_compiled_before_is_known_from_the_disk(world):
    world = world("ball")
    reduce_view(world.setup, world.view, noisy_photo(world), 2, world.options)
    assert compiled_before()


def test_a_photo_read_only_around_the_sample_gives_the_same_bytes(world):
    world = world("plane")
    photo = noisy_photo(world)
    whole = reduce_view(world.setup, world.view, photo, 3, world.options)
    x0, y0 = 30, 20
    part = RadianceImage(
        photo.value[y0:160, x0:230],
        photo.variance[y0:160, x0:230],
        photo.valid[y0:160, x0:230],
        photo.saturated[y0:160, x0:230],
        (x0, y0),
    )
    assert_same_bytes(whole, reduce_view(world.setup, world.view, part, 3, world.options))
    narrow = replace(part, value=part.value[:, :100], valid=part.valid[:, :100])
    with pytest.raises(ValueError, match="covers"):
        reduce_view(world.setup, world.view, narrow, 3, world.options)


def test_a_sample_outside_the_picture_gives_an_empty_table(world):
    world = world("ball")
    away = replace(world.view.pose, translation=world.view.pose.translation + np.array([1000.0, 0, 0]))
    table = reduce_view(world.setup, replace(world.view, pose=away), noisy_photo(world), 3, world.options)
    assert len(table) == 0 and table.groups == ("s0.png",) and table.left_out.sum() == 0
