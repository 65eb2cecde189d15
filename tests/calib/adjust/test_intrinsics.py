"""The camera from photos of the board, and as few terms as they ask for."""

import cv2
import numpy as np
import pytest

from photogonio.calib.adjust.intrinsics import MODELS, _beats, fit_camera, free_terms, quick_camera
from photogonio.calib.detect.photo_reader import look, look_closer
from photogonio.calib.geometry.board import Corners
from photogonio.calib.geometry.camera import Camera
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import CharucoBoard
from tests.calib.geometry.test_pose import corners
from tests.drawn.board_photos import POSES
from tests.drawn.boards import CAMERA, SIZE, looking_at, quiet, radiance, reader_of, views_of
from tests.places import DATA

CHARUCO = DATA / "charuco-photos"


def test_camera_comes_back_from_drawn_photos(closer):
    fit = fit_camera([s.corners for s in closer], SIZE)
    assert fit is not None
    assert fit.rms < 0.2
    focal = fit.camera.matrix[[0, 1], [0, 1]]
    true = CAMERA.matrix[[0, 1], [0, 1]]
    assert (np.abs(focal - true) < 4 * fit.standard_errors[:2]).all()
    assert (fit.standard_errors[:2] < 0.001 * true).all()


@pytest.mark.skipif(not CHARUCO.is_dir(), reason="the shared real photos are absent")
def test_real_photos_give_the_published_camera():
    board = CharucoBoard("DICT_6X6_250", squares=(5, 7), square_length=0.04, marker_length=0.02)
    images = {}
    for path in sorted(CHARUCO.glob("*.jpg")):
        coded = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) / 255.0
        linear = np.where(coded > 0.04045, ((coded + 0.055) / 1.055) ** 2.4, coded / 12.92)
        images[path.name] = radiance(linear, 0.01)
    reader = reader_of(board, images)
    seen = look(reader, views_of(reader), quiet, "")
    size = seen[0].size
    closer = look_closer(reader, quick_camera([s.corners for s in seen], size), seen, quiet)
    fit = fit_camera([s.corners for s in closer], size)
    published = cv2.FileStorage(str(CHARUCO / "reference.yml"), cv2.FILE_STORAGE_READ)
    focal = published.getNode("camera_matrix").mat()[[0, 1], [0, 1]]
    assert fit is not None
    assert fit.rms <= min(0.2, published.getNode("avg_reprojection_error").real())
    off = (fit.camera.matrix[[0, 1], [0, 1]] - focal) / fit.standard_errors[:2]
    assert np.abs(off).max() <= 3.0, (fit.camera.matrix, fit.standard_errors)
    assert (fit.standard_errors[:2] < 0.1 * focal).all()  # four photos alike tell it to about 4 %


@pytest.mark.parametrize("name", MODELS)
def test_terms_that_a_model_frees_are_those_that_opencv_changes(name):
    """From corners of a lens with all of them, drawn without noise."""
    views = [corners(pose) for pose in POSES]
    points = [v.points.astype(np.float32).reshape(-1, 1, 3) for v in views]
    pixels = [v.pixels.astype(np.float32).reshape(-1, 1, 2) for v in views]
    found = cv2.calibrateCamera(points, pixels, SIZE, np.eye(3), None, flags=MODELS[name])
    terms = np.ravel(found[2])
    assert set(np.flatnonzero(terms)) == set(free_terms(MODELS[name]))
    square = found[1][0, 0] == found[1][1, 1]
    assert square == name.startswith("square")


def test_larger_models_have_more_terms():
    counts = [len(free_terms(flags)) for name, flags in MODELS.items() if not name.startswith("square")]
    assert counts == [0, 1, 2, 4, 5, 8]


@pytest.mark.parametrize(("drop", "better"), [(9.0, False), (11.0, True)])
def test_a_term_must_bring_ten_times_what_a_useless_one_does(drop, better):
    """Of the squared residual over its expected size, the drop by one useless term is 1."""
    count = 1000
    smaller = 1.0
    larger = np.sqrt(1 / (1 + drop / count))
    assert _beats(larger, smaller, count, 1) == better
    assert not _beats(larger, smaller, count, 2)


def test_too_few_corners_make_no_camera():
    few = [corners(pose).keep(np.arange(35) < 5) for pose in POSES]
    assert fit_camera(few, SIZE) is None and quick_camera(few, SIZE) is None and fit_camera([], SIZE) is None


def test_a_camera_that_stands_still_is_found():
    """Twelve photos of one view, a ball and chance hiding other corners in each; focal lengths within 3 %, of which
    one tenth of a pixel over a board 300 pixels wide, seen at 52 degrees, leaves 1 %."""
    across, up = np.meshgrid(np.arange(20.0, 161.0, 20.0), np.arange(20.0, 121.0, 20.0))
    print_ = np.column_stack([across.ravel(), up.ravel(), np.zeros(across.size)])
    matrix = np.array([[1350.0, 0.0, 305.0], [0.0, 1350.0, 195.0], [0.0, 0.0, 1.0]])
    camera = Camera(matrix, np.array([-0.13, 0.07, 0.0007, -0.0004, 0.0]), (600, 400))
    pixels = camera.project(looking_at(np.array([90.0, -312.0, 514.0]), np.array([90.0, 70.0, 25.0])), print_)

    def view(k):
        rng = np.random.default_rng(k)
        seen = (np.hypot(print_[:, 0] - 90.0, print_[:, 1] - 90.0) > 45.0) & (rng.random(len(print_)) < 0.75)
        count = int(seen.sum())
        found = pixels[seen] + 0.1 * rng.normal(size=(count, 2))
        none = np.zeros(0, int), np.zeros((0, 4, 2))
        return Corners(np.flatnonzero(seen), print_[seen], found, np.full(count, 0.1), *none)

    views = [view(k) for k in range(12)]
    for count in (1, 3, 4, 6, 12):
        found = quick_camera(views[:count], camera.size)
        np.testing.assert_allclose(found.matrix[[0, 1], [0, 1]], 1350.0, rtol=0.03)


def test_one_photo_leaves_the_lens_out_and_the_axis_in_the_middle():
    fit = fit_camera([corners(POSES[1], 0.02)], SIZE)
    assert fit.square and fit.centred and fit.model.startswith("square pixels")
    np.testing.assert_allclose(fit.camera.matrix[:2, 2], (np.array(SIZE) - 1) / 2)
    assert fit.camera.matrix[0, 0] == pytest.approx(CAMERA.matrix[0, 0], rel=0.1)


def test_corners_that_no_camera_sees_there_are_one_line(monkeypatch):
    def refuse(*_args, **_given):
        raise cv2.error("Principal point must be within the image")

    monkeypatch.setattr(cv2, "calibrateCameraExtended", refuse)
    with pytest.raises(InputError, match=r"\[board\]: no camera sees its corners"):
        fit_camera([corners(pose) for pose in POSES], SIZE)
