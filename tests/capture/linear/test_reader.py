"""From files to radiance: every correction, end to end, against the light that made the photos."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.capture.linear.encoding import linear_to_srgb
from photogonio.capture.linear.prepare import prepare
from tests.capture.small_sets import SHAPE, STEP16, value


def test_linear_files_are_read_as_they_are(make, light):
    photoset, reader = make([("a.png", "sample", light, {})])
    assert np.abs(value(photoset, reader) - light).max() < STEP16


def test_single_pixels_read_as_in_the_whole_photo(make, light):
    """With a dark frame, a flat field, lamp-off light, a bracket, saturated and hot pixels."""
    spotted = 1.6 * light
    spotted[20, 30] = 1.0
    spotted[41, 50] = 0.0
    photos = [
        ("a.png", "sample", spotted, {"bracket": 0, "exposure_time": 1.0}),
        ("b.png", "sample", spotted / 4, {"bracket": 0, "exposure_time": 0.25}),
        ("c.png", "sample", spotted, {"exposure_time": 1.0}),
        ("d.png", "dark", 0.01 + 0 * light, {"exposure_time": 1.0}),
        ("e.png", "ambient", 0.01 + 0.02 * light, {"exposure_time": 1.0}),
        ("f.png", "flat", 0.3 + 0.3 * light, {"exposure_time": 1.0}),
    ]
    photoset, reader = make(photos, '[radiometry]\nvignetting = "flat"\ngain_electrons = 20000')
    y, x = np.mgrid[3 : SHAPE[0] - 3, 3 : SHAPE[1] - 3]
    pixels = np.column_stack([x.ravel(), y.ravel()])
    for view in photoset.views("sample"):
        whole = reader.read(view)
        inside = np.s_[3:-3, 3:-3]
        assert not whole.valid[inside].all()
        found, valid = reader.read_at(view, pixels)
        np.testing.assert_array_equal(valid.reshape(y.shape), whole.valid[inside])
        np.testing.assert_array_equal(found.reshape(*y.shape, 3), whole.value[inside])


def test_bands_are_the_whole_photo(make, light, monkeypatch):
    monkeypatch.setattr("photogonio.capture.linear.reader.BAND", 16)
    photos = [
        ("a.png", "sample", light, {"bracket": 0, "exposure_time": 1.0}),
        ("b.png", "sample", light / 4, {"bracket": 0, "exposure_time": 0.25}),
        ("c.png", "sample", light, {"exposure_time": 1.0}),
    ]
    photoset, reader = make(photos)
    for view, count in zip(photoset.views("sample"), (1, -(-SHAPE[0] // 16)), strict=True):
        bands, whole = list(reader.bands(view)), reader.read(view)
        assert len(bands) == count
        for name in ("value", "saturated"):
            parts = np.concatenate([getattr(band, name) for band in bands])
            np.testing.assert_array_equal(parts, getattr(whole, name))


def test_exposure_scales_radiance(make, light):
    """Twice the time, half the ISO, a stop down: radiance is per second at ISO 100 and f/1."""
    photos = [
        ("a.png", "sample", light, {"exposure_time": 0.5, "iso": 100, "f_number": 4}),
        ("b.png", "sample", light / 4, {"exposure_time": 1.0, "iso": 25, "f_number": 4 * 2**0.5}),
    ]
    photoset, reader = make(photos)
    first, second = value(photoset, reader, 0), value(photoset, reader, 1)
    assert np.abs(first - light * 4**2 / 0.5).max() < STEP16 * 32
    assert np.abs(first - second).max() < 5 * STEP16 * 32  # the second is a fourth as bright, so coarser


def test_a_quantity_that_only_some_photos_have_is_refused_where_it_lacks(make, light):
    photoset, reader = make(
        [("a.png", "sample", light, {"exposure_time": 0.5}), ("b.png", "sample", light, {})]
    )
    assert reader.fields == {"exposure_time"}
    reader.read(photoset.views("sample")[0])
    with pytest.raises(InputError, match=r"b\.png: no exposure_time"):
        reader.read(photoset.views("sample")[1])


def test_light_over_a_photo_is_taken_off_it_alone(make, light):
    """Of radiance, before vignetting is divided out, however the photo is read."""
    veil = np.array([0.01, 0.02, 0.03])
    photos = [
        ("a.png", "sample", light / 2, {"exposure_time": 0.5}),
        ("b.png", "sample", light, {"exposure_time": 1.0}),
    ]
    photoset, bare = make(photos)
    reader = replace(bare, veil={"a.png": veil})
    assert np.abs(value(photoset, reader) - (light - veil)).max() < 6 * STEP16
    np.testing.assert_array_equal(value(photoset, reader, 1), value(photoset, bare, 1))
    level, _ = reader.read_level(photoset.views("sample")[0])
    np.testing.assert_allclose(level, value(photoset, reader).mean(2), rtol=1e-5)
    gain = np.full((*SHAPE, 1), 2.0, np.float32)
    np.testing.assert_allclose(
        value(photoset, replace(reader, gain=gain)), 2 * value(photoset, reader), rtol=1e-6
    )


def test_ambient_light_is_not_taken_from_photos_of_the_board(make, light):
    """They are taken from elsewhere and by the room's light: what would be subtracted is another picture."""
    photos = [
        ("a.png", "sample", light + 0.1, {}),
        ("b.png", "calibration", light, {}),
        ("c.png", "ambient", np.full_like(light, 0.1), {}),
    ]
    photoset, reader = make(photos)
    assert np.abs(value(photoset, reader) - light).max() < 3 * STEP16
    board = reader.read(photoset.views("calibration")[0])
    assert np.abs(board.value - light).max() < 3 * STEP16


