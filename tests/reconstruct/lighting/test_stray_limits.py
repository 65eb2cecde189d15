"""Stray light that nobody knows: its share of the value by form factors, and the cells that are left out for it."""

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.setup import Light, Setup, ViewSetup
from photogonio.capture.photoset import Sphere
from photogonio.reconstruct.lighting.stray_limits import (
    MOST,
    PAPER,
    TOLERANCE,
    UnknownStray,
    unknown_stray,
    without_spoilt,
)
from photogonio.reconstruct.table.cells import cells_of
from photogonio.reconstruct.table.facet_table import LEFT_OUT, FacetTable

RADIUS, ALBEDO = 10.0, 0.5
SAMPLE = Sphere(np.array([1.0, 2.0, RADIUS]), RADIUS)
ZENITH = Light("Z", "directional", np.array([0.0, 0.0, 1.0]), np.zeros((3, 3)), "given")
SLANTING = Light("S", "directional", np.array([0.8, 0.0, 0.6]), np.zeros((3, 3)), "given")
NEAR = Light("N", "point", np.array([61.0, 2.0, 90.0]), np.zeros((3, 3)), "given")
LIGHTS = (ZENITH, SLANTING, NEAR)
POSE = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 300.0]))


def normals(count: int = 400, least: float = 0.1) -> np.ndarray:
    """(n, 3) unit, evenly over the upper half of the ball."""
    z = least + (1.0 - least) * (np.arange(count) + 0.5) / count
    turn = np.arange(count) * np.pi * (3.0 - np.sqrt(5.0))
    across = np.sqrt(1.0 - z**2)
    return np.column_stack([across * np.cos(turn), across * np.sin(turn), z])


def setup_of(scale: str = "absolute", strength: float = 1.0) -> Setup:
    views = tuple(
        ViewSetup(f"s{k}", light, POSE, np.full(1, strength), np.zeros(1), "intensity")
        for k, light in enumerate(LIGHTS)
    )
    return Setup(Camera(np.eye(3), np.zeros(5), (160, 120)), SAMPLE, views, scale, ("gray",))


def table_of(setup: Setup, albedo: float = ALBEDO) -> FacetTable:
    """A matte ball's cells, each of ten pixels, in three views."""
    every = normals()
    lit = [every[every @ light.toward(SAMPLE.center[None])[0][0] > 0.2] for light in LIGHTS]
    normal = np.concatenate(lit)
    group = np.repeat(np.arange(len(LIGHTS), dtype=np.int32), [len(one) for one in lit])
    n, place = len(normal), SAMPLE.center + RADIUS * normal
    count, row = np.full(n, 10.0), np.arange(n, dtype=np.int32)
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    value = np.full((n, 1), albedo / np.pi)
    return FacetTable(
        level=3, channels=("gray",), groups=tuple(view.name for view in setup.views), isotropic=True, group=group,
        facet_i=row, facet_r=row, count=count, weight=count.copy(), value=count[:, None] * value,
        value2=count[:, None] * value**2, variance=np.zeros((n, 1)), incident=count[:, None] * up,
        exit=count[:, None] * up, place=count[:, None] * place, left_out=np.zeros((len(LIGHTS), len(LEFT_OUT)), int),
    )  # fmt: skip


def alike(table: FacetTable, brightness: float) -> UnknownStray:
    """A ground as bright in every view."""
    lights = dict(zip(table.groups, LIGHTS, strict=True))
    return UnknownStray(SAMPLE, lights, dict.fromkeys(table.groups, brightness), True)


def thrown(normal: np.ndarray, radiance: float) -> np.ndarray:
    """Irradiance (n,) of a ground of even ``radiance``: midpoint sum over 500 x 720 directions below the horizon."""
    z = -(np.arange(500) + 0.5) / 500
    turn = (np.arange(720) + 0.5) * np.pi / 360
    z, turn = (a.ravel() for a in np.meshgrid(z, turn))
    across = np.sqrt(1.0 - z**2)
    directions = np.column_stack([across * np.cos(turn), across * np.sin(turn), z])
    return np.array([np.maximum(directions @ n, 0.0).mean() * 2.0 * np.pi * radiance for n in normal])


