"""Photos that are stored mirrored are left out, those upside down are read turned back."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.adjust.intrinsics import quick_camera
from photogonio.calib.detect.first_look import FirstLook, Photos
from photogonio.calib.detect.photo_reader import Reader, Seen
from photogonio.calib.diagnose.photos import stored_otherwise
from photogonio.calib.diagnose.photos.stored_otherwise import MirroredPhotos, TurnedLens
from photogonio.calib.diagnose.procedure import ask
from photogonio.calib.diagnose.registry import Stage, looked_at
from photogonio.calib.remarks import Remarks
from photogonio.capture.errors import InputError
from tests.drawn.calibrations import Drawn
from tests.drawn.setups import SIZE


def about(corners):
    return replace(corners, pixels=np.array(SIZE) - 1 - corners.pixels)


def drawn_photos(turned: tuple[int, ...], *, views: int = 8, fixed: bool = True, seed: int = 3):
    drawn = Drawn(seed, fixed=fixed, views=views)
    return drawn, [about(one) if k in turned else one for k, one in enumerate(drawn.samples)]


def unread(photoset, view):
    raise InputError(view.name, "no picture is drawn")


@pytest.mark.parametrize("fixed", [True, False])
def test_a_still_cameras_are_turned_back_before_the_camera_is_fitted(fixed):
    drawn, corners = drawn_photos((3,), fixed=fixed)
    views = drawn.photoset.views("sample")
    seen = [Seen(view, one, SIZE) for view, one in zip(views, corners, strict=True)]
    remarks = Remarks()
    first = FirstLook(drawn.photoset, Reader(drawn.photoset, unread), Photos(seen, [], []), remarks)
    photos = ask(first, looked_at(Stage.LOOK)).photos
    assert photos.as_read(drawn.photoset).turned == (("s3",) if fixed else ())
    assert remarks.codes() == (["photo-turned"] if fixed else [])
    kept = photos.samples[3].corners.pixels
    np.testing.assert_allclose(kept, drawn.samples[3].pixels if fixed else corners[3].pixels)


def test_mirrored_photos_are_left_out_by_name_whatever_their_role(monkeypatch):
    drawn, corners = drawn_photos(())
    views = drawn.photoset.views("sample")
    seen = [Seen(view, one, SIZE) for view, one in zip(views, corners, strict=True)]
    first = FirstLook(
        drawn.photoset, Reader(drawn.photoset, unread), Photos(seen[:4], seen[4:6], seen[6:]), Remarks()
    )
    monkeypatch.setattr(stored_otherwise, "mirrored_photos", lambda reader, every: ["s1", "s7"])
    left = ask(first, [MirroredPhotos()])
    assert [one.view.name for one in left.photos.every] == ["s6", "s0", "s2", "s3", "s4", "s5"]
    assert left.remarks.codes() == ["photo-mirrored"] * 2
    monkeypatch.setattr(stored_otherwise, "mirrored_photos", lambda reader, every: [])
    assert ask(first, [MirroredPhotos()]).photos is first.photos


def test_a_moving_cameras_are_turned_back_once_a_lens_is_known():
    drawn, corners = drawn_photos((3,), fixed=False)
    views, boards = drawn.photoset.views("sample"), drawn.photoset.views("calibration")
    every = [*drawn.boards, *corners]
    photos = Photos(
        [Seen(v, c, SIZE) for v, c in zip(views, corners, strict=True)],
        [],
        [Seen(v, c, SIZE) for v, c in zip(boards, drawn.boards, strict=True)],
    )
    first = FirstLook(drawn.photoset, Reader(drawn.photoset, unread), photos, Remarks())
    assert ask(first, [TurnedLens()]).photos is photos  # no camera, no axis
    known = replace(first, camera=quick_camera(every, SIZE))
    after = ask(known, [TurnedLens()])
    assert set(after.photos.as_read(drawn.photoset).turned) <= {"s3"}
    assert [one.view.photos[0].turned for one in after.photos.boards] == [False] * len(boards)
    assert after.remarks.codes() == (["photo-turned"] if after.photos is not photos else [])
