"""What the marker segments of a JPEG say."""

from __future__ import annotations

import io

import pytest
from PIL import Image

from photogonio.capture.containers.jpeg import about, segments
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import read_header, read_image
from tests.capture.odd_files import app2, exif_block, gamma_tag, icc_profile, jpeg
from tests.capture.phone_files import near, smooth


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


def test_a_header_says_size_and_components(tmp_path):
    codes = smooth()
    told = about(jpeg(tmp_path / "a.jpg", codes, (0xE1, exif_block()), (0xE1, b"later")))
    assert told.size == (codes.shape[1], codes.shape[0]) and told.components == 3 and not told.gain_map
    assert told.exif == exif_block()


def test_segments_end_at_the_scan_and_padding_is_passed():
    """ITU T.81, B.1.1.2: any marker may be preceded by fill bytes 0xFF."""
    data = (
        b"\xff\xd8"
        + b"\xff\xff\xff\xe1\x00\x04ab"
        + b"\xff\xd0"
        + b"\xff\xe2\x00\x02"
        + b"\xff\xda\x00\x02\xff\xe3\x00\x04xx"
    )
    assert list(segments(io.BytesIO(data))) == [(0xE1, b"ab"), (0xE2, b"")]


@pytest.mark.parametrize("length", [2, 5, 20])
def test_a_jpeg_without_a_frame_is_told(tmp_path, length):
    path = jpeg(tmp_path / "a.jpg", smooth())
    path.write_bytes(path.read_bytes()[:length])
    with pytest.raises(ValueError, match="it has no frame"):
        about(path)
