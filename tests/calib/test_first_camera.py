"""The camera by the board's corners alone: as given, or fitted with as many terms as an ordinary lens may have."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.adjust.intrinsics import MODELS, CameraFit, free_terms
from photogonio.calib.detect.first_look import FirstLook, Photos
from photogonio.calib.detect.photo_reader import Reader, Seen
from photogonio.calib.first_camera import find_camera, fitted_camera, model_of
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.remarks import Remarks
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import CameraEntry
from tests.drawn.boards import quiet
from tests.drawn.calibrations import Drawn
from tests.drawn.setups import SIZE

LENS = Camera(np.array([[900.0, 0, 400], [0, 900, 300], [0, 0, 1]]), np.array([-0.1, 0.02, 0, 0, 0.0]), SIZE)


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("centred", [False, True])
def test_terms_that_the_photos_did_not_ask_for_are_held_and_not_left_out(name, centred):
    square = name.startswith("square")
    terms = np.r_[LENS.distortion, np.zeros(3)] if name == "rational" else LENS.distortion
    lens = replace(LENS, distortion=terms)
    fit = CameraFit(lens, name, 0.1, np.zeros(9), {}, np.ones(8, bool), square, centred)
    model, chosen = model_of(fit), set(free_terms(MODELS[name]))
    assert {k for k, _ in model.held} == {0, 1, 2, 3} - chosen
    assert set(model.free) == chosen | {0, 1, 2, 3} and list(model.free) == sorted(model.free)
    assert (model.aspect > 0) == square and (model.centre > 0) == centred
    again = model.camera(model.block(lens))
    np.testing.assert_array_equal(again.matrix, LENS.matrix)
    np.testing.assert_array_equal(again.distortion, lens.distortion)


def look_of(drawn: Drawn, *, corners: bool = True) -> FirstLook:
    views = drawn.photoset.views("sample")
    seen = [Seen(v, c if corners else None, SIZE) for v, c in zip(views, drawn.samples, strict=True)]

    def unread(photoset, view):
        raise InputError(view.name, "no picture is drawn")

    return FirstLook(drawn.photoset, Reader(drawn.photoset, unread), Photos(seen, [], []), drawn.remarks)


def test_a_given_camera_is_taken_as_it_is():
    look = look_of(Drawn(3))
    entry = CameraEntry(matrix=LENS.matrix, distortion=LENS.distortion)
    camera, model, photos = find_camera(replace(look, photoset=replace(look.photoset, camera=entry)), quiet)
    np.testing.assert_array_equal(camera.matrix, LENS.matrix)
    np.testing.assert_array_equal(camera.distortion, LENS.distortion)
    assert camera.size == SIZE and model.free == () and len(photos.samples) == len(look.photos.samples)


def test_without_corners_there_is_no_camera_and_the_manifest_is_named():
    look = look_of(Drawn(3), corners=False)
    with pytest.raises(InputError, match=r"photoset\.toml: too few board corners in every photo"):
        find_camera(look, quiet)
    with pytest.raises(InputError, match="too few board corners"):
        fitted_camera(look.photos, SIZE, Remarks())
