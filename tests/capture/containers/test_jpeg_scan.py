"""Codes of a JPEG's scan are counted: of whole files they come out even, of damaged ones they do not."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from photogonio.capture.containers.jpeg_scan import scan_fault, scan_of, tables_of

SAMPLINGS = [0x111111, 0x211111, 0x121111, 0x221111, 0x411111]  # of OpenCV's flag


def picture(size: tuple[int, int], channels: int = 3) -> np.ndarray:
    rng = np.random.default_rng(2)
    y, x = np.mgrid[: size[0], : size[1]]
    smooth = 128 + 50 * np.sin(x / 17)[..., None] * np.cos(y / 11)[..., None] * np.ones(channels)
    return (smooth + rng.normal(0, 6, smooth.shape)).clip(0, 255).astype(np.uint8)


def jpeg(pixels: np.ndarray, *flags: int) -> bytes:
    return bytes(cv2.imencode(".jpg", pixels, list(flags))[1])


@pytest.mark.parametrize("sampling", SAMPLINGS)
@pytest.mark.parametrize("restarts", [0, 3])
@pytest.mark.parametrize("optimized", [0, 1])
@pytest.mark.parametrize("size", [(8, 8), (67, 91), (240, 320)])
def test_whole_files_come_out_even(sampling, restarts, optimized, size):
    flags = (cv2.IMWRITE_JPEG_RST_INTERVAL, restarts, cv2.IMWRITE_JPEG_OPTIMIZE, optimized)
    for quality in (5, 75, 100):
        data = jpeg(
            picture(size),
            cv2.IMWRITE_JPEG_SAMPLING_FACTOR,
            sampling,
            *flags,
            cv2.IMWRITE_JPEG_QUALITY,
            quality,
        )
        assert scan_of(data) is not None and scan_fault(data) == ""
        assert scan_fault(data[:-2] + bytes(5) + data[-2:] + b"\xff\xd8 another") == ""  # that only fill
    assert scan_fault(jpeg(picture(size, 1), *flags)) == ""


@pytest.mark.parametrize("restarts", [0, 10])
@pytest.mark.parametrize("channels", [1, 3])
def test_damaged_codes_do_not(restarts, channels):
    """By chance a code may stand for one of the same length: of random bytes in place of many codes, hardly ever."""
    data = jpeg(picture((240, 320), channels), cv2.IMWRITE_JPEG_RST_INTERVAL, restarts)
    scan = scan_of(data)
    rng = np.random.default_rng(4)
    told = []
    for _ in range(40):
        place, count = int(rng.integers(scan.start, len(data) - 400)), int(rng.integers(100, 300))
        other = bytes(rng.integers(0, 255, count).astype(np.uint8))  # 255 would be a marker
        told.append(scan_fault(data[:place] + other + data[place + count :]))
        told.append(scan_fault(data[:place] + data[place + count :]))
    assert np.mean([bool(words) for words in told]) >= 0.9
    assert all(words.startswith("damaged JPEG: ") for words in told if words)


def test_a_scan_that_ends_early_and_one_whose_restarts_are_lost():
    data = jpeg(picture((240, 320)), cv2.IMWRITE_JPEG_RST_INTERVAL, 5)
    scan = scan_of(data)
    assert "early" in scan_fault(data[: (scan.start + len(data)) // 2].rstrip(b"\xff") + b"\xff\xd9")
    first = data.index(b"\xff\xd0", scan.start)
    assert "left over" in scan_fault(data[:first] + data[first + 2 :])
    assert "restart" in scan_fault(data[:first] + b"\xff\xd3" + data[first + 2 :])


def test_of_other_kinds_nothing_is_said():
    assert scan_of(jpeg(picture((64, 64)), cv2.IMWRITE_JPEG_PROGRESSIVE, 1)) is None
    whole = jpeg(picture((64, 64)))
    for length in range(2, len(whole), 5):
        assert isinstance(scan_fault(whole[:length]), str)


def test_a_table_has_each_code_at_all_that_begins_with_it():
    """Two codes of one bit and two: 0 for 7, 10 for 9."""
    (table,) = tables_of(bytes([0x11, 1, 1, *[0] * 14, 7, 9])).values()
    assert (table[: 1 << 15] == (1 << 8 | 7)).all()
    assert (table[1 << 15 : 3 << 14] == (2 << 8 | 9)).all() and not table[3 << 14 :].any()
