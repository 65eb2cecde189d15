"""The brightest float of a DNG, however it is compressed: LibRaw and the search for it must see the same."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.containers import float_tiles, tiff
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import read_image
from tests.capture.dng_files import cells, dng, mosaic


@pytest.mark.parametrize("kind", ["float16", "float32"])
@pytest.mark.parametrize("predictor", [3, 34894, 34895])
def test_floats_below_a_thumbnail_and_compressed(tmp_path, kind, predictor):
    """As converters write merged exposures; LibRaw and the search for the brightest must see the same."""
    written = mosaic(kind)
    written[5, 5] = 4.0
    written[7, 7] = -0.01
    path = dng(tmp_path / "a.dng", written, white=1, nested=True, predictor=predictor)
    with path.open("rb") as file:
        tags = list(tiff.with_children(file))[1]
    assert float_tiles.brightest(path, tags) == 4.0
    image = read_image(path)
    light = cells(np.minimum(written[..., 0], 1).astype(float))
    assert (
        np.abs(np.delete(image.pixels / image.full_scale - light, (2, 3), axis=0)).max() <= 4 * 1.01 / 16383
    )
    assert np.argwhere(image.saturated).tolist() == [[2, 2]]


def test_floats_deflated_without_a_predictor_are_refused(tmp_path):
    """LibRaw 0.22 undoes one that is not there."""
    path = dng(tmp_path / "a.dng", mosaic("float32"), white=1, predictor=1)
    with pytest.raises(InputError, match=r"a\.dng: .*without a predictor"):
        read_image(path)


def test_floats_that_only_libraw_reads_are_refused_at_the_white_level(tmp_path, monkeypatch):
    written = mosaic("float32")
    written[5, 5] = 4.0
    path = dng(tmp_path / "a.dng", written, white=1)
    monkeypatch.setattr(float_tiles, "TYPES", {})
    with pytest.raises(InputError, match=r"a\.dng: .*WhiteLevel"):
        read_image(path)
