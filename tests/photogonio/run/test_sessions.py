"""Sessions of one sample are one fit: whatever frame, unit and scale each has, and in whatever order they come."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.setup import Light, Setup, ViewSetup
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import Sphere
from photogonio.capture.radiance import RadianceImage
from photogonio.options import Choice
from photogonio.reconstruct.estimate.session_scales import SETTLED
from photogonio.reconstruct.reduce.directions import ReduceOptions
from photogonio.reconstruct.reduce.reduce import reduce_view
from photogonio.run.circumstances import Circumstances, lamp_variances, packed, unpacked, view_errors
from photogonio.run.session_scales import Session
from photogonio.run.sessions import joined
from photogonio.run.surroundings import Shown

DOWN = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 300.0]))
CAMERA = Camera(np.array([[300.0, 0, 39.5], [0, 300.0, 29.5], [0, 0, 1]]), np.zeros(5), (80, 60))
ALBEDO = 0.5


def session(name: str, *, unit=1.0, shift=(0.0, 0.0, 0.0), bright=1.0, scale="absolute", seed=0) -> Session:
    """A matte ball under two lamps, in a frame and units of the session's own."""
    shift, views, tables = np.array(shift), [], []
    ball = Sphere(shift, 25.0 * unit)
    pose = Pose(DOWN.rotation, DOWN.translation * unit - DOWN.rotation @ shift)
    for k, place in enumerate(([0.0, 0, 400], [200.0, 50, 300])):
        light = Light(
            f"L{k}", "point", np.array(place) * unit + shift, np.eye(3) * unit**2, "given", 5.0 * unit
        )
        strength = np.full(1, 1e5 * unit**2 * bright)
        views.append(ViewSetup(f"s{k}", light, pose, strength, 0.01 * strength, "white patch"))
    setup = Setup(CAMERA, ball, tuple(views), scale, ("Y",), scale_error=0.01)
    rng = np.random.default_rng(seed)
    for view in views:
        tables.append(
            reduce_view(setup, view, photo(setup, view, bright, rng), 2, ReduceOptions(isotropic=True))
        )
    table = tables[0] + tables[1]
    known = Circumstances(
        name, setup, Shown((None, None)), "isotropic", Choice("facet level", "2", "asked for")
    )
    return Session(f"{name}/table.npz", f"{name}{seed}", table, known)


def photo(setup: Setup, view: ViewSetup, bright: float, rng) -> RadianceImage:
    x, y = np.meshgrid(np.arange(80.0), np.arange(60.0))
    ray = np.stack([(x - 39.5) / 300, (y - 29.5) / 300, np.ones_like(x)], -1) @ view.pose.rotation
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    eye = view.pose.center - setup.sample.center
    along = -ray @ eye
    root = along**2 - (eye @ eye - setup.sample.radius**2)
    at = eye + (along - np.sqrt(np.maximum(root, 0)))[..., None] * ray
    normal = at / setup.sample.radius
    toward, falloff = view.light.toward((at + setup.sample.center).reshape(-1, 3))
    cosine = np.maximum((normal.reshape(-1, 3) * toward).sum(1), 0) * falloff
    value = np.where(root > 0, cosine.reshape(root.shape) * ALBEDO / np.pi * view.strength[0], 0)[..., None]
    value = value * rng.normal(1.0, 1e-3, value.shape)
    good = np.ones(value.shape[:2], bool)
    return RadianceImage(value, (1e-3 * value + 1e-6 * bright) ** 2, good, ~good)


@pytest.fixture(scope="module")
def here() -> Session:
    return session("a")


def test_frame_unit_and_radiance_make_no_difference(here):
    """The same photos in another frame, in metres and with another exposure are the same cells."""
    same = session("b", unit=1e-3, shift=(0.1, -0.2, 0.05), bright=7.0)
    table, known = joined([here, same])
    assert table.groups == ("a: s0", "a: s1", "b: s0", "b: s1")
    mine, other = table.take(table.group < 2), table.take(table.group >= 2)
    np.testing.assert_array_equal(mine.facet_r, other.facet_r)
    for name in ("value", "incident", "exit", "place"):
        one, two = (getattr(t, name) / t.weight[:, None] for t in (mine, other))
        np.testing.assert_allclose(two, one, rtol=1e-6, atol=1e-6)  # photos are of single precision
    views = known.setup.views
    for one, two in zip(views[:2], views[2:], strict=True):
        np.testing.assert_allclose(two.light.place, one.light.place)
        np.testing.assert_allclose(two.pose.center, one.pose.center)
        np.testing.assert_allclose(two.strength, 7.0 * one.strength, rtol=SETTLED)  # found, not given
    np.testing.assert_allclose(
        lamp_variances(known.setup, table), np.tile(lamp_variances(here.known.setup, here.table), 2)
    )
    np.testing.assert_allclose(view_errors(known.setup, table), 0.01)


def test_the_order_of_sessions_changes_nothing(here):
    others = [session("b", seed=1), session("a", seed=2)]
    forth, back = joined([here, *others]), joined([*others[::-1], here])
    assert forth[0].groups == back[0].groups and len(set(forth[0].groups)) == 6
    for one, two in zip(*([t.value.tobytes(), str(packed(k))] for t, k in (forth, back)), strict=True):
        assert one == two


def test_a_relative_session_is_brought_to_the_absolute_one(here):
    """The lamps of the other are taken for thrice as strong as they are; noise of cells is far below a hundredth."""
    other = session("0", scale="relative", seed=3)
    table = other.table
    other = replace(other, table=replace(table, value=table.value / 3, value2=table.value2 / 9))
    table, known = joined([other, here])
    assert known.setup.scale == "absolute" and table.groups[0] == "a: s0"
    part = table.take(table.group >= 2)
    assert np.median(part.value[:, 0] / part.weight) == pytest.approx(ALBEDO / np.pi, rel=0.01)
    strengths = [view.strength[0] for view in known.setup.views]
    assert strengths[2] == pytest.approx(strengths[0] / 3, rel=0.01)


def test_what_is_joined_can_be_kept(here):
    table, known = joined([here, session("b", seed=1)])
    again = unpacked(packed(known), table, "table.npz")
    assert again is not None and again.name == "a + b" and len(again.setup.views) == 4


def test_rooms_that_are_not_dark_keep_their_shares(here):
    """One sky stands for all sessions, so that a session's photos are in the unit in which its own room has it."""
    lit = session("b", bright=5.0)
    lit = replace(lit, known=replace(lit.known, setup=replace(lit.known.setup, ambient=np.array([50.0]))))
    _, known = joined([here, lit])
    shares = [known.setup.ambient[0] / view.strength[0] for view in known.setup.views]
    assert shares[2] == pytest.approx(50.0 / 5e5, rel=SETTLED)
    assert shares[0] < 1e-5 * shares[2]  # a dark room


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (lambda s: replace(s, table=replace(s.table, level=3)), "level"),
        (lambda s: replace(s, table=replace(s.table, channels=("G",))), "channels"),
        (lambda s: replace(s, known=replace(s.known, symmetry="auto")), "symmetry"),
        (lambda s: replace(s, known=replace(s.known, space="XYZ")), "colours"),
        (lambda s: replace(s, digest="a0"), "twice"),
    ],
)
def test_what_is_not_alike_is_refused_by_name(here, change, what):
    with pytest.raises(InputError, match=rf"table\.npz.*{what}"):
        joined([here, change(session("b", seed=1))])
