"""Codes are undone by the curve that their file names, unless the manifest says otherwise; contradictions are named."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.capture.linear.prepare import prepare
from photogonio.capture.manifest.load import load_photoset
from tests.capture.odd_files import (
    SRGB_TAG,
    app2,
    exif_block,
    gama,
    gamma_tag,
    icc_profile,
    iccp,
    jpeg,
    parametric_tag,
    png,
)

LIGHT = np.linspace(0.1, 0.9, 64 * 48 * 3).reshape(48, 64, 3)
ADOBE = 563 / 256


def srgb_code(light: np.ndarray) -> np.ndarray:
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def wide(code: np.ndarray) -> np.ndarray:
    return np.round(code * 65535).astype(np.uint16)


def narrow(code: np.ndarray) -> np.ndarray:
    return np.round(code * 255).astype(np.uint8)


def read(folder, files, *, radiometry: str = "", names=("a.png", "b.png")):
    files["manifest"](folder, [{"file": name, "role": "sample"} for name in names], radiometry)
    photoset = load_photoset(folder)
    reader = prepare(photoset)
    return reader, [reader.read(view).value for view in photoset.views("sample")]


CHUNKS = {
    "srgb": (srgb_code, (b"sRGB", b"\0")),
    "gama": (lambda x: x ** (1 / 1.8), gama(1.8)),
    "adobe": (lambda x: x ** (1 / ADOBE), iccp(icc_profile(gamma_tag(ADOBE)))),
    "prophoto": (lambda x: x ** (1 / 1.8), iccp(icc_profile(parametric_tag(3, 1.8, 1, 0, 1 / 16, 0.031248)))),
    "p3": (srgb_code, iccp(icc_profile(SRGB_TAG, name="Display P3"))),
    "linear": (lambda x: x, (b"cICP", bytes([1, 8, 0, 1]))),
}


@pytest.mark.parametrize("name", CHUNKS)
@pytest.mark.parametrize("radiometry", ["", '[radiometry]\nencoding = "auto"\n'])
def test_the_files_curve_undoes_its_codes(tmp_path, files, name, radiometry):
    """Codes of 16 bits: steps of 1.5e-5, numbers of the profiles rounded to 1.5e-5."""
    encode, chunk = CHUNKS[name]
    for file in ("a.png", "b.png"):
        png(tmp_path / file, wide(encode(LIGHT)), chunk)
    reader, values = read(tmp_path, files, radiometry=radiometry)
    assert np.abs(values[0] - LIGHT).max() < 2e-4
    assert not any("encoding" in line for line in reader.warnings)
    assert any(line.startswith("tone curve ") for line in reader.notes)


def test_a_jpegs_profile_undoes_its_codes(tmp_path, files):
    for file in ("a.jpg", "b.jpg"):
        jpeg(tmp_path / file, narrow(LIGHT ** (1 / ADOBE)), app2(icc_profile(gamma_tag(ADOBE))))
    _, values = read(tmp_path, files, names=("a.jpg", "b.jpg"))
    # steps of 8 bits and the rounding of the colour transform: two codes, times the curve's slope of at most 2.2
    assert np.abs(values[0] - LIGHT).max() < 2 / 255 * 2.2


def test_each_photo_has_its_own_curve(tmp_path, files):
    png(tmp_path / "a.png", wide(srgb_code(LIGHT)), (b"sRGB", b"\0"))
    png(tmp_path / "b.png", wide(LIGHT ** (1 / 1.8)), gama(1.8))
    reader, values = read(tmp_path, files)
    assert all(np.abs(value - LIGHT).max() < 2e-4 for value in values)
    level, _ = reader.read_level(reader.photoset.views("sample")[1])
    assert np.abs(level - LIGHT.mean(axis=2)).max() < 2e-4


@pytest.mark.parametrize(("bits", "encode"), [(narrow, srgb_code), (wide, lambda x: x)])
def test_without_a_word_8_bits_are_srgb_and_16_linear(tmp_path, files, bits, encode):
    for file in ("a.png", "b.png"):
        png(tmp_path / file, bits(encode(LIGHT)))
    reader, values = read(tmp_path, files)
    assert np.abs(values[0] - LIGHT).max() < 1.2 / 255
    assert sum("name no tone curve" in line for line in reader.warnings) == (bits is narrow)


@pytest.mark.parametrize(
    ("radiometry", "undone"),
    [
        ('encoding = "linear"', lambda code: code),
        ('encoding = "srgb"', lambda code: ((code + 0.055) / 1.055) ** 2.4),
        ('encoding = "gamma"\ngamma = 2.5', lambda code: code**2.5),
    ],
)
def test_the_manifest_is_obeyed_and_the_contradiction_named(tmp_path, files, radiometry, undone):
    code = wide(LIGHT ** (1 / ADOBE))
    for file in ("a.png", "b.png"):
        png(tmp_path / file, code, iccp(icc_profile(gamma_tag(ADOBE), name="Adobe RGB (1998)")))
    reader, values = read(tmp_path, files, radiometry=f"[radiometry]\n{radiometry}\n")
    assert np.abs(values[0] - undone(code / 65535)).max() < 1e-5
    (line,) = [line for line in reader.warnings if "encoding" in line]
    assert "a.png, b.png" in line and "Adobe RGB (1998)" in line and radiometry.split("\n")[0] in line


def test_a_manifest_that_says_the_same_is_not_warned_of(tmp_path, files):
    for file in ("a.png", "b.png"):
        png(tmp_path / file, wide(srgb_code(LIGHT)), iccp(icc_profile(SRGB_TAG)))
    reader, _ = read(tmp_path, files, radiometry='[radiometry]\nencoding = "srgb"\n')
    assert not any("encoding" in line for line in reader.warnings)
    for file in ("a.png", "b.png"):
        png(tmp_path / file, wide(LIGHT))
    reader, _ = read(tmp_path, files, radiometry='[radiometry]\nencoding = "linear"\n')
    assert not any("encoding" in line for line in reader.warnings)


def test_levels_hold_with_a_files_own_curve(tmp_path, files):
    """Black and white are codes: the curve's light at them is 0 and 1."""
    for file in ("a.png", "b.png"):
        png(tmp_path / file, wide(LIGHT ** (1 / 1.8)), gama(1.8))
    levels = "[radiometry]\nblack_level = 0.1\nwhite_level = 0.97\n"
    _, values = read(tmp_path, files, radiometry=levels)
    black, white = 0.1**1.8, 0.97**1.8
    assert np.abs(values[0] - (LIGHT - black) / (white - black)).max() < 2e-4


