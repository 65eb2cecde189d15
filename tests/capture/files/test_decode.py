"""Decoders: what they cannot read in full is refused in one line."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

from photogonio.capture.errors import InputError
from photogonio.capture.files import decode
from photogonio.capture.files.formats import format_of
from photogonio.capture.files.images import read_image
from tests.capture.dng_files import HEIGHT, WIDTH
from tests.capture.odd_files import exif_block
from tests.capture.phone_files import heic, near, smooth


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


def test_channels_are_given_in_the_order_asked_for(tmp_path, files):
    written = np.random.default_rng(0).integers(0, 65536, (5, 6, 6)).astype(np.uint16)
    path = tmp_path / "a.tif"
    files["oiio"](path, written, "uint16")
    for kept in ((), (0, 1, 2), (4, 0, 2), (5,)):
        with decode.open_oiio(path) as file:
            found = decode.decode_oiio(path, file, 0, kept)
        assert np.array_equal(found, written[..., list(kept or range(6))])


def test_both_decoders_see_the_same_picture(tmp_path, files):
    for channels in (1, 3):
        written = np.random.default_rng(1).integers(0, 65536, (5, 6, channels)).astype(np.uint16)
        files["png"](tmp_path / "a.png", written)
        with decode.open_oiio(tmp_path / "a.png") as file:
            one = decode.decode_oiio(tmp_path / "a.png", file)
        other = decode.decode_opencv((tmp_path / "a.png").read_bytes(), channels)
        assert np.array_equal(one, written) and np.array_equal(other, written)


def test_what_is_no_picture_is_none_or_named(tmp_path, capfd):
    (tmp_path / "a.tif").write_bytes(b"II*\0 and no more")
    assert decode.decode_opencv(b"nothing", 3) is None and decode.load_opencv(tmp_path / "a.tif") is None
    with (
        pytest.raises(InputError, match=r"a\.tif: not a readable image"),
        decode.open_oiio(tmp_path / "a.tif"),
    ):
        pass
    with (
        pytest.raises(InputError, match=r"no\.exr: not a readable image"),
        decode.open_oiio(tmp_path / "no.exr"),
    ):
        pass
    assert capfd.readouterr().err == ""
