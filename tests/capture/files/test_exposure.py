"""Exposure: the manifest's, else EXIF's; how much light it stands for."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.files.exposure import Exposure, camera_name, combine, filled, from_attributes, stepped
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


@pytest.mark.parametrize(
    ("attributes", "expected"),
    [
        ({"Exif:ShutterSpeedValue": 6.0, "Exif:ApertureValue": 5.0}, (1 / 64, 2**2.5, None)),  # APEX alone
        ({"ExposureTime": 1 / 60, "Exif:ShutterSpeedValue": 6.0}, (1 / 64, None, None)),  # the name of 1/64 s
        ({"ExposureTime": 1 / 60, "Exif:ShutterSpeedValue": np.log2(60)}, (1 / 60, None, None)),
        (
            {"ExposureTime": 1 / 60, "Exif:ShutterSpeedValue": 7.0},
            (1 / 60, None, None),
        ),  # it speaks of something else
        (
            {"ExposureTime": 1 / 121, "Exif:ShutterSpeedValue": 7.0},
            (1 / 121, None, None),
        ),  # no name, but exact
        (
            {"ExposureTime": 1 / 50, "Exif:ShutterSpeedValue": 5.6},
            (1 / 50, None, None),
        ),  # tenths tell nothing
        ({"FNumber": 11.0, "Exif:ApertureValue": 7.0}, (None, 2**3.5, None)),
        (
            {"Exif:PhotographicSensitivity": 65535, "Exif:RecommendedExposureIndex": 102400},
            (None, None, 102400),
        ),
        (
            {"Exif:PhotographicSensitivity": 65535, "Exif:StandardOutputSensitivity": 80000},
            (None, None, 80000),
        ),
        ({"Exif:PhotographicSensitivity": 65535}, (None, None, 65535)),
        ({"Exif:ISOSpeed": 200}, (None, None, 200)),
        ({"Exif:ShutterSpeedValue": float("nan"), "Exif:ApertureValue": 1e9}, (None, None, None)),
    ],
)
def test_apex_and_long_sensitivities(attributes, expected):
    found = from_attributes(attributes)
    for value, right in zip((found.exposure_time, found.f_number, found.iso), expected, strict=True):
        assert value is None if right is None else value == pytest.approx(right, rel=1e-12)


def test_what_the_manifest_or_apex_says_is_no_name():
    header = from_attributes({"ExposureTime": 1 / 60, "Exif:ShutterSpeedValue": float(np.log2(60))})
    stated = combine(Photo("b", "sample", exposure_time=1 / 15), Exposure())
    found, lines = stepped({"a": header, "b": stated, "c": Exposure(1 / 30)})
    assert [round(1 / one.exposure_time, 6) for one in found.values()] == [60, 15, 32]
    assert lines == ()  # one photo alone is not misled against another


def test_one_and_the_same_time_is_nothing_to_speak_of():
    assert stepped({"a": Exposure(1 / 60), "b": Exposure(1 / 60)})[1] == ()


def test_a_camera_is_named_in_one_line():
    assert camera_name({"Make": "Maker\nx = 1\0", "Model": "M\x07 2"}) == "Maker x = 1 M  2"
