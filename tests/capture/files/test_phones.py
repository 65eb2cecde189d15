"""Files of phones and browsers: HEIC, AVIF, JPEG XL, WebP, BMP, and JPEG with more in it than a picture."""

from __future__ import annotations

import struct
from pathlib import Path

import cv2
import numpy as np
import OpenImageIO as oiio
import pillow_heif
import pytest
from PIL import Image, features

from photogonio.capture.containers import exif, jxl
from photogonio.capture.containers.boxes import boxes
from photogonio.capture.containers.tone import SRGB, Curve
from photogonio.capture.errors import InputError
from photogonio.capture.files import about
from photogonio.capture.files.formats import format_of
from photogonio.capture.files.images import read_header, read_image
from tests.capture.odd_files import app2, exif_block, gamma_tag, icc_profile, jpeg

ADOBE = 563 / 256
HEIGHT, WIDTH = 48, 64


def smooth(kind: type = np.uint8) -> np.ndarray:
    """No side of it like another, no two channels alike, and nothing in it that compression minds."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] / WIDTH
    light = np.stack([0.2 + 0.6 * x, 0.2 + 0.6 * y, 0.7 - 0.3 * x - 0.2 * y], axis=-1)
    return np.round(light * np.iinfo(kind).max).astype(kind)


def heic(path: Path, pixels: np.ndarray, bits: int = 8, **more: object) -> Path:
    mode = "L" if pixels.shape[2] == 1 else "RGB"
    data = pixels if bits == 8 else pixels << (16 - bits)
    file = pillow_heif.from_bytes(mode + (";16" if bits > 8 else ""), pixels.shape[1::-1], data.tobytes())
    file.save(path, quality=100, chroma=444, **more)
    return path


def near(path: Path, written: np.ndarray, codes: float) -> bool:
    image, header = read_image(path), read_header(path)
    assert header.size == image.pixels.shape[1::-1] == written.shape[1::-1] and header.tone == image.tone
    assert image.channels == header.channels and image.pixels.dtype == written.dtype
    return bool(np.abs(image.pixels.astype(int) - written).max() <= codes)


def test_heic(tmp_path):
    assert near(heic(tmp_path / "a.heic", smooth(), exif=exif_block()), smooth(), 3)
    exposure = read_header(tmp_path / "a.heic").exposure
    assert (exposure.exposure_time, exposure.f_number, exposure.iso) == (1 / 64, 2.8, 100)
    assert read_header(tmp_path / "a.heic").tone.curves == (SRGB,)
    assert read_image(tmp_path / "a.heic").lossy


def test_heic_of_ten_bits_keeps_its_codes(tmp_path):
    codes = smooth(np.uint16) >> 6
    assert near(heic(tmp_path / "a.heic", codes, bits=10), codes, 4)
    assert read_image(tmp_path / "a.heic").full_scale == 1023


def test_heic_gray_and_its_profile(tmp_path):
    path = heic(
        tmp_path / "a.heic", smooth(), icc_profile=icc_profile(gamma_tag(ADOBE), name="Adobe RGB (1998)")
    )
    assert read_header(path).tone.curves == (Curve("gamma", (ADOBE,)),)
    assert near(heic(tmp_path / "b.heic", smooth()[..., :1]), smooth()[..., :1], 3)


def with_turns(data: bytes, *properties: bytes) -> bytes:
    """A HEIC file whose main picture has further properties (their boxes)."""
    added = b"".join(properties)
    ipco = data.index(b"ipco") - 4
    ipma = data.index(b"ipma") - 4
    (size,) = struct.unpack_from(">I", data, ipco)
    number = sum(1 for _ in boxes(data, ipco + 8, ipco + size))
    (ipma_size,) = struct.unpack_from(">I", data, ipma)
    assert struct.unpack_from(">II", data, ipma + 8) == (0, 1)  # one item
    body = bytearray(
        data[ipma : ipma + ipma_size] + bytes(0x80 | (number + 1 + k) for k in range(len(properties)))
    )
    body[18] += len(properties)
    struct.pack_into(">I", body, 0, len(body))
    grown = len(added) + len(properties)
    new = bytearray(data[: ipco + size] + added + data[ipco + size : ipma] + body + data[ipma + ipma_size :])
    struct.pack_into(">I", new, ipco, size + len(added))
    for name in (b"meta", b"iprp"):
        place = data.index(name) - 4
        struct.pack_into(">I", new, place, struct.unpack_from(">I", new, place)[0] + grown)
    iloc = data.index(b"iloc")
    offsets = [
        place for place in range(iloc, iloc + 60) if data[place : place + 4] == struct.pack(">I", media(data))
    ]
    assert offsets
    for place in offsets:
        struct.pack_into(">I", new, place, media(data) + grown)
    return bytes(new)


def media(data: bytes) -> int:
    return data.index(b"mdat") + 4


@pytest.mark.parametrize("quarters", range(4))
@pytest.mark.parametrize("mirror", [None, 0, 1])
def test_a_heic_that_a_viewer_turns_is_read_as_its_sensor_saw_it(tmp_path, quarters, mirror):
    path = heic(tmp_path / "a.heic", smooth())
    turns = [struct.pack(">I4sB", 9, b"irot", quarters)]
    turns += [] if mirror is None else [struct.pack(">I4sB", 9, b"imir", mirror)]
    path.write_bytes(with_turns(path.read_bytes(), *turns))
    shown = pillow_heif.open_heif(str(path))
    assert shown.size == (
        (WIDTH, HEIGHT) if quarters % 2 == 0 else (HEIGHT, WIDTH)
    )  # what viewers make of it
    assert near(path, smooth(), 3)


@pytest.mark.parametrize("bits", [8, 10, 12])
def test_avif(tmp_path, bits):
    codes = smooth() if bits == 8 else smooth(np.uint16) >> (16 - bits)
    settings = [cv2.IMWRITE_AVIF_DEPTH, bits, cv2.IMWRITE_AVIF_QUALITY, 100]
    assert cv2.imwrite(str(tmp_path / "a.avif"), codes[..., ::-1], settings)
    assert near(tmp_path / "a.avif", codes, 2 ** (bits - 8) * 3)
    assert read_image(tmp_path / "a.avif").full_scale == 2**bits - 1
    assert near_gray(tmp_path / "b.avif")


def near_gray(path: Path) -> bool:
    assert cv2.imwrite(str(path), smooth()[..., 0], [cv2.IMWRITE_AVIF_QUALITY, 100])
    return near(path, smooth()[..., :1], 3)


@pytest.mark.parametrize("kind", ["uint8", "uint16", "half", "float"])
def test_jpeg_xl(tmp_path, files, kind):
    whole = np.uint8 if kind == "uint8" else np.uint16
    written = smooth(whole)
    pixels = written if kind.startswith("uint") else (written / 65535).astype(np.float32)
    profile = icc_profile(gamma_tag(ADOBE), name="Adobe RGB (1998)")
    path = tmp_path / "a.jxl"
    with_profile(path, pixels, kind, profile, compression="jpegxl:100")
    image = read_image(path)
    tolerance = 3 * (1 if kind == "uint8" else 257) if kind.startswith("uint") else 3 / 255
    assert np.abs(image.pixels.astype(float) - pixels).max() <= tolerance
    assert image.tone.curves[0].numbers[0] == pytest.approx(ADOBE, abs=1e-4)


def with_profile(path: Path, pixels: np.ndarray, kind: str, profile: bytes, **more: object) -> None:
    spec = oiio.ImageSpec(WIDTH, HEIGHT, 3, kind)
    spec.attribute(
        "ICCProfile", oiio.TypeDesc(f"uint8[{len(profile)}]"), np.frombuffer(profile, np.uint8).copy()
    )
    for name, value in more.items():
        spec.attribute(name, value)
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec) and file.write_image(pixels), file.geterror()
    file.close()


def test_exif_of_jpeg_xl(tmp_path, files):
    path = tmp_path / "a.jxl"
    files["oiio"](path, smooth(), "uint8")
    block = bytes(4) + exif_block().removeprefix(b"Exif\0\0")
    path.write_bytes(path.read_bytes() + struct.pack(">I4s", 8 + len(block), b"Exif") + block)
    assert read_header(path).exposure.exposure_time == 1 / 64


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ([(1, 1), (5, 5), (3, 1), (1, 1)], 1),  # small, ratio 1 : 1, all as usual
        ([(1, 0), (13 + 2, 1 | 47 << 2), (3, 0), (9 + 2, 0 | 63 << 2), (1, 0), (1, 1), (3, 5)], 6),
        ([(1, 1), (5, 5), (3, 0), (5, 7), (1, 0), (1, 1), (3, 2)], 3),
        ([(1, 1), (5, 5), (3, 1), (1, 0), (1, 0)], 1),
    ],
)
def test_the_orientation_in_a_codestream(fields, expected):
    """Fields are packed from the lowest bit up (ISO/IEC 18181-1, sections 9 and D)."""
    value, place = 0, 0
    for width, field in fields:
        value |= field << place
        place += width
    assert jxl.orientation(b"\xff\x0a" + value.to_bytes(16, "little")) == expected


def test_what_decoders_make_of_an_orientation_is_undone():
    """EXIF 2.32, section 4.6.4.A: what a viewer shows of stored pixels, by where row 0 and column 0 are."""
    stored = np.arange(6).reshape(2, 3)
    shown = {
        1: stored, 2: stored[:, ::-1], 3: stored[::-1, ::-1], 4: stored[::-1],
        5: stored.T, 6: stored.T[:, ::-1], 7: stored[::-1, ::-1].T, 8: stored.T[::-1],
    }  # fmt: skip
    for orientation, pixels in shown.items():
        found = about.About((3, 2), ("Y",), 8, None, turned=orientation).as_stored(pixels)
        assert np.array_equal(found, stored), orientation


@pytest.mark.parametrize(("name", "codes"), [("a.webp", 0), ("lossy.webp", 12), ("a.bmp", 0)])
def test_webp_and_bmp(tmp_path, name, codes):
    picture = Image.fromarray(smooth())
    options = {} if name == "a.bmp" else {"exif": exif_block(6), "lossless": codes == 0, "quality": 98}
    picture.save(tmp_path / name, **options)
    assert near(tmp_path / name, smooth(), codes)
    if options:
        assert read_header(tmp_path / name).exposure.iso == 100


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("name", ["a.jpg", "a.png", "a.webp", "a.avif"])
def test_orientation_leaves_pixels_alone_in_every_format(tmp_path, orientation, name):
    if name == "a.avif":
        if not features.check("avif"):
            pytest.skip("this Pillow writes no AVIF that viewers turn")
    Image.fromarray(smooth()).save(tmp_path / name, exif=exif_block(orientation), quality=98)
    image = read_image(tmp_path / name)
    assert image.pixels.shape == smooth().shape and read_header(tmp_path / name).size == (WIDTH, HEIGHT)
    assert np.abs(image.pixels.astype(int) - smooth()).max() <= 12


@pytest.mark.parametrize("mark", [b"http://ns.adobe.com/hdr-gain-map/1.0/", b"urn:iso:std:iso:ts:21496:-1\0"])
def test_the_base_picture_of_an_ultra_hdr_jpeg_is_read_and_said(tmp_path, mark):
    """The gain map is a second JPEG behind the first (Ultra HDR image format, version 1)."""
    gain = jpeg(tmp_path / "gain.jpg", smooth()[::4, ::4]).read_bytes()
    xmp = b"http://ns.adobe.com/xap/1.0/\0<x xmlns:hdrgm='" + mark + b"' hdrgm:Version='1.0'/>"
    path = jpeg(tmp_path / "a.jpg", smooth(), (0xE1, xmp), app2(icc_profile(gamma_tag(1.8))))
    path.write_bytes(path.read_bytes() + gain)
    header = read_header(path)
    assert near(path, smooth(), 5) and "gain map" in header.notes[0]
    assert header.tone.curves[0].kind == "gamma"


def test_cmyk_jpeg_is_refused(tmp_path):
    Image.fromarray(smooth()).convert("CMYK").save(tmp_path / "a.jpg")
    for read in (read_header, read_image):
        with pytest.raises(InputError, match=r"a\.jpg: holds CMYK"):
            read(tmp_path / "a.jpg")


def test_the_content_counts_and_not_the_name(tmp_path):
    Image.fromarray(smooth()).save(tmp_path / "a.png")
    (tmp_path / "a.png").rename(tmp_path / "a.exr")
    assert near(tmp_path / "a.exr", smooth(), 0)
    for content in (b"GIF89a" + bytes(40), b"P6 2 2 255\n" + bytes(12), b"8BPS" + bytes(30), b"#?RADIANCE\n"):
        for name in ("b.png", "b.tif", "b.exr", "b.dng", "b.heic"):
            (tmp_path / name).write_bytes(content)
            with pytest.raises(InputError, match="its content is not PNG"):
                read_image(tmp_path / name)


def write_all(folder: Path) -> list[Path]:
    heic(folder / "a.heic", smooth(), exif=exif_block())
    cv2.imwrite(str(folder / "a.avif"), smooth()[..., ::-1])
    spec = oiio.ImageSpec(WIDTH, HEIGHT, 3, "uint8")
    file = oiio.ImageOutput.create(str(folder / "a.jxl"))
    file.open(str(folder / "a.jxl"), spec)
    file.write_image(smooth())
    file.close()
    Image.fromarray(smooth()).save(folder / "a.webp", lossless=True)
    Image.fromarray(smooth()).save(folder / "a.bmp")
    return [folder / f"a.{suffix}" for suffix in ("heic", "avif", "jxl", "webp", "bmp")]


def test_truncated_files_are_refused(tmp_path, capfd):
    for path in write_all(tmp_path):
        whole = path.read_bytes()
        assert format_of(path) and near(path, smooth(), 24)
        for share in np.linspace(0.0, 0.98, 15):
            path.write_bytes(whole[: int(share * len(whole))])
            with pytest.raises(InputError) as caught:
                read_image(path)
            assert str(path) in str(caught.value) and "\n" not in str(caught.value)
    assert capfd.readouterr().err == ""


def test_exif_that_is_damaged_counts_as_absent():
    whole = exif_block()
    assert exif.attributes(whole)["ExposureTime"] == 1 / 64
    for length in range(len(whole)):
        exif.attributes(whole[:length])
    for k in range(6, len(whole)):
        exif.attributes(whole[:k] + bytes([whole[k] ^ 0xFF]) + whole[k + 1 :])


def test_a_heic_without_a_picture_is_refused(tmp_path):
    """Every byte of its directory is spoilt in turn: whatever follows, it is one line or a picture."""
    path = heic(tmp_path / "a.heic", smooth())
    whole = path.read_bytes()
    for k in range(24, min(len(whole), 480), 3):
        path.write_bytes(whole[:k] + b"\xff\xff" + whole[k + 2 :])
        for read in (read_header, read_image):
            try:
                read(path)
            except InputError as error:
                assert "\n" not in str(error)
