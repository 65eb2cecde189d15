"""The width of edges is that of the blur."""

import cv2
import numpy as np
import pytest

from photogonio.calib.identify.sharpness import placed_quads, sharpness

OF_NORMAL = 2.563  # standard deviations from a tenth to nine tenths of a blurred step
PIXEL = 1 / np.sqrt(12)  # standard deviation of a pixel's own width


def squares():
    """Black squares (h, w) on white and their corners (m, 4, 2)."""
    level, quads = np.full((300, 300), 0.8, np.float32), []
    for x in range(40, 240, 100):
        for y in range(40, 240, 100):
            level[y : y + 70, x : x + 70] = 0.05
            low, high = (x - 0.5, y - 0.5), (x + 69.5, y + 69.5)
            quads.append([low, (high[0], low[1]), high, (low[0], high[1])])
    return level, np.array(quads)


@pytest.mark.parametrize("blur", [1.0, 1.5, 2.5])
def test_an_edge_is_as_wide_as_its_blur(blur):
    level, quads = squares()
    found = sharpness(cv2.GaussianBlur(level, (0, 0), blur), quads)
    assert found.width == pytest.approx(OF_NORMAL * np.hypot(blur, PIXEL), rel=0.06)
    assert not found.smeared


def test_a_camera_that_moves_smears_one_way():
    level, quads = squares()
    found = sharpness(cv2.blur(cv2.GaussianBlur(level, (0, 0), 0.6), (9, 1)), quads)
    assert found.smeared and found.across > 3 * found.down


def test_without_edges_nothing_is_said():
    level, quads = squares()
    assert sharpness(np.full_like(level, 0.5), quads) is None
    assert sharpness(level, quads[:0]) is None


@pytest.mark.parametrize("off", (-1.0, 1.0))
def test_a_blurred_marker_has_its_edges_where_they_are(off):
    true = np.array([[20.0, 20.0], [60.0, 20.0], [60.0, 60.0], [20.0, 60.0]])
    level = np.ones((81, 81), np.float32)
    level[20:60, 20:60] = 0.05  # pixels' middles lie half a pixel inside the edges
    level = cv2.GaussianBlur(level, (0, 0), 1.2)
    seen = true - 0.5 + off * np.sign(true - 40.0)
    np.testing.assert_allclose(placed_quads(level, seen[None])[0], true - 0.5, atol=0.02)