def test_the_share_is_the_grounds_light_over_the_lamps():
    radiance, strength = 0.05, 1.0
    normal = normals(12, 0.2)
    for light in LIGHTS:
        falloff = light.toward(SAMPLE.center[None])[1][0]
        brightness = np.pi * radiance / (strength * falloff)
        unknown = UnknownStray(SAMPLE, {"s": light}, {"s": brightness}, grounded=True)
        place = SAMPLE.center + RADIUS * normal
        toward, fall = light.toward(place)
        direct = strength * np.einsum("ij,ij->i", toward, normal) * fall
        lit = direct > 0.05 * strength * falloff
        share = unknown.shares(place[lit], np.zeros(lit.sum(), int), ("s",))
        # the midpoint sum is off by the square of its step where the horizon cuts it: 1e-5 of pi
        np.testing.assert_allclose(share, thrown(normal[lit], radiance) / direct[lit], atol=1e-4 / 0.05)


def test_where_nobody_knows_the_grounds_side_half_of_what_a_point_faces_is_taken():
    """The mean of (1 - n.u) / 2 over all directions u."""
    unknown = UnknownStray(SAMPLE, {"s": ZENITH}, {"s": 1.0}, grounded=False)
    place = SAMPLE.center + RADIUS * normals(20)
    share = unknown.shares(place, np.zeros(20, int), ("s",))
    np.testing.assert_allclose(share, 0.5 / normals(20)[:, 2], rtol=1e-12)


def seen(*radiance: float) -> np.ndarray:
    return np.array(radiance)[:, None]


def test_brightness_is_radiance_over_irradiance_at_most_whites_and_papers_where_unseen():
    setup = setup_of(strength=2.0)
    falloff = NEAR.toward(SAMPLE.center[None])[1][0]
    found = unknown_stray(
        table_of(setup), setup, seen(0.1, 5.0, np.nan), grounded=True, measured=True
    ).brightness
    assert found == pytest.approx({"s0": np.pi * 0.1 / 2.0, "s1": 1.0, "s2": PAPER})
    near = unknown_stray(table_of(setup), setup, seen(0, 0, 0.1 * falloff), grounded=True, measured=True)
    assert near.brightness["s2"] == pytest.approx(np.pi * 0.1 / 2.0)


@pytest.mark.parametrize("factor", [0.01, 1.0, 30.0])
def test_proportions_bound_the_brightness_by_a_sample_that_is_no_whiter_than_white(factor):
    """Whatever the unit of the strengths: the true brightness is ALBEDO times what is taken."""
    setup = setup_of("relative", strength=factor)
    table = table_of(setup, albedo=ALBEDO / factor)  # as lamps of strength 1 would have it
    found = unknown_stray(table, setup, seen(0.02, 0.02, 0.0), grounded=True, measured=False).brightness
    assert found["s0"] == pytest.approx(np.pi * 0.02 / ALBEDO)


def test_what_stands_out_is_left_out_and_counted():
    setup = setup_of()
    table = table_of(setup)
    unknown = alike(table, 0.1)
    kept, spoilt = without_spoilt(table, unknown)
    share = unknown.shares(table.place / table.weight[:, None], table.group, table.groups)
    assert spoilt.beyond == pytest.approx(spoilt.typical + TOLERANCE)
    assert spoilt.pixels == 10 * (share > spoilt.beyond).sum() > 0
    assert spoilt.of == table.count.sum()
    assert kept.left_out[:, LEFT_OUT.index("stray")].tolist() == [
        10 * (share[table.group == g] > spoilt.beyond).sum() for g in range(3)
    ]
    assert kept.count.sum() == spoilt.of - spoilt.pixels
    assert unknown.shares(kept.place / kept.weight[:, None], kept.group, kept.groups).max() <= spoilt.beyond


def test_never_more_than_the_worst_quarter_is_left_out():
    setup = setup_of()
    table = table_of(setup)
    unknown = alike(table, 1.0)
    _, spoilt = without_spoilt(table, unknown)
    assert spoilt.beyond > spoilt.typical + TOLERANCE
    assert spoilt.pixels == pytest.approx(MOST * spoilt.of, abs=10)


def test_dark_surroundings_cost_nothing():
    setup = setup_of()
    table = table_of(setup)
    unknown = unknown_stray(table, setup, seen(0.0, 0.0, 0.0), grounded=True, measured=True)
    kept, spoilt = without_spoilt(table, unknown)
    assert spoilt.pixels == 0 and len(kept) == len(table)
    assert (unknown(cells_of(table)) == 0.0).all()


def test_cells_are_believed_the_less_the_more_stray_light_they_may_hold():
    """The standard deviation of what is anything between nothing and the bound."""
    setup = setup_of()
    table = table_of(setup)
    cells = cells_of(table)
    unknown = alike(table, 0.1)
    share = unknown.shares(cells.place, cells.group, cells.groups)
    doubt = unknown(cells)
    np.testing.assert_allclose(doubt[:, 0], share / np.sqrt(12.0) * ALBEDO / np.pi, rtol=1e-12)
