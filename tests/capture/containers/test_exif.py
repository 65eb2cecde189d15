"""EXIF blocks: what they say, and nothing of damaged ones."""

from __future__ import annotations

from PIL import Image

from photogonio.capture.containers import exif
from photogonio.capture.files.exposure import from_attributes
from tests.capture.odd_files import exif_block


def test_exif_that_is_damaged_counts_as_absent():
    whole = exif_block()
    assert exif.attributes(whole)["ExposureTime"] == 1 / 64
    for length in range(len(whole)):
        exif.attributes(whole[:length])
    for k in range(6, len(whole)):
        exif.attributes(whole[:k] + bytes([whole[k] ^ 0xFF]) + whole[k + 1 :])


def test_a_block_says_its_exposure_as_numbers():
    found = exif.attributes(exif_block(6, time=(1, 64), apex=(6, 1)))
    assert found["ExposureTime"] == 1 / 64 and found["FNumber"] == 2.8 and found["Orientation"] == 6
    assert found["Exif:PhotographicSensitivity"] == 100 and found["Exif:ShutterSpeedValue"] == 6.0


def test_a_rational_over_nothing_is_no_number():
    found = exif.attributes(exif_block(time=(1, 0)))
    assert not (found["ExposureTime"] > 0) and found["FNumber"] == 2.8
    assert from_attributes(found).exposure_time is None


def test_a_file_laid_out_as_a_tiff_says_the_same(tmp_path):
    block = exif_block(time=(1, 121))
    (tmp_path / "a.nef").write_bytes(block.removeprefix(b"Exif\0\0"))
    assert exif.of_file(tmp_path / "a.nef") == exif.attributes(block)
    (tmp_path / "b.raf").write_bytes(b"FUJIFILMCCD-RAW" + block)
    assert exif.of_file(tmp_path / "b.raf") == {}


def test_a_block_says_which_camera_it_was_and_whether_its_flash_fired():
    made = Image.Exif()
    made[0x010F], made[0x0110] = "Maker", "Model 3"
    made.get_ifd(0x8769)[0x9209] = 25
    found = exif.attributes(made.tobytes())
    assert (found["Make"], found["Model"], found["Exif:Flash"]) == ("Maker", "Model 3", 25)
