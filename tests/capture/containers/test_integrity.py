"""A PNG or JPEG that is not whole is seen, one that has more behind it is whole."""

from __future__ import annotations

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


@pytest.mark.parametrize("name", ["a.png", "a.jpg"])
def test_whole_files_have_no_fault_and_cut_ones_name_their_kind(tmp_path, files, name):
    files["png"](tmp_path / name, codes(3, np.uint8)[:9, :9])
    whole = (tmp_path / name).read_bytes()
    assert fault(whole) is None and fault(whole + b"more") is None
    for length in range(8, len(whole) - 1, 11):
        kind = "PNG" if name == "a.png" else "JPEG"
        assert kind in fault(whole[:length])
    assert fault(b"") == "empty file" and fault(b"BM of another kind") is None
