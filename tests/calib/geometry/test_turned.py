"""Photos of a fixed camera that are stored upside down."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.camera_poses import Photos, as_printed, turned_photos
from photogonio.calib.detect.photo_reader import Reader, Seen
from photogonio.calib.remarks import Remarks
from photogonio.capture.errors import InputError
from tests.calib.test_warnings import Drawn
from tests.drawn.setups import SIZE


def drawn_photos(turned: tuple[int, ...], *, views: int = 8, fixed: bool = True):
    drawn = Drawn(3, fixed=fixed, views=views)
    corners = [
        replace(one, pixels=np.array(SIZE) - 1 - one.pixels) if k in turned else one
        for k, one in enumerate(drawn.samples)
    ]
    return drawn, corners


@pytest.mark.parametrize("turned", [(), (2,), (0, 5), (1, 4, 7)])
def test_those_that_are_upside_down_are_found(turned):
    _, corners = drawn_photos(turned)
    assert turned_photos([(one, SIZE) for one in corners]) == list(turned)


def test_none_is_accused_where_as_many_are_one_way_as_the_other():
    _, corners = drawn_photos((0, 1, 2, 3))
    assert turned_photos([(one, SIZE) for one in corners]) == []


def unread(photoset, view):
    raise InputError(view.name, "no picture is drawn")


@pytest.mark.parametrize("fixed", [True, False])
def test_they_are_left_out_by_name_before_the_camera_is_fitted(fixed):
    drawn, corners = drawn_photos((3,), fixed=fixed)
    views = drawn.photoset.views("sample")
    seen = [Seen(view, one, SIZE) for view, one in zip(views, corners, strict=True)]
    remarks = Remarks()
    reader = Reader(drawn.photoset, unread)
    _, photos = as_printed(drawn.photoset, reader, Photos(seen, [], []), remarks)
    assert [one.view.name for one in photos.samples] == [v.name for v in views if v.name != "s3" or not fixed]
    assert remarks.codes() == (["photo-turned"] if fixed else [])
