"""From files to radiance: every correction, end to end, against the light that made the photos."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.capture.linear.encoding import linear_to_gamma, linear_to_srgb
from photogonio.capture.linear.prepare import prepare, read_radiance
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.radiance import exposure_fault

SHAPE = (60, 80)
STEP16 = 1 / 65535


@pytest.fixture
def light() -> np.ndarray:
    """Smooth light, dark to bright, of three colours."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    ground = 0.02 + 0.5 * (x / SHAPE[1]) * (0.4 + 0.6 * y / SHAPE[0])
    return ground[..., None] * [1.0, 0.8, 0.5]


@pytest.fixture
def make(tmp_path, files):
    """Writes a set of (name, role, codes or pixels, further keys) and prepares its reader."""

    def build(photos, extra="", full=65535, camera=None, kind="float"):
        entries = []
        for name, role, signal, keys in photos:
            if name.endswith("exr"):
                files["oiio"](tmp_path / name, signal.astype(np.float32), kind)
            elif signal is not None:
                codes = np.round(np.clip(signal, 0, 1) * full)
                files["png"](tmp_path / name, codes.astype(np.uint16 if full > 255 else np.uint8))
            entries.append({"file": name, "role": role, **keys})
        photoset = load_photoset(files["manifest"](tmp_path, entries, extra))
        return photoset, prepare(photoset, camera=camera)

    return build


def value(photoset, reader, number=0, roi=None):
    return reader.read(photoset.views("sample")[number], roi).value


def test_linear_files_are_read_as_they_are(make, light):
    photoset, reader = make([("a.png", "sample", light, {})])
    assert np.abs(value(photoset, reader) - light).max() < STEP16
    assert np.array_equal(read_radiance(photoset, photoset.views("sample")[0]).value, value(photoset, reader))


@pytest.mark.parametrize(
    ("encoding", "encode"),
    [
        ('encoding = "srgb"', linear_to_srgb),
        ('encoding = "gamma"\ngamma = 1.8', lambda x: linear_to_gamma(x, 1.8)),
        ('encoding = "gamma"\ngamma = 2.4', lambda x: linear_to_gamma(x, 2.4)),
    ],
)
@pytest.mark.parametrize("name", ["a.png", "a.exr"])
def test_encodings_are_undone(make, light, encoding, encode, name):
    photoset, reader = make([(name, "sample", encode(light), {})], f"[radiometry]\n{encoding}")
    # the steepest slope of these curves, at the top, is their exponent
    assert np.abs(value(photoset, reader) - light).max() < 3 * STEP16


@pytest.mark.parametrize("encoding", ["linear", "srgb"])
def test_half_floats_read_as_the_same_numbers_in_full(make, light, encoding):
    """Whole, in parts, at single pixels, as gray levels; with an ambient photo, and a pile of full pixels."""
    held = np.float16(np.minimum(1.3 * light, 0.6) * np.linspace(0.9, 1.1, SHAPE[1])[:, None])
    held[10:20, 60:] = 1.0
    photos = [
        ("a.exr", "sample", held, {}),
        ("b.exr", "sample", held, {}),
        ("c.exr", "ambient", held / 16, {}),
    ]
    places = np.array([[10, 12], [40, 30], [61, 20]])
    found = []
    for kind in ("half", "float"):
        photoset, reader = make(photos, f'[radiometry]\nencoding = "{encoding}"', kind=kind)
        (view, _), (x0, y0, x1, y1) = photoset.views("sample"), (13, 8, 70, 50)
        whole, part = reader.read(view), reader.read(view, (x0, y0, x1, y1))
        assert whole.saturated[10:20, 60:].all() and not whole.saturated[:9].any()
        np.testing.assert_array_equal(part.value, whole.value[y0:y1, x0:x1])
        level = (*reader.read_level(view), *reader.read_level(view, (x0, y0, x1, y1)))
        found.append((whole.value, whole.variance, whole.valid, *level, *reader.read_at(view, places)))
    for half, full in zip(*found, strict=True):
        np.testing.assert_array_equal(half, full)


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


def test_levels(make, light):
    photoset, reader = make(
        [("a.png", "sample", 0.1 + 0.7 * light, {})], "[radiometry]\nblack_level = 0.1\nwhite_level = 0.8"
    )
    assert np.abs(value(photoset, reader) - light).max() < 2 * STEP16


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


