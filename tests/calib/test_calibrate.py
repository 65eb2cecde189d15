"""Calibration of a set rendered by an independent path tracer, against where everything was."""

import numpy as np
import pytest

from photogonio.calib.calibrate import calibrate
from photogonio.calib.setup import Setup
from photogonio.capture.linear.prepare import prepare
from photogonio.capture.manifest.load import load_photoset
from tests.places import DATA

SET, TRUTH = DATA / "traced-eggshell-ball", DATA / "traced-eggshell-ball.truth.npz"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (SET.is_dir() and TRUTH.is_file()), reason="the shared traced set is absent"),
]


@pytest.fixture(scope="module")
def setup() -> Setup:
    photoset = load_photoset(SET)
    reader = prepare(photoset)
    return calibrate(photoset, lambda _, view: reader.read(view))


@pytest.fixture(scope="module")
def truth() -> dict[str, np.ndarray]:
    with np.load(TRUTH) as data:
        return {key: data[key] for key in ("K", "files", "R", "t", "light")}


def rows(setup: Setup, truth: dict[str, np.ndarray]) -> list[int]:
    files = list(truth["files"])
    return [files.index(view.name) for view in setup.views]


def degrees_apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    across = np.linalg.norm(np.cross(a, b), axis=-1)
    return np.degrees(np.arctan2(across, (a * b).sum(-1)))


def test_every_photo_is_used_and_the_scale_is_absolute(setup, truth):
    assert sorted(v.name for v in setup.views) == sorted(truth["files"])
    assert setup.left_out == ()
    assert setup.scale == "absolute"


def test_light_directions_at_the_sample(setup, truth):
    true = truth["light"][rows(setup, truth)] - setup.sample.center
    found = np.array([v.light.place for v in setup.views]) - setup.sample.center
    assert np.median(degrees_apart(found, true)) <= 0.2


def test_camera_directions_at_the_sample(setup, truth):
    centers = -np.einsum("nji,nj->ni", truth["R"], truth["t"])[rows(setup, truth)]
    found = np.array([v.pose.center for v in setup.views])
    apart = degrees_apart(found - setup.sample.center, centers - setup.sample.center)
    assert np.median(apart) <= 0.2


def test_no_falloff_is_found_where_the_lens_has_none(setup):
    darker, error = setup.falloff.corner
    assert not setup.falloff.allowed
    assert error < 0.01
    assert abs(darker) < 4 * error


def test_focal_lengths(setup, truth):
    found, true = (m[[0, 1], [0, 1]] for m in (setup.camera.matrix, truth["K"]))
    assert np.abs(found / true - 1).max() <= 0.001


@pytest.mark.long
def test_no_lamp_over_the_plane_is_lost():
    """One is seen in no mirror ball: the board's light alone places it, with the sheet's own bounce in it. Highlights
    of balls 17 pixels wide tell a lamp to a degree; the edges of their shadows on the print tell it to a tenth."""
    photoset = load_photoset(DATA / "traced-green-plane")
    reader = prepare(photoset)
    found = calibrate(photoset, lambda _, view: reader.read(view))
    with np.load(DATA / "traced-green-plane.truth.npz") as data:
        files, light = list(data["files"]), data["light"]
    middle = np.append(found.sample.outline.mean(0), found.sample.height)
    true = light[[files.index(v.name) for v in found.views]] - middle
    off = degrees_apart(np.array([v.light.place for v in found.views]) - middle, true)
    assert len(found.views) == len(files)
    assert np.median(off) <= 0.15
    assert np.quantile(off, 0.95) <= 0.4
    assert off.max() < 0.6
