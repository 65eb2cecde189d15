"""All photos at first sight, by role."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from photogonio.calib.detect.first_look import Photos
from photogonio.calib.detect.photo_reader import Seen
from photogonio.capture.photoset import Photo, PhotoSet, Sphere, View


def seen(name: str, role: str, turned: bool = False) -> Seen:
    return Seen(View((Photo(name, role, turned=turned),)), None, (80, 60))


PHOTOS = Photos(
    [seen("s0", "sample"), seen("s1", "sample")],
    [seen("p0", "probe")],
    [seen("c0", "calibration"), seen("c1", "calibration")],
)


def test_photos_come_back_from_their_row():
    assert PHOTOS.replaced(PHOTOS.every) == PHOTOS
    changed = [replace(one, size=(8, 6)) for one in PHOTOS.every]
    found = PHOTOS.replaced(changed)
    assert [one.view.name for one in found.samples] == ["s0", "s1"]
    assert [one.view.name for one in found.probes] == ["p0"] and found.every == changed


def test_the_set_is_turned_as_its_photos_are_read():
    """Photos that were not looked at stay as they are."""
    files = [(one.view.name, one.view.photos[0].role) for one in PHOTOS.every]
    photos = tuple(Photo(name, role) for name, role in (*files, ("d0", "dark")))
    told = PhotoSet(Path("."), "a", "mm", Sphere(np.zeros(3), 1.0), "auto", photos)
    turned = Photos(
        [seen("s0", "sample"), seen("s1", "sample", turned=True)],
        PHOTOS.probes,
        [seen("c0", "calibration", turned=True)],
    )
    assert sorted(turned.as_read(told).turned) == ["c0", "s1"]
    assert PHOTOS.as_read(turned.as_read(told)).turned == ()
