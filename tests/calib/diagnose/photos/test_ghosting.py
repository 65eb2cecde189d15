"""A bracket whose exposures disagree over the sample is told of, with how much of it."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.calib.detect.observation import POSE, Observation
from photogonio.calib.detect.photo_reader import Reader
from photogonio.calib.diagnose.photos.ghosting import MovedInBracket
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.capture.photoset import Photo, PhotoSet, Plane, Sphere, View
from photogonio.capture.radiance import RadianceImage

SIZE = (300, 200)
CAMERA = Camera(np.array([[500.0, 0, 149.5], [0, 500.0, 99.5], [0, 0, 1]]), np.zeros(5), SIZE)
ABOVE = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 500.0]))  # 0.5 m above the origin, looking down
BALL = Sphere(np.array([0.0, 0.0, 20.0]), 20.0)
FLAT = Plane(np.array([[-20.0, -20], [20, -20], [20, 20], [-20, 20]]), 0.0)


def warnings(sample: Sphere | Plane, ghost: np.ndarray, exposures: int = 3) -> list[str]:
    photos = tuple(Photo(f"s{k}", "sample") for k in range(exposures))
    view = View(photos)

    def read(_, view: View) -> RadianceImage:
        value = np.ones((*SIZE[::-1], 1), np.float32)
        return RadianceImage(value, value, ~ghost, np.zeros_like(ghost), ghost=ghost)

    reader = Reader(PhotoSet(Path("."), "drawn", "mm", sample, "auto", photos), read)
    observation = Observation(view, "L", None, ABOVE, f"{POSE}s0", 0.0)
    state = SimpleNamespace(
        reader=reader,
        settled=SimpleNamespace(camera=CAMERA),
        photoset=reader.photoset,
        observations=(observation,),
    )
    return [one.message for one in MovedInBracket().evidence(state)]


@pytest.mark.parametrize("sample", [BALL, FLAT])
def test_what_moved_over_the_sample_is_told(sample):
    ghost = np.zeros(SIZE[::-1], bool)
    ghost[:, : SIZE[0] // 2] = True  # half of the sample, which lies in the middle
    (told,) = warnings(sample, ghost)
    assert told.startswith("s0:") and "moved" in told
    share = float(told.split("bracket: ")[1].split("%")[0])
    assert share == pytest.approx(50, abs=2)  # a pixel of 40


def test_what_moved_beside_the_sample_is_not():
    ghost = np.zeros(SIZE[::-1], bool)
    ghost[:, :40] = True
    assert warnings(BALL, ghost) == []


def test_single_exposures_have_no_ghosts():
    ghost = np.ones(SIZE[::-1], bool)
    assert warnings(BALL, ghost, exposures=1) == []
