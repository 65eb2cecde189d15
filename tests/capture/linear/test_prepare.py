"""A first look at a set: noise, clipping and encoding found, sets that cannot be used refused by name."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.capture.linear.encoding import linear_to_gamma, linear_to_srgb
from photogonio.capture.linear.prepare import prepare
from photogonio.capture.manifest.load import load_photoset


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


def test_only_unreadable_photos_are_refused_at_once(make, tmp_path):
    (tmp_path / "c.png").write_bytes(b"")
    with pytest.raises(InputError, match=r"c\.png: "):
        make([("c.png", "sample", None, {})])


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


def test_real_sets_are_read(shared):
    """The path-traced sets end at 65532, 14 bits shifted up; a quarter of the photos clip a good part."""
    photoset = load_photoset(shared / "data" / "traced-green-plane")
    reader = prepare(photoset)
    assert reader.sensor.clip == 65532
    found = reader.read(photoset.views("sample")[9])
    assert 0.02 < found.saturated.mean() < 0.2 and found.valid.mean() > 0.7


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