def test_a_region_is_the_same_as_the_whole_cut(make, light):
    photos = [("a.png", "sample", light, {}), ("b.png", "ambient", light * 0.1, {})]
    photoset, reader = make(photos)
    whole = reader.read(photoset.views("sample")[0])
    part = reader.read(photoset.views("sample")[0], (10, 5, 50, 40))
    assert part.origin == (10, 5)
    assert np.array_equal(part.value, whole.value[5:40, 10:50])
    assert np.array_equal(part.variance, whole.variance[5:40, 10:50])
    assert np.array_equal(part.saturated, whole.saturated[5:40, 10:50])


def test_saturation_and_its_neighbours_are_not_valid(make, light, sensor):
    bright = light.copy()
    bright[20:24, 30:34, 1] = 1.5
    photoset, reader = make([("a.png", "sample", sensor(bright), {})])
    found = reader.read(photoset.views("sample")[0])
    assert found.saturated[20:24, 30:34].all() and found.saturated.sum() == 16
    assert not found.valid[19:25, 29:35].any() and found.valid.mean() > 0.98


def test_pixels_far_below_black_are_not_valid(make, light, sensor):
    noisy = sensor(light + 0.1)
    noisy[10:14, 10:14] = 0.02
    extra = "[radiometry]\nblack_level = 0.1\ngain_electrons = 20000\nread_noise_electrons = 5"
    photoset, reader = make([("a.png", "sample", noisy, {})], extra)
    found = reader.read(photoset.views("sample")[0])
    assert not found.valid[10:14, 10:14].any() and found.valid.mean() > 0.99


def test_brackets_are_joined(make, light, sensor):
    photos = [
        (f"{k}.png", "sample", sensor(light * step / 4, seed=k), {"exposure_time": step, "bracket": 1})
        for k, step in enumerate((1.0, 4.0, 16.0))
    ]
    photoset, reader = make(photos)
    assert len(photoset.views("sample")) == 1
    found = reader.read(photoset.views("sample")[0])
    single = reader.exposed(type(photoset.views("sample")[0])((photoset.photos[0],)))
    # 4800 pixels of 1 % noise or less, their mean sure to 0.02 %
    assert (found.value / (light / 4))[found.valid].mean() == pytest.approx(1.0, abs=1e-3)
    assert np.median(found.variance / single.variance) < 0.5 and not found.ghost.any()


def test_a_bracket_without_exposures_is_refused(make, light):
    photos = [(f"{k}.png", "sample", light / (k + 1), {"bracket": 1}) for k in range(2)]
    photoset, reader = make(photos)
    with pytest.raises(InputError, match=r"0\.png.*exposure_time"):
        reader.read(photoset.views("sample")[0])


def test_one_photo_of_other_channels_is_named(make, light):
    photos = [
        ("a.png", "sample", light, {}),
        ("b.png", "sample", light, {}),
        ("c.png", "sample", light[..., :1], {}),
    ]
    photoset, reader = make(photos)
    with pytest.raises(InputError, match=r"c\.png: has 1 channels"):
        reader.read(photoset.views("sample")[2])


def test_one_unreadable_photo_is_named_when_it_is_read(make, light, tmp_path):
    photos = [("a.png", "sample", light, {}), ("b.png", "sample", light, {})]
    (tmp_path / "c.png").write_bytes(b"")
    photoset, reader = make([*photos, ("c.png", "sample", None, {})])
    reader.read(photoset.views("sample")[0])
    with pytest.raises(InputError, match=r"c\.png: "):
        reader.read(photoset.views("sample")[2])


def test_readers_travel_to_other_processes(make, light, sensor):
    photoset, reader = make([("a.png", "sample", sensor(light), {}), ("b.png", "dark", light * 0.01, {})])
    copy = pickle.loads(pickle.dumps(reader))
    view = photoset.views("sample")[0]
    assert np.array_equal(copy.read(view).value, reader.read(view).value)
    assert np.array_equal(prepare(photoset).read(view).variance, reader.read(view).variance)


@pytest.mark.parametrize(("encoding", "channels"), [("linear", 3), ("srgb", 3), ("linear", 1)])
def test_gray_levels_are_the_mean_of_the_radiance(make, light, sensor, encoding, channels):
    signal = light[..., :channels] * 2.2  # the brightest corner is full
    coded = linear_to_srgb(signal) if encoding == "srgb" else signal
    extra = f'[radiometry]\nencoding = "{encoding}"'
    photoset, reader = make([("a.png", "sample", coded, {"exposure_time": 0.5})], extra)
    view = photoset.views("sample")[0]
    level, usable = reader.read_level(view)
    whole = reader.read(view)
    assert level == pytest.approx(whole.value.mean(2), rel=1e-5)
    assert np.array_equal(usable, ~whole.saturated) and not usable.all()


def test_how_codes_became_radiance_is_known_of_single_photos(make, light):
    """Decoded and divided by hand, a photo is what is read."""
    photos = [
        ("a.png", "sample", linear_to_srgb(light), {"exposure_time": 0.5}),
        ("b.png", "sample", linear_to_srgb(light), {"exposure_time": 0.5, "bracket": 1}),
        ("c.png", "sample", linear_to_srgb(light / 2), {"exposure_time": 0.25, "bracket": 1}),
    ]
    photoset, reader = make(photos, '[radiometry]\nencoding = "srgb"')
    single, bracket = photoset.views("sample")
    coded = reader.coded(single)
    codes = linear_to_srgb(reader.read(single).value.astype(float) * coded.exposure)
    assert np.abs(coded.encoding.linear(codes, 3) - light).max() < 1e-3
    assert coded.steps == 65535
    assert reader.coded(bracket) is None