def test_dark_ambient_and_flat_together(make, light):
    """Photos with dark signal, room light and vignetting, at their own exposures, give back the lamp's
    light.
    """
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    even = (1 - 0.3 * ((x - 39.5) ** 2 + (y - 29.5) ** 2) / 40**2)[..., None] * np.ones(3)
    dark = 0.01 + 0.005 * (x[..., None] % 7) / 7 * np.ones(3)
    room = 0.03 * (1 + y[..., None] / 60) * np.ones(3)
    photos = [
        ("s.png", "sample", (light + room) * even * 0.5 + dark, {"exposure_time": 0.5}),
        ("off.png", "ambient", room * even * 2 + dark, {"exposure_time": 2.0}),
        ("cap.png", "dark", dark, {"exposure_time": 0.5}),
        ("sheet.png", "flat", 0.6 * even + dark, {"exposure_time": 1.0}),
    ]
    photoset, reader = make(photos, '[radiometry]\nvignetting = "flat"')
    found = value(photoset, reader)
    # 1 where the flat's middle is: a tenth of the picture, where it is even to 0.3 %; and a dozen steps of rounding
    assert np.abs(found / light - 1).max() < 0.003 + 12 * STEP16 / 0.01


def test_ambient_of_another_light_is_not_subtracted(make, light):
    photos = [
        ("a.png", "sample", light + 0.1, {"light": "one"}),
        ("b.png", "sample", light + 0.2, {"light": "two"}),
        ("c.png", "ambient", np.full_like(light, 0.1), {"light": "one"}),
        ("d.png", "ambient", np.full_like(light, 0.2), {}),
    ]
    photoset, reader = make(photos)
    for number in range(2):
        assert np.abs(value(photoset, reader, number) - light).max() < 3 * STEP16


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


def test_doubts_are_said(make, light, tmp_path, files):
    ambient = ("c.png", "ambient", light * 0.1, {})
    photos = [("a.png", "sample", light, {}), ("b.png", "sample", light, {})]
    _, reader = make([*photos, ambient])
    assert not any("ambient" in warning for warning in reader.warnings)  # the camera's pose is given
    head = (tmp_path / "photoset.toml").read_text()
    moving = "\n".join(line for line in head.splitlines() if not line.startswith(("rotation", "translation")))
    board = '[board]\nkind = "charuco"\ndictionary = "DICT_4X4_50"\nsquares = [5, 5]\nsquare_length = 2\n'
    (tmp_path / "photoset.toml").write_text(moving.replace("[camera]", board + "marker_length = 1\n[camera]"))
    assert any("ambient" in warning for warning in prepare(load_photoset(tmp_path)).warnings)
    files["oiio"](tmp_path / "j.jpg", (light * 255).astype(np.uint8), "uint8")
    for encoding, count in (("linear", 1), ("srgb", 0)):
        extra = f'[radiometry]\nencoding = "{encoding}"'
        jpeg = load_photoset(files["manifest"](tmp_path, [{"file": "j.jpg", "role": "sample"}], extra))
        assert sum("JPEG" in warning for warning in prepare(jpeg).warnings) == count


def test_cos4_divides_by_the_fourth_power(make, light):
    class Wide:
        size = SHAPE[::-1]

        def rays(self, pixels):
            plane = (pixels - [39.5, 29.5]) / 60
            rays = np.column_stack([plane, np.ones(len(plane))])
            return rays / np.linalg.norm(rays, axis=1, keepdims=True)

    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    cosine = Wide().rays(np.column_stack([x.ravel(), y.ravel()]).astype(float))[:, 2].reshape(*SHAPE, 1)
    photos = [("a.png", "sample", light * cosine**4, {})]
    photoset, reader = make(photos, '[radiometry]\nvignetting = "cos4"', camera=Wide())
    assert np.abs(value(photoset, reader) - light).max() < 3 * STEP16  # the corners are raised 1.9 times


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


@pytest.mark.parametrize("encoding", ["linear", "srgb"])
def test_the_stated_variance_is_the_scatter(make, light, sensor, encoding):
    """Photon and read noise of the manifest's electrons, exposure divided out: 95 % lie within 1.96 errors."""
    extra = f'[radiometry]\nencoding = "{encoding}"\ngain_electrons = 5000\nread_noise_electrons = 8'
    noisy = sensor(light, electrons=5000, read=8)
    codes = linear_to_srgb(noisy) if encoding == "srgb" else noisy
    photoset, reader = make(
        [("a.png", "sample", codes, {"exposure_time": 0.25})],
        extra,
        full=255 if encoding == "srgb" else 65535,
    )
    found = reader.read(photoset.views("sample")[0])
    normal = (found.value - light / 0.25) / np.sqrt(found.variance)
    # 14400 values: 0.6 % of scatter of the deviation, 0.2 % of the share
    assert normal.std() == pytest.approx(1.0, abs=0.03)
    assert np.mean(np.abs(normal) < 1.96) == pytest.approx(0.95, abs=0.01)


