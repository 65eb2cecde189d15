"""Decoding of PNG files against OpenCV's, one core: each filter and their mixture, 8 and 16 bits, 1 to 4 channels.

    python -m benchmarks.png [--quick]

Both sides take turns, and the faster of their runs counts; the pixels are the same. Times are of the processor.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from functools import partial

import cv2
import numpy as np

from photogonio.capture.files import png_pixels
from tests.drawn.png_files import written

FILTERS = {"none": [0], "sub": [1], "up": [2], "average": [3], "Paeth": [4], "mixed": [0, 1, 2, 3, 4]}


def photo(height: int, width: int, channels: int, bits: int) -> np.ndarray:
    """A lit ball with noise, (h, w, c)."""
    y, x = np.mgrid[-1 : 1 : height * 1j, -1.5 : 1.5 : width * 1j]
    light = 8000 + 20000 * np.exp(-4 * (x**2 + y**2))
    colours = light[..., None] * np.array([1.0, 0.8, 0.6, 0.9])[:channels]
    codes = np.clip(colours + np.random.default_rng(0).normal(0, 60, colours.shape), 0, 65535)
    return codes.astype(np.uint16) if bits == 16 else (codes / 256).astype(np.uint8)


def seconds(task: Callable[[], object]) -> float:
    start = time.process_time()
    task()
    return time.process_time() - start


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a small picture, once: shows that it runs")
    quick = parser.parse_args(arguments).quick
    size, runs = ((40, 60), 1) if quick else ((1200, 1800), 9)
    cv2.setNumThreads(1)
    print(f"bits channels {' '.join(f'{name:>8}' for name in FILTERS)}   times as fast as OpenCV")
    for bits in (8, 16):
        for channels in (1, 2, 3, 4):
            pixels, faster = photo(*size, channels, bits), []
            mode = cv2.IMREAD_COLOR_RGB | cv2.IMREAD_ANYDEPTH if channels == 3 else cv2.IMREAD_UNCHANGED
            for filters in FILTERS.values():
                data = written(pixels, filters)
                coded = np.frombuffer(data, np.uint8)
                if not np.array_equal(png_pixels.decoded(data), pixels):
                    raise RuntimeError(f"other pixels: {bits} bits, {channels} channels, filters {filters}")
                sides = (partial(png_pixels.decoded, data), partial(cv2.imdecode, coded, mode))
                times = [[seconds(side) for side in sides] for _ in range(runs)]
                ours, theirs = np.array(times).min(0)
                faster.append(theirs / max(ours, 1e-9))
            print(f"{bits:4} {channels:8} {' '.join(f'{one:8.2f}' for one in faster)}", flush=True)


if __name__ == "__main__":
    main()
