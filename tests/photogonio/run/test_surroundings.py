"""Stray light of the surroundings: where a set tells of it, and what becomes of pixels where it does not."""

from dataclasses import asdict

import numpy as np

from photogonio import pipeline
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.setup import Light, Setup, ViewSetup
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.photoset import Plane, Sphere
from photogonio.options import Options
from photogonio.pipeline import process
from photogonio.reconstruct.table.facet_table import LEFT_OUT
from photogonio.reconstruct.table.table_file import load_table
from photogonio.report.summary import numbers
from photogonio.run.surroundings import (
    Shown,
    around_of,
    is_stray_light_known,
    photo_around,
    photo_backdrop,
)
from tests.drawn.tiny_set import ALBEDO, DISTANCE, LIGHTS, RADIUS, TinySet, ball_photo, toward

QUICK = Options(lobes=0, order=2)
WHITE = 0.8  # reflectance of the ground


def on_white_ground(tiny: TinySet) -> None:
    """The ball stands on the frame's z = 0, a white ground without end that the same lamps light."""
    tiny.replace("center = [0, 0, 0]", f"center = [0, 0, {RADIUS}]")
    tiny.replace(f"translation = [0, 0, {DISTANCE}]", f"translation = [0, 0, {DISTANCE + RADIUS}]")
    up = ball_photo(np.array([0.0, 0.0, 1.0])) * np.pi / ALBEDO  # of the ball's normals
    for name, light in zip(tiny.photos, LIGHTS, strict=True):
        ground = WHITE / np.pi * toward(*light)[2]
        thrown = np.where(up > 0.0, ALBEDO * ground * (1.0 - up) / 2.0, ground)  # form factor of a wedge
        tiny.write(name, 3.0 * (ball_photo(toward(*light)) + thrown))


def unevenness(brdf) -> float:
    """Relative rms of f about its mean, both angles below 70 degrees: of a matte ball none."""
    theta_i, theta_r, dphi = (
        a.ravel() for a in np.meshgrid(*[np.radians(np.arange(0, 71, 10))] * 2, [0.0, 1.5, 3.0])
    )
    f = brdf.evaluate(theta_i, np.zeros(len(theta_i)), theta_r, dphi).mean(1)
    return float(np.std(f) / np.mean(f))


def setup_of(sample: Sphere | Plane, *, scale: str = "relative", source: str = "intensity") -> Setup:
    light = Light("L", "directional", np.array([0.0, 0.0, 1.0]), np.zeros((3, 3)), "given")
    pose = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 300.0]))
    sources = (source, "intensity")
    views = tuple(ViewSetup(f"s{k}", light, pose, np.ones(3), np.zeros(3), s) for k, s in enumerate(sources))
    return Setup(
        Camera(np.diag([400.0, 400.0, 1.0]), np.zeros(5), (160, 120)), sample, views, scale, ("R", "G", "B")
    )


STANDING, FLOATING = Sphere(np.array([3.0, 4.0, 25.5]), 25.0), Sphere(np.zeros(3), 25.0)


def test_a_frame_without_a_board_has_a_ground_where_the_ball_stands_on_it(tiny_set: TinySet):
    photoset = load_photoset(tiny_set.folder)
    assert photoset.board is None
    assert is_stray_light_known(photoset, setup_of(STANDING, scale="absolute"))
    assert not is_stray_light_known(photoset, setup_of(FLOATING, scale="absolute"))


def test_one_lamp_measured_by_paper_ties_radiance_to_all(tiny_set: TinySet):
    photoset = load_photoset(tiny_set.folder)
    assert is_stray_light_known(photoset, setup_of(STANDING, source="board"))
    assert not is_stray_light_known(photoset, setup_of(STANDING))


def test_beside_a_flat_sample_nothing_is_read(tiny_set: TinySet):
    photoset = load_photoset(tiny_set.folder)
    flat = Plane(np.array([[0.0, 0], [50, 0], [50, 50]]), 0.0)
    assert around_of(photoset, setup_of(flat)) is None
    assert around_of(photoset, setup_of(STANDING, scale="absolute")) is photo_around
    assert around_of(photoset, setup_of(STANDING)) is photo_backdrop


def test_before_a_black_cloth_nothing_is_left_out_nor_told(tiny_set: TinySet):
    found = process(tiny_set.folder, options=QUICK)
    # of 0.001 of black that nobody takes away, over a lamp that gives 3 ALBEDO / pi on a white
    assert found.beside.spoilt.pixels == 0
    assert found.beside.spoilt.typical < 0.01
    assert "surroundings-unknown" not in [one.code for one in found.diagnoses]
    assert found.table.left_out[:, LEFT_OUT.index("stray")].sum() == 0


def test_pixels_that_a_white_ground_spoils_are_left_out_counted_and_told(tiny_set: TinySet, tmp_path):
    on_white_ground(tiny_set)
    found = process(tiny_set.folder, tmp_path / "out", QUICK)
    spoilt = found.beside.spoilt
    assert found.beside.known is None
    assert 0.1 * spoilt.of < spoilt.pixels <= 0.25 * spoilt.of
    lost = load_table(tmp_path / "out/table.npz").left_out[:, LEFT_OUT.index("stray")]
    assert lost.sum() == spoilt.pixels == spoilt.of - found.table.count.sum()
    told = [one.message for one in found.diagnoses if one.code == "surroundings-unknown"]
    assert len(told) == 1 and f"{spoilt.pixels} pixels" in told[0] and "proportions" in told[0]
    assert f"{spoilt.pixels} pixels of {spoilt.of} left out" in (tmp_path / "out/report.html").read_text()
    assert numbers(found)["stray_light_unknown"] == asdict(spoilt)


def test_the_fit_is_better_for_it(tiny_set: TinySet, monkeypatch):
    """The same photos, every pixel believed: light from below counts as the sample's own."""
    on_white_ground(tiny_set)
    told = process(tiny_set.folder, options=Options(lobes=0)).brdf
    monkeypatch.setattr(
        pipeline, "shown_around", lambda photoset, setup, table, around: (Shown((None,) * len(around)), table)
    )
    untold = process(tiny_set.folder, options=Options(lobes=0)).brdf
    # under the lamp in the zenith the ground adds 0.8 (1 - 0.5) / 2 / 0.5, 40 %, at 60 degrees, and nothing at the top
    assert unevenness(untold) > 0.05
    assert unevenness(told) < 0.5 * unevenness(untold)
