"""Exposure: the manifest's, else EXIF's; how much light it stands for."""

from __future__ import annotations

import numpy as np
import pytest
from photogonio.capture.files.exposure import Exposure, combine, filled, from_attributes
from photogonio.capture.files.images import read_header
from photogonio.capture.photoset import Photo

EXIF = {"ExposureTime": 1 / 60, "FNumber": 5.6, "Exif:PhotographicSensitivity": 400}


@pytest.mark.parametrize(("suffix", "iso"), [(".jpg", 400), (".png", 400), (".tif", None)])
def test_exif_is_read(tmp_path, files, suffix, iso):
    """(OpenImageIO writes no ISO into a TIFF.)"""
    path = tmp_path / f"a{suffix}"
    pixels = np.zeros((8, 8, 3), np.uint8)
    attributes = {name.replace(":", "__"): value for name, value in EXIF.items()}
    files["oiio"](path, pixels, "uint8", **attributes)
    found = read_header(path).exposure
    # OpenImageIO writes some times as millionths of a second
    assert found.exposure_time == pytest.approx(1 / 60, abs=1e-6)
    assert found.f_number == pytest.approx(5.6, rel=1e-6)
    assert found.iso == iso


def test_the_manifest_goes_before_exif():
    header = Exposure(0.5, 8.0, None)
    assert combine(Photo("a", "sample", exposure_time=0.25), header) == Exposure(0.25, 8.0, None)


def test_nonsense_in_exif_counts_as_absent():
    nonsense = {"ExposureTime": 0.0, "FNumber": float("nan"), "Exif:ISOSpeedRatings": "auto"}
    assert from_attributes(nonsense) == Exposure()
    assert from_attributes({"Exif:ISOSpeedRatings": (200,)}).iso == 200


def test_one_stop_is_a_factor_of_two():
    base = Exposure(1 / 50, 8.0, 100.0)
    for other in (
        Exposure(1 / 25, 8.0, 100.0),
        Exposure(1 / 50, 8 / 2**0.5, 100.0),
        Exposure(1 / 50, 8.0, 200.0),
    ):
        assert other.factor == pytest.approx(2 * base.factor, rel=1e-12)
    assert Exposure(2.0).factor == 2.0 and Exposure().factor == 1.0
    assert base.only(frozenset({"iso"})) == Exposure(iso=100.0)


def test_exposures_that_some_photos_lack_are_taken_as_the_others():
    photos = [Photo(name, "sample") for name in "abc"] + [Photo("d", "sample", bracket=1)]
    times = dict(zip("abcd", (0.5, None, 0.25, None), strict=True))
    found, lacking = filled({name: Exposure(time) for name, time in times.items()}, photos)
    assert found == {"a": Exposure(0.5), "b": Exposure(0.375), "c": Exposure(0.25), "d": Exposure(None)}
    assert lacking == {"exposure_time": ["b"]}
    assert filled({name: Exposure() for name in "abcd"}, photos)[1] == {}
