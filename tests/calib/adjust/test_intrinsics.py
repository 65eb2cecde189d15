"""The camera from photos of the board, and as few terms as they ask for."""

import cv2
import numpy as np
import pytest

from photogonio.calib.adjust.intrinsics import fit_camera, quick_camera
from photogonio.calib.detect.photo_reader import look, look_closer
from photogonio.capture.photoset import CharucoBoard
from tests.drawn.boards import CAMERA, SIZE, quiet, radiance, reader_of, views_of
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
