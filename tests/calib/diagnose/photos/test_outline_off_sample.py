"""An outline that reaches over bare board is cut where the print begins; one that does not is left as it is."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from photogonio.calib.adjust.state import State
from photogonio.calib.detect.observation import FIXED_POSE, Observation
from photogonio.calib.detect.photo_reader import Reader
from photogonio.calib.diagnose.photos.outline_off_sample import OutlineOffSample, cut, least_deep
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


def told(level, outline, height: float = 0.0) -> tuple[np.ndarray, list[str]]:
    plane = Plane(np.asarray(outline, float), height)
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


@pytest.mark.parametrize("height", [0.0, 0.5, 3.0])
@pytest.mark.parametrize(("tone", "blur"), [(0.05, 0.3), (0.05, 1.0), (0.3, 0.7)])
def test_a_raised_sheet_in_its_place_is_left_wherever_the_print_has_edges(height, tone, blur):
    """Edges of the print just within its border, at every part of a pixel; a thin sheet hangs, and one looks below."""
    board = draw(CAMERA, POSE, NOISE, 0)
    flat = np.stack([part.mean(axis=0) for part in plane_points(CAMERA, POSE)])
    x, y = flat + (POSE.center[:2, None, None] - flat) * height / POSE.center[2]
    for off in np.linspace(0.0, 3.0, 13):
        low, high = LOW - off, HIGH + off
        sheet = (x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1])
        outline = np.array([low, (high[0], low[1]), high, (low[0], high[1])])
        shown = np.where(sheet, tone + 0.1 * tone * RNG.normal(size=board.shape), board)
        kept, said = told(cv2.GaussianBlur(shown, (0, 0), blur), outline, height)
        np.testing.assert_array_equal(kept, outline)
        assert said == []


def test_what_an_outline_in_its_place_seems_to_show_goes_with_pixels_height_and_slant():
    up, low = np.array([0.0, 0.0, 1.0]), np.array([0.0, np.sqrt(3.0), 1.0])  # 0 and 60 degrees
    assert least_deep([up], 2.0, 5.0) == pytest.approx(2.0 * least_deep([up], 1.0, 0.0))
    raised = least_deep([low], 1.0, 3.0) - least_deep([low], 1.0, 0.0)
    assert raised == pytest.approx(3.0 * np.sqrt(3.0))
    assert least_deep([low], 1.0, 0.0) > least_deep([up], 1.0, 0.0)


def row(depth: float, count: int = 20) -> np.ndarray:
    """Places at one depth within the lower side."""
    return np.column_stack([np.linspace(LOW[0] + 8.0, HIGH[0] - 8.0, count), np.full(count, LOW[1] + depth)])


@pytest.mark.parametrize("seen", [0.0, 0.5, 1.0])
def test_a_row_that_is_seen_within_reach_of_the_border_tells_nothing(seen):
    """However deep the first that is hidden lies."""
    places, visible = np.concatenate([row(1.0), row(6.0)]), np.zeros(40, bool)
    visible[: int(20 * seen)] = True
    assert cut(np.array(TRUE), places, visible, 2.0)[1] == 0.0


def test_a_row_of_which_part_is_seen_tells_as_a_whole():
    places, visible = np.concatenate([row(3.0), row(6.0)]), np.zeros(40, bool)
    visible[:10] = True
    assert cut(np.array(TRUE), places, visible, 2.0)[1] == 0.0
    visible[:20] = True
    kept, deepest = cut(np.array(TRUE), places, visible, 2.0)
    assert deepest == pytest.approx(6.0) and kept[:, 1].min() == pytest.approx(LOW[1] + 6.0)
