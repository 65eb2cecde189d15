"""A linear DNG reads back as it was written: light by its levels, exposure and flash by its own directory."""

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Pose
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import read_header, read_image
from photogonio.synthetic.scene.parts import SensorScene
from photogonio.synthetic.scene.phone import AutoExposure
from photogonio.synthetic.scene.plan import FLASH, PlannedLamp, Shot
from photogonio.synthetic.scene.scene import load_scene
from photogonio.synthetic.write.pictures import write_photo

BLACK = 2048
SENSOR = SensorScene(format="dng", f_number=1.8, iso=64.0, exposure=AutoExposure(), black_level=BLACK / 65535)


def test_light_exposure_and_flash_read_back(tmp_path):
    photo = np.random.default_rng(1).integers(BLACK, 65536, (48, 64, 3), np.uint16)
    lamp = PlannedLamp(FLASH, "point", np.array([0.0, 0.0, 300.0]), 1.0, np.ones(3))
    path = tmp_path / "a.dng"
    write_photo(path, photo, SENSOR, Shot("a.dng", "sample", Pose(np.eye(3), np.zeros(3)), (lamp,), 1 / 64))
    header, image = read_header(path), read_image(path)
    assert image.raw and (image.full_scale, image.black) == (65535 - BLACK, BLACK)
    np.testing.assert_array_equal(image.pixels, photo.astype(np.float32) - BLACK)
    assert header.exposure.exposure_time == pytest.approx(1 / 60, rel=1e-6)  # 1/64 s by its name
    assert header.exposure.f_number == pytest.approx(1.8) and header.exposure.iso == 64
    assert header.flash is True


@pytest.mark.parametrize("told", ["bits = 8", 'encoding = "srgb"'])
def test_what_no_linear_dng_has_is_refused(tmp_path, told):
    scene = tmp_path / "scene.toml"
    scene.write_text(f'base = "example"\n[sensor]\nformat = "dng"\n{told}\n')
    with pytest.raises(InputError, match="dng"):
        load_scene(scene)
