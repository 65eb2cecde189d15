"""An outline that reaches over bare board is cut where the print begins; one that does not is left as it is."""

from pathlib import Path

import numpy as np
import pytest

from photogonio.calib.adjust.state import State
from photogonio.calib.detect.observation import FIXED_POSE, Observation
from photogonio.calib.detect.photo_reader import Reader
from photogonio.calib.diagnose.photos.outline_off_sample import OutlineOffSample
from photogonio.calib.diagnose.procedure import ask
from photogonio.calib.remarks import Remarks
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import Photo, PhotoSet, Plane
from tests.drawn.board_photos import MIDDLE, NOISE
from tests.drawn.boards import BOARD, CAMERA, draw, looking_at, plane_points, quiet, radiance

LOW, HIGH = np.array([30.0, 20.0]), np.array([66.0, 52.0])
POSE = looking_at(MIDDLE + np.array([10.0, -50.0, 190.0]), MIDDLE)
TRUE = (LOW, (HIGH[0], LOW[1]), HIGH, (LOW[0], HIGH[1]))
RNG = np.random.default_rng(2)


@pytest.fixture(scope="module")
def level():
    """A sheet with a coarse grain on the board."""
    found = draw(CAMERA, POSE, NOISE, 0)
    x, y = (part.mean(axis=0) for part in plane_points(CAMERA, POSE))
    sheet = (x > LOW[0]) & (x < HIGH[0]) & (y > LOW[1]) & (y < HIGH[1])
    grain = 0.3 + 0.05 * RNG.normal(size=found.shape)
    return np.where(sheet, grain, found)


def told(level, outline) -> tuple[np.ndarray, list[str]]:
    plane = Plane(np.asarray(outline, float), 0.0)
    photos = (Photo("s.png", "sample"),)
    photoset = PhotoSet(Path("."), "drawn", "mm", plane, "auto", photos, BOARD)
    reader, remarks = Reader(photoset, lambda _, view: radiance(level, NOISE)), Remarks()
    observations = [Observation(view, view.name, None, POSE, FIXED_POSE) for view in photoset.views("sample")]
    state = State(photoset, reader, CAMERA, None, (), tuple(observations), remarks, quiet)
    found = ask(state, [OutlineOffSample()]).photoset
    return found.sample.outline, list(remarks.warnings)


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("off", [(0.0, 0.0), (0.4, -0.4)])
def test_an_outline_in_its_place_is_left(level, off, turn):
    outline, said = told(level, (np.array(TRUE) + off)[::turn])
    np.testing.assert_array_equal(outline, (np.array(TRUE) + off)[::turn])
    assert said == []


@pytest.mark.parametrize(
    ("low", "high"),
    [
        ((0.0, 0.0), (8.0, 0.0)),
        ((8.0, 0.0), (8.0, 0.0)),
        ((-6.0, -6.0), (6.0, 6.0)),
        ((-6.0, 5.0), (-6.0, 5.0)),
        ((0.0, -14.0), (0.0, -14.0)),
    ],
)
def test_the_print_is_cut_off(level, low, high):
    """To the part of it that lies on the sheet, by no more than a pixel or two, which its edges then tell."""
    first, last = LOW + low, HIGH + high
    outline, said = told(level, (first, (last[0], first[1]), last, (first[0], last[1])))
    assert len(said) == 1 and "sample.outline" in said[0]
    pixel = 0.3
    np.testing.assert_allclose(outline.min(axis=0), np.maximum(first, LOW), atol=4 * pixel)
    np.testing.assert_allclose(outline.max(axis=0), np.minimum(last, HIGH), atol=4 * pixel)


def test_an_outline_beside_the_sample_is_refused(level):
    with pytest.raises(InputError, match="lies elsewhere"):
        told(level, np.array(TRUE) - [28.0, 18.0])