def test_a_mirrored_picture_is_told(tmp_path, files):
    for file in ("a.tif", "b.tif"):
        files["oiio"](tmp_path / file, wide(LIGHT), "uint16", Orientation=2)
    reader, values = read(tmp_path, files, names=("a.tif", "b.tif"))
    assert np.abs(values[0] - LIGHT).max() < 2e-5
    assert any("mirrored" in line and "a.tif" in line for line in reader.warnings)


def test_an_unknown_word_is_refused(tmp_path, files):
    with pytest.raises(InputError, match="auto"):
        read(tmp_path, files, radiometry='[radiometry]\nencoding = "adobe"\n')


def test_photos_of_fewer_bits_are_full_at_their_own_top(tmp_path, files):
    """Sample photos of 16 bits beside a calibration photo of 8: neither clips at the other's code."""
    bright = np.where(np.arange(64)[:, None] < 5, 1.0, LIGHT)
    for file in ("a.png", "b.png"):
        png(tmp_path / file, wide(bright))
    png(tmp_path / "c.png", narrow(srgb_code(bright)))
    photos = [
        {"file": f, "role": "sample" if f != "c.png" else "calibration"} for f in ("a.png", "b.png", "c.png")
    ]
    files["manifest"](tmp_path, photos)
    photoset = load_photoset(tmp_path)
    reader = prepare(photoset)
    for role in ("sample", "calibration"):
        view = photoset.views(role)[0]
        assert np.array_equal(reader.read(view).saturated, np.broadcast_to(np.arange(64) < 5, (48, 64))), role
        level, usable = reader.read_level(view)
        assert np.array_equal(usable, np.broadcast_to(np.arange(64) >= 5, (48, 64))), role
        assert np.abs(level - bright.mean(axis=2))[usable].max() < 1.2 / 255


PATCH = "[[white_patch]]\noutline = [[0, 0], [1, 0], [1, 1], [0, 1]]\nreflectance = 0.9\n"


@pytest.mark.parametrize("patch", ["", PATCH])
@pytest.mark.parametrize(
    "names", [((1, 60), (1, 30), (1, 15), (1, 125)), ((1, 50), (1, 25), (1, 60), (1, 125))]
)
def test_shutter_times_are_steps_and_not_their_names(tmp_path, files, names, patch):
    """A still scene by a camera of thirds: 1/60 s is 1/64, 1/15 1/16, 1/125 1/128, 1/50 2^(-17/3), 1/25 2^(-14/3)."""
    true = {60: 64, 30: 32, 15: 16, 125: 128, 50: 2 ** (17 / 3), 25: 2 ** (14 / 3)}
    for k, name in enumerate(names):
        light = LIGHT * 15 / true[name[1]]
        jpeg(tmp_path / f"{k}.jpg", narrow(srgb_code(light)), (0xE1, exif_block(time=name)))
    reader, values = read(tmp_path, files, radiometry=patch, names=[f"{k}.jpg" for k in range(4)])
    middles = [float(np.median(value)) for value in values]
    assert max(middles) / min(middles) - 1 < 0.01  # codes of 8 bits; the names are 4 to 6.5 % apart
    told = any("true steps" in line for line in reader.warnings)
    assert told == (patch == "") and told != any("true steps" in note for note in reader.notes)


def test_times_of_a_phone_are_as_they_stand(tmp_path, files):
    for k, time in enumerate(((1, 60), (1, 121), (1, 33))):
        jpeg(tmp_path / f"{k}.jpg", narrow(srgb_code(LIGHT * 30 / time[1])), (0xE1, exif_block(time=time)))
    reader, values = read(tmp_path, files, names=[f"{k}.jpg" for k in range(3)])
    middles = [float(np.median(value)) for value in values]
    assert max(middles) / min(middles) - 1 < 0.01
    assert not any("true steps" in line for line in (*reader.warnings, *reader.notes))