@pytest.mark.parametrize("seed", range(8))
def test_intervals_from_estimated_noise_cover(make, sensor, seed):
    """The manifest is silent on noise: of all pixels 93 to 97 % lie within the 95 % interval of their
    radiance.

    Odd sets are 8-bit sRGB, even ones 16-bit linear; 2000 to 50000 electrons.
    """
    rng = np.random.default_rng(seed)
    patches = np.kron(10 ** rng.uniform(-2.5, -0.1, (12, 16)), np.ones((16, 16)))
    scene = patches[..., None] * rng.uniform(0.5, 1, 3)
    electrons, read = 10 ** rng.uniform(3.3, 4.7), rng.uniform(2, 15)
    photos = []
    for number in range(3):
        seen = sensor(scene, electrons=electrons, read=read, seed=100 * seed + number)
        photos.append((f"{number}.png", "sample", linear_to_srgb(seen) if seed % 2 else seen, {}))
    extra = '[radiometry]\nencoding = "srgb"' if seed % 2 else ""
    photoset, reader = make(photos, extra, full=255 if seed % 2 else 65535)
    assert reader.sensor.noise.source == "estimated"
    found = reader.read(photoset.views("sample")[0])
    normal = ((found.value - scene) / np.sqrt(found.variance))[found.valid]
    assert 0.93 < np.mean(np.abs(normal) < 1.96) < 0.97


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


def test_unknown_encoding_is_recovered(make, sensor):
    patches = np.kron(10 ** np.random.default_rng(4).uniform(-3, 0, (12, 16)), np.ones((10, 10)))
    scene = patches[..., None] * [1.0, 0.8, 0.6]
    photos = [
        (
            f"{k}.png",
            "sample",
            linear_to_gamma(sensor(scene * step, seed=k), 1.9),
            {"exposure_time": step, "bracket": 1},
        )
        for k, step in enumerate((1.0, 3.0, 14.0))
    ]
    photoset, reader = make(photos, '[radiometry]\nencoding = "unknown"', full=255)
    assert "response recovered" in reader.notes[0]
    found = reader.read(photoset.views("sample")[0])
    # each channel is on its own scale; patches' means of 100 pixels scatter by less than 1 %
    for c in range(3):
        means = (found.value / scene)[..., c].reshape(12, 10, 16, 10).mean(axis=(1, 3)).ravel()
        bright = patches[::10, ::10].ravel() > 0.01
        assert np.abs(means[bright] / np.median(means[bright]) - 1).max() < 0.02


def test_one_photo_of_another_size_is_named(make, light):
    photos = [
        ("a.png", "sample", light, {}),
        ("b.png", "sample", light, {}),
        ("c.png", "sample", light[:-1], {}),
    ]
    with pytest.raises(InputError, match=r"c\.png: is 80 x 59 pixels, the other photos are 80 x 60"):
        make(photos)


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


def test_only_unreadable_photos_are_refused_at_once(make, tmp_path):
    (tmp_path / "c.png").write_bytes(b"")
    with pytest.raises(InputError, match=r"c\.png: "):
        make([("c.png", "sample", None, {})])


@pytest.mark.parametrize(
    ("role", "extra", "said"),
    [("dark", "", "a dark frame"), ("flat", '[radiometry]\nvignetting = "flat"', "a flat field")],
)
def test_saturated_frames_are_refused(make, light, role, extra, said):
    with pytest.raises(InputError, match=rf"frame\.png: {said}"):
        make([("a.png", "sample", light, {}), ("frame.png", role, np.ones_like(light), {})], extra)


