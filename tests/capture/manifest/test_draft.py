"""A manifest from a folder of photos."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.capture.manifest.draft import manifest_text, numbered_anew, survey
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.manifest.stub import stub_manifest
from photogonio.capture.photoset import Photo
from photogonio.capture.target.layout import make_target
from tests.capture.odd_files import gama, png


@pytest.fixture
def folder(tmp_path, files):
    pixels = np.zeros((8, 8, 3), np.uint8)

    def add(name: str, time: float | None = None) -> None:
        attributes = (
            {}
            if time is None
            else {"ExposureTime": time, "FNumber": 8.0, "Exif__PhotographicSensitivity": 100}
        )
        files["oiio"](tmp_path / "set" / name, pixels, "uint8", **attributes)

    for name, time in (
        ("calibration/c1.jpg", 0.01),
        ("calibration/c0.JPG", 0.01),
        ("Sample/s0.jpg", 0.5),
        ("Sample/s1.jpg", 0.25),
        ("Sample/left lamp/a.jpg", 0.125),
        ("Sample/left lamp/b.jpg", 0.125),
        ("Sample/series/a.jpg", 0.125),
        ("Sample/series/b.jpg", 0.5),
        ("Sample/series/c.jpg", 2.0),
        ("chrome/left lamp/p.jpg", 0.125),
        ("darks/d.png", None),
        ("flat_01.jpg", 0.1),
        ("other.jpg", 0.1),
    ):
        add(name, time)
    (tmp_path / "set" / "notes.txt").write_text("not a photo")
    return tmp_path / "set"


def test_roles_lights_and_brackets_come_from_the_folders(folder):
    photos = {photo.file: photo for photo in survey(folder).photos}
    roles = {name: photo.role for name, photo in photos.items()}
    assert roles["calibration/c0.JPG"] == "calibration" and roles["Sample/s0.jpg"] == "sample"
    assert roles["chrome/left lamp/p.jpg"] == "probe" and roles["darks/d.png"] == "dark"
    assert roles["flat_01.jpg"] == "flat" and roles["other.jpg"] == "sample" and len(photos) == 13
    assert photos["Sample/left lamp/a.jpg"].light == "left lamp" == photos["chrome/left lamp/p.jpg"].light
    assert [photos[f"Sample/series/{k}.jpg"].bracket for k in "abc"] == [1, 1, 1]
    assert photos["Sample/s0.jpg"].bracket is None and photos["Sample/s0.jpg"].light is None


def test_exposures_come_from_exif(folder):
    photos = {photo.file: photo for photo in survey(folder).photos}
    assert photos["Sample/s0.jpg"].exposure_time == pytest.approx(0.5, abs=1e-6)
    assert (photos["Sample/s0.jpg"].f_number, photos["Sample/s0.jpg"].iso) == (8.0, 100.0)
    assert photos["darks/d.png"].exposure_time is None


def test_the_text_is_a_manifest_of_those_photos(folder):
    text = manifest_text(folder)
    assert text == manifest_text(folder) and "CHECK" in text and 'encoding = "srgb"' in text
    (folder / "photoset.toml").write_text(text, encoding="utf-8")
    found = load_photoset(folder)
    expected = survey(folder).photos
    assert [photo.file for photo in found.photos] == [photo.file for photo in expected]
    assert [photo.light for photo in found.photos] == [photo.light for photo in expected]
    for one, other in zip(found.photos, expected, strict=True):
        known = other.exposure_time is not None
        assert one.exposure_time == (pytest.approx(other.exposure_time, rel=1e-8) if known else None)


def test_photos_are_added_to_the_targets_own_manifest(folder):
    stub = stub_manifest(make_target(paper="a3", kind="aruco-grid"), name="mine")
    (folder / "photoset.toml").write_text(stub, encoding="utf-8")
    text = manifest_text(folder)
    assert text.startswith(stub.rstrip())
    (folder / "photoset.toml").write_text(text, encoding="utf-8")
    found = load_photoset(folder)
    assert found.name == "mine" and found.board.kind == "aruco-grid" and len(found.photos) == 13
    with pytest.raises(InputError, match="names photos already"):
        manifest_text(folder)


@pytest.mark.parametrize("inner", ["", "my-brdf/"])
def test_a_results_pictures_are_no_photos(folder, inner):
    """Whether the result lies among the photos or in a folder of its own; alike names elsewhere are photos."""
    photo = (folder / "darks/d.png").read_bytes()
    (folder / inner).mkdir(exist_ok=True)
    for name in ("coverage.png", "fit.png", "lobes.png"):
        (folder / inner / name).write_bytes(photo)
        (folder / "Sample" / name).write_bytes(photo)
    before = {p.file for p in survey(folder).photos}
    assert {f"{inner}fit.png", "Sample/fit.png"} <= before
    (folder / inner / "coefficients.json").write_text("{}")
    found = survey(folder)
    pictures = {f"{inner}{name}" for name in ("coverage.png", "fit.png", "lobes.png")}
    assert {p.file for p in found.photos} == before - pictures and set(found.passed) == pictures


def test_pictures_beside_a_setup_are_no_photos(folder):
    (folder / "setup-photos").mkdir()
    (folder / "setup-photos/s0.jpg").write_bytes((folder / "other.jpg").read_bytes())
    assert "setup-photos/s0.jpg" in {p.file for p in survey(folder).photos}
    for name in ("setup.json", "setup.html"):
        (folder / name).write_text("{}")
    assert "setup-photos/s0.jpg" in survey(folder).passed


def test_a_raw_file_goes_before_its_jpeg(folder, shared):
    (folder / "Sample" / "s0.dng").write_bytes((shared / "data" / "raw" / "colorchart.dng").read_bytes())
    names = [photo.file for photo in survey(folder).photos]
    assert "Sample/s0.dng" in names and "Sample/s0.jpg" not in names


def test_folders_without_photos_are_refused(tmp_path):
    with pytest.raises(InputError, match="no photo here"):
        manifest_text(tmp_path)
    with pytest.raises(InputError, match="no such folder"):
        manifest_text(tmp_path / "nowhere")
    (tmp_path / "a.jpg").write_bytes(b"no picture")
    with pytest.raises(InputError, match=r"a\.jpg"):
        manifest_text(tmp_path)


def test_names_with_quotes_are_quoted(folder):
    (folder / "Sample" / "s0.jpg").rename(folder / "Sample" / 'a "good" one.jpg')
    (folder / "photoset.toml").write_text(manifest_text(folder), encoding="utf-8")
    assert 'Sample/a "good" one.jpg' in [photo.file for photo in load_photoset(folder).photos]


@pytest.mark.parametrize(
    ("chunks", "kind", "expected"),
    [
        ((), np.uint8, "srgb"),
        ((), np.uint16, "linear"),
        (((b"sRGB", b"\0"),), np.uint16, "srgb"),
        ((gama(1.8),), np.uint16, "auto"),
        ((gama(1.0),), np.uint8, "linear"),
    ],
)
def test_the_encoding_is_what_the_files_say(tmp_path, chunks, kind, expected):
    for name in ("a.png", "b.png"):
        png(tmp_path / "set" / name, np.zeros((8, 8, 3), kind), *chunks)
    assert f'encoding = "{expected}"' in manifest_text(tmp_path / "set")


def test_photos_of_different_curves_are_left_to_the_files(tmp_path, files):
    png(tmp_path / "a.png", np.zeros((8, 8, 3), np.uint8))
    files["oiio"](tmp_path / "b.exr", np.zeros((8, 8, 3), np.float32), "half")
    assert 'encoding = "auto"' in manifest_text(tmp_path)


def test_nothing_that_looks_like_a_photo_is_passed_over_in_silence(tmp_path, files):
    picture = np.zeros((8, 8, 3), np.uint8)
    for name in ("good.png", "good.webp", "good.bmp"):
        files["oiio"](tmp_path / name, picture, "uint8")
    (tmp_path / "broken.jpg").write_bytes(b"no picture")
    (tmp_path / "film.gif").write_bytes(b"GIF89a")
    (tmp_path / "good.png").rename(tmp_path / "nameless")
    (tmp_path / "notes.txt").write_text("a list")
    (tmp_path / "._good.jpg").write_bytes(b"what an Apple leaves")
    found = survey(tmp_path)
    assert {photo.file for photo in found.photos} == {"good.webp", "good.bmp"}
    assert set(found.passed) == {"broken.jpg", "film.gif", "nameless"}
    assert "GIF" in found.passed["film.gif"] and "PNG" in found.passed["nameless"]
    text = manifest_text(tmp_path)
    for name in found.passed:
        assert f'# NOT TAKEN: "{name}"' in text
    (tmp_path / "photoset.toml").write_text(text, encoding="utf-8")
    assert len(load_photoset(tmp_path).photos) == 2


@pytest.mark.parametrize(("stated", "told"), [("linear", True), ("srgb", False), ("auto", False)])
def test_a_manifest_of_another_encoding_is_doubted(tmp_path, stated, told):
    png(tmp_path / "a.png", np.zeros((8, 8, 3), np.uint8), (b"sRGB", b"\0"))
    stub = stub_manifest(make_target(), encoding=stated)
    (tmp_path / "photoset.toml").write_text(stub, encoding="utf-8")
    text = manifest_text(tmp_path)
    assert text.startswith(stub.rstrip()) and "# Tone curves: sRGB (sRGB chunk)." in text
    assert (f'# CHECK: [radiometry] encoding = "{stated}"' in text) == told


def test_new_brackets_take_no_number_that_is_given():
    """A folder whose name comes first shifts the numbers of all others; those in the manifest stay."""
    names = ["A/1", "A/2", "B/1", "B/2", "C/1", "C/2", "C/3", "x"]
    fresh = [Photo(n, "sample", bracket=None if n == "x" else ord(n[0]) - 64) for n in names]
    known = {n: Photo(n, "sample", bracket=k) for n, k in zip(names[2:6], [1, 1, 2, 2], strict=True)}
    assert [p.bracket for p in numbered_anew(fresh, known)] == [3, 3, 1, 1, 2, 2, 2, None]
    assert numbered_anew(fresh, {}) == tuple(fresh)
