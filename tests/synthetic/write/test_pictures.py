"""Files as a telephone writes them: colour in halves, a profile, times by their names."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image, ImageCms
from PIL.JpegImagePlugin import get_sampling

from photogonio.calib.geometry.camera import Pose
from photogonio.capture.files.images import read_header, read_image
from photogonio.synthetic.scene.parts import SensorScene
from photogonio.synthetic.scene.phone import AutoExposure
from photogonio.synthetic.scene.plan import FLASH, PlannedLamp, Shot
from photogonio.synthetic.write.pictures import PRIMARIES, icc_profile, named, write_photo

SENSOR = SensorScene(bits=8, encoding="srgb", format="jpeg", f_number=1.8, iso=64.0, exposure=AutoExposure())


def shot(seconds: float, lamp: str = "L000") -> Shot:
    shining = PlannedLamp(lamp, "point", np.array([0.0, 0.0, 300.0]), 1.0, np.ones(3))
    return Shot("a.jpg", "sample", Pose(np.eye(3), np.zeros(3)), (shining,), seconds)


def smooth() -> np.ndarray:
    y, x = np.mgrid[:48, :64] / 64
    return np.round(255 * np.stack([0.2 + 0.6 * x, 0.2 + 0.6 * y, 0.7 - 0.3 * x], axis=-1)).astype(np.uint8)


@pytest.mark.parametrize("kind", ["jpeg", "heic"])
@pytest.mark.parametrize("primaries", ["srgb", "p3"])
def test_a_file_reads_back_with_exposure_flash_and_curve(tmp_path, kind, primaries):
    sensor = replace(SENSOR, format=kind, primaries=primaries, quality=97)
    path = tmp_path / f"a.{ {'jpeg': 'jpg', 'heic': 'heic'}[kind] }"
    write_photo(path, smooth(), sensor, shot(1 / 64, FLASH))
    header, image = read_header(path), read_image(path)
    assert np.abs(image.pixels.astype(int) - smooth()).max() <= 6  # colour in halves, on a slope
    assert header.exposure.exposure_time == pytest.approx(1 / 60, rel=1e-6)  # 1/64 s by its name
    assert header.exposure.f_number == pytest.approx(1.8) and header.exposure.iso == 64
    assert header.flash is True and {curve.kind for curve in header.tone.curves} == {"srgb"}
    assert ("Display P3" if primaries == "p3" else "sRGB") in header.tone.source
    again = tmp_path / f"b{path.suffix}"
    write_photo(again, smooth(), sensor, shot(1 / 64, FLASH))
    assert again.read_bytes() == path.read_bytes()
    write_photo(again, smooth(), sensor, shot(1 / 64))
    assert read_header(again).flash is False


@pytest.mark.parametrize(("chroma", "halves"), [("4:2:0", 2), ("4:4:4", 0)])
def test_colour_is_as_fine_as_is_said(tmp_path, chroma, halves):
    checks = np.zeros((48, 64, 3), np.uint8)
    checks[:, ::2] = [255, 0, 0]
    checks[:, 1::2] = [0, 0, 255]
    write_photo(tmp_path / "a.jpg", checks, replace(SENSOR, chroma=chroma, quality=97), shot(0.01))
    with Image.open(tmp_path / "a.jpg") as file:
        assert get_sampling(file) == halves
    found = read_image(tmp_path / "a.jpg").pixels.astype(int)
    apart = np.abs(found[:, ::2, 0] - found[:, 1::2, 0]).mean()
    assert apart > 200 if halves == 0 else apart < 100


@pytest.mark.parametrize("thirds", range(-36, 7))
def test_names_are_within_a_sixth_of_a_stop_of_what_they_mean(thirds):
    seconds = 2.0 ** (thirds / 3)
    name = named(SENSOR, seconds)
    assert abs(np.log2(name / seconds)) < 1 / 6
    whole = named(replace(SENSOR, exposure=AutoExposure(steps=0)), seconds)
    assert abs(1 / whole - 1 / seconds) <= 0.5 if seconds < 0.3 else abs(whole - seconds) <= 0.0051
    assert named(replace(SENSOR, exposure=None), seconds) == seconds


@pytest.mark.parametrize("encoding", ["linear", "gamma", "srgb", "tone"])
@pytest.mark.parametrize("primaries", sorted(PRIMARIES))
def test_profiles_are_what_colour_management_takes_them_for(encoding, primaries):
    block = icc_profile(replace(SENSOR, encoding=encoding, primaries=primaries))
    profile = ImageCms.ImageCmsProfile(io.BytesIO(block)).profile
    assert np.sum(PRIMARIES[primaries], axis=0) == pytest.approx([0.9642, 1.0, 0.8249], abs=3e-4)  # D50
    assert profile.red_colorant[0] == pytest.approx(PRIMARIES[primaries][0], abs=1e-4)
    assert profile.profile_description == {"srgb": "sRGB", "p3": "Display P3"}[primaries]
