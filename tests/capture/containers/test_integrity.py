"""A PNG or JPEG that is not whole is seen, one that has more behind it is whole."""

from __future__ import annotations

import re

import cv2
import numpy as np
import pytest

from photogonio.capture.containers.integrity import fault
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import read_image

SHAPE = (24, 31)


def codes(channels: int, kind: type) -> np.ndarray:
    return (
        np.random.default_rng(channels).integers(0, np.iinfo(kind).max + 1, (*SHAPE, channels)).astype(kind)
    )


def test_every_truncation_of_a_jpeg_and_a_png_is_seen(tmp_path, files):
    for name in ("a.png", "a.jpg"):
        path = tmp_path / name
        files["png"](path, codes(3, np.uint8)[:9, :9])
        whole = path.read_bytes()
        read_image(path)
        for length in range(0, len(whole), 7):
            path.write_bytes(whole[:length])
            with pytest.raises(InputError):
                read_image(path)


def test_a_flipped_bit_of_a_png_is_seen(tmp_path, files):
    path = tmp_path / "a.png"
    files["png"](path, codes(3, np.uint8))
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    with pytest.raises(InputError, match="checksum"):
        read_image(path)


def test_progressive_jpeg_and_trailing_bytes_are_whole(tmp_path):
    picture = codes(3, np.uint8)
    for flags in ([], [cv2.IMWRITE_JPEG_PROGRESSIVE, 1, cv2.IMWRITE_JPEG_RST_INTERVAL, 2]):
        cv2.imwrite(str(tmp_path / "a.jpg"), picture, flags)
        data = (tmp_path / "a.jpg").read_bytes()
        (tmp_path / "a.jpg").write_bytes(data + b"\0\xff\xd8 a second picture")
        assert read_image(tmp_path / "a.jpg").pixels.shape == picture.shape


def of_scan(kind: str, data: bytes) -> bytes:
    """A JPEG of one scan, or of several, damaged in its middle but with all markers up to the last."""
    start = data.index(b"\xff\xda")
    start += 2 + int.from_bytes(data[start + 2 : start + 4], "big")
    middle = (start + len(data)) // 2
    if kind == "cut":
        return data[:middle] + b"\xff\xd9"
    if kind == "zeros":
        return data[:middle] + bytes(400) + data[middle + 400 :]
    marks = [found.start() for found in re.finditer(rb"\xff[\xd0-\xd7]", data) if found.start() > start]
    if kind == "no restarts":
        return data[:start] + re.sub(rb"\xff[\xd0-\xd7]", b"", data[start:])
    first, last = marks[len(marks) // 2], marks[len(marks) // 2 + {"one restart": 0, "intervals": 3}[kind]]
    return data[:first] + data[last + 2 * (kind == "one restart") :]


@pytest.mark.parametrize("flags", [[], [cv2.IMWRITE_JPEG_PROGRESSIVE, 1], [cv2.IMWRITE_JPEG_RST_INTERVAL, 5]])
@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("kind", ["cut", "zeros", "no restarts", "one restart", "intervals"])
def test_damage_inside_a_jpegs_scan_is_refused(tmp_path, flags, channels, kind):
    """Where the markers stand and the data between them are not what they say: a decoder fills the rest with gray."""
    if kind != "cut":  # of one scan without restarts, later codes may come out at its end by chance
        flags = [*flags, cv2.IMWRITE_JPEG_RST_INTERVAL, 5]
    picture = np.random.default_rng(3).integers(60, 190, (240, 320, channels)).astype(np.uint8)
    data = bytes(cv2.imencode(".jpg", picture, flags)[1])
    path = tmp_path / "a.jpg"
    path.write_bytes(data)
    assert read_image(path).pixels.shape == picture.shape
    path.write_bytes(of_scan(kind, data))
    assert fault(path.read_bytes()) is None
    with pytest.raises(InputError, match="truncated or damaged: JPEG error"):
        read_image(path)


@pytest.mark.parametrize("name", ["a.png", "a.jpg"])
def test_whole_files_have_no_fault_and_cut_ones_name_their_kind(tmp_path, files, name):
    files["png"](tmp_path / name, codes(3, np.uint8)[:9, :9])
    whole = (tmp_path / name).read_bytes()
    assert fault(whole) is None and fault(whole + b"more") is None
    for length in range(8, len(whole) - 1, 11):
        kind = "PNG" if name == "a.png" else "JPEG"
        assert kind in fault(whole[:length])
    assert fault(b"") == "empty file" and fault(b"BM of another kind") is None