@pytest.mark.parametrize("role", ["dark", "ambient", "flat"])
def test_one_bad_frame_among_others_is_left_out_and_named(make, light, tmp_path, role):
    """What remains is used: the result is that of the good frame alone."""
    level = {"dark": 0.01, "ambient": 0.1, "flat": 0.6}[role]
    frames = [("a.png", "sample", light, {}), ("b.png", role, np.full_like(light, level), {})]
    extra = '[radiometry]\nvignetting = "flat"' if role == "flat" else ""
    photoset, reader = make(frames, extra)
    expected = value(photoset, reader)
    (tmp_path / "c.png").write_bytes((tmp_path / "b.png").read_bytes()[:200])
    photoset, reader = make([*frames, ("c.png", role, None, {})], extra)
    assert any("left out" in warning and "c.png: truncated" in warning for warning in reader.warnings)
    assert np.array_equal(value(photoset, reader), expected)


def test_useless_exposures_are_told(make, light):
    photoset, reader = make(
        [
            ("a.png", "sample", light, {}),
            ("b.png", "sample", np.ones_like(light), {}),
            ("c.png", "sample", np.zeros_like(light), {}),
        ],
        "[radiometry]\ngain_electrons = 20000\nread_noise_electrons = 5",
    )
    faults = [exposure_fault(reader.read(view)) for view in photoset.views("sample")]
    assert faults[0] is None and "saturated" in faults[1] and "black" in faults[2]


def test_a_raw_photo_is_linear_and_says_its_own_levels(shared, tmp_path, files):
    (tmp_path / "a.dng").write_bytes((shared / "data" / "raw" / "colorchart.dng").read_bytes())
    photos = [{"file": "a.dng", "role": "sample"}]
    photoset = load_photoset(files["manifest"](tmp_path, photos))
    reader = prepare(photoset)
    found = reader.read(photoset.views("sample")[0])
    image = reader.image(photoset.photos[0])
    assert np.allclose(found.value, image.pixels / (15000 - 2056), atol=1e-7) and not found.saturated.any()
    # levels of the manifest are fractions of the file's white level: the same two give the same signal
    levels = f"[radiometry]\nblack_level = {2056 / 15000}\nwhite_level = 1.0"
    again = load_photoset(files["manifest"](tmp_path, photos, levels))
    assert np.allclose(prepare(again).read(again.views("sample")[0]).value, found.value, atol=1e-6)
    with pytest.raises(InputError, match='a RAW photo is "linear"'):
        prepare(load_photoset(files["manifest"](tmp_path, photos, '[radiometry]\nencoding = "srgb"')))


def test_readers_travel_to_other_processes(make, light, sensor):
    photoset, reader = make([("a.png", "sample", sensor(light), {}), ("b.png", "dark", light * 0.01, {})])
    copy = pickle.loads(pickle.dumps(reader))
    view = photoset.views("sample")[0]
    assert np.array_equal(copy.read(view).value, reader.read(view).value)
    assert np.array_equal(prepare(photoset).read(view).variance, reader.read(view).variance)


def test_real_sets_are_read(shared):
    """The path-traced sets end at 65532, 14 bits shifted up; a quarter of the photos clip a good part."""
    photoset = load_photoset(shared / "data" / "traced-green-plane")
    reader = prepare(photoset)
    assert reader.sensor.clip == 65532
    found = reader.read(photoset.views("sample")[9])
    assert 0.02 < found.saturated.mean() < 0.2 and found.valid.mean() > 0.7


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


@pytest.mark.parametrize(
    ("entry", "key"),
    [
        (
            "[[white_patch]]\noutline = [[0, 0], [1, 0], [1, 1], [0, 1]]\nreflectance = {}\n",
            r"white_patch\[0\] reflectance",
        ),
        ('[[light]]\nid = "a"\nposition = [1, 2, 3]\nintensity = {}\n', r"light\[0\] intensity"),
    ],
)
@pytest.mark.parametrize(
    ("numbers", "right"),
    [
        ("[0.5]", True),
        ("0.5", True),
        ("[0.5, 0.5, 0.4]", True),
        ("[0.5, 0.4]", False),
        ("[0.5, 0.4, 0.4, 0.4]", False),
    ],
)
def test_numbers_a_channel_are_as_many_as_the_channels(tmp_path, files, entry, key, numbers, right):
    for name in ("a.png", "b.png"):
        files["png"](tmp_path / name, np.full((30, 40, 3), 1000, np.uint16))
    files["manifest"](
        tmp_path, [{"file": name, "role": "sample"} for name in ("a.png", "b.png")], entry.format(numbers)
    )
    if right:
        prepare(load_photoset(tmp_path))
        return
    with pytest.raises(InputError, match=rf"photoset\.toml: {key}: expected one number, or 3"):
        prepare(load_photoset(tmp_path))
