"""Colour charts: a known matrix comes back; the real photo's chart is found and corrected."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.capture.linear.colour_chart import (
    colour_correction,
    correct,
    delta_e_2000,
    find_chart,
    lab,
    patch_means,
    reference_xyz,
    srgb_from_xyz,
    white_xyz,
)
from photogonio.capture.linear.prepare import prepare
from photogonio.capture.manifest.load import load_photoset

CAMERA = np.array([[0.9, 0.2, 0.05], [0.1, 0.8, -0.05], [0.02, -0.1, 0.7]])  # RGB from XYZ
WHITE = np.array([0.5, 0.8, 0.4])


def camera_rgb() -> np.ndarray:
    """What a linear camera makes of the chart's patches, (24, 3)."""
    balanced = reference_xyz() @ CAMERA.T / (white_xyz() @ CAMERA.T)
    return balanced * WHITE


def picture(patches: np.ndarray, *, turned: bool = False) -> np.ndarray:
    """A photo of a chart on a gray table, (h, w, 3) linear, slightly in perspective."""
    size, gap = 60, 12
    sheet = np.full((4 * (size + gap) + gap, 6 * (size + gap) + gap, 3), 0.01, np.float32) * WHITE.astype(
        np.float32
    )
    for k, colour in enumerate(patches):
        y, x = (gap + (k // 6) * (size + gap), gap + (k % 6) * (size + gap))
        sheet[y : y + size, x : x + size] = colour
    height, width = sheet.shape[:2]
    corners = np.float32([[0, 0], [width, 0], [width, height], [0, height]])
    place = np.float32([[110, 92], [560, 80], [575, 400], [100, 390]])
    place = place[[2, 3, 0, 1]] if turned else place
    transform = cv2.getPerspectiveTransform(corners, place)
    table = np.full((480, 680, 3), 0.3, np.float32) * WHITE.astype(np.float32)
    inside = cv2.warpPerspective(np.ones(sheet.shape[:2], np.float32), transform, (680, 480))[..., None]
    return cv2.warpPerspective(sheet, transform, (680, 480)) * inside + table * (1 - inside)


def test_a_linear_camera_is_undone_exactly():
    found = correct(camera_rgb())
    assert found.delta_e.max() < 1e-3 and found.delta_e_left_out.max() < 1e-3
    assert found.white == pytest.approx(WHITE, rel=1e-4) and np.abs(found.offset).max() < 1e-4
    assert np.abs(found.xyz(camera_rgb()) - reference_xyz()).max() < 1e-3


def test_glare_is_told_apart_and_an_upside_down_chart_turned():
    glare = np.array([0.004, 0.002, 0.003])
    turned = (camera_rgb() + glare).reshape(4, 6, 3)[::-1, ::-1].reshape(24, 3)
    found = correct(turned)
    assert found.offset == pytest.approx(glare, abs=1e-4)
    assert found.delta_e.max() < 1e-3


def test_white_becomes_white_in_srgb():
    found = correct(camera_rgb())
    assert found.srgb(found.white) == pytest.approx([1, 1, 1], abs=2e-3)
    assert srgb_from_xyz() @ white_xyz() == pytest.approx([1, 1, 1], abs=2e-3)


def test_delta_e_is_colour_sciences():
    import colour

    rng = np.random.default_rng(0)
    one, two = rng.uniform(0, 1, (2, 30, 3))
    white = colour.CCS_COLOURCHECKERS["ColorChecker24 - After November 2014"].illuminant
    assert np.allclose(lab(one), colour.XYZ_to_Lab(one, white), atol=1e-4)
    # Sharma, Wu & Dalal 2005, first pair of their table
    known = colour.delta_E([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], method="CIE 2000")
    assert known == pytest.approx(2.0425, abs=1e-4)
    assert (delta_e_2000(one, two) > 0).all() and np.allclose(delta_e_2000(one, one), 0)


@pytest.mark.parametrize("turned", [False, True])
def test_a_chart_is_found_in_a_picture(turned):
    photo = picture(camera_rgb(), turned=turned)
    found = correct(patch_means(photo, find_chart(photo)))
    assert found.delta_e.mean() < 1.0


def test_no_chart_and_a_wrong_one_are_refused():
    with pytest.raises(ValueError, match="no 24-patch"):
        find_chart(np.full((300, 400, 3), 0.2, np.float32))
    with pytest.raises(ValueError, match="fit no ColorChecker"):
        correct(np.random.default_rng(0).uniform(0.05, 0.9, (24, 3)))
    with pytest.raises(ValueError, match="no valid pixel"):
        correct(np.full((24, 3), np.nan))


def test_the_real_raw_photo(shared, tmp_path, files):
    """Found by OpenCV's detector; about 2 of Delta E 2000 is what a matrix leaves of a camera's own
    colours.
    """
    data = (shared / "data" / "raw" / "colorchart.dng").read_bytes()
    for name in ("a.dng", "b.dng"):
        (tmp_path / name).write_bytes(data)
    photos = [{"file": "a.dng", "role": "sample"}, {"file": "b.dng", "role": "chart"}]
    reader = prepare(load_photoset(files["manifest"](tmp_path, photos)))
    found = colour_correction(reader)
    assert found.delta_e.mean() < 3.0 and found.delta_e.max() < 7.0
    assert found.delta_e_left_out.mean() < 4.0
    again = colour_correction(reader)
    assert np.array_equal(again.matrix, found.matrix)


def test_photos_without_a_chart_are_named(tmp_path, files):
    files["png"](tmp_path / "a.png", np.full((200, 300, 3), 20000, np.uint16))
    photos = [{"file": "a.png", "role": "sample"}]
    assert colour_correction(prepare(load_photoset(files["manifest"](tmp_path, photos)))) is None
    photos.append({"file": "a.png", "role": "chart"})
    with pytest.raises(InputError, match=r"a\.png: no 24-patch"):
        colour_correction(prepare(load_photoset(files["manifest"](tmp_path, photos))))
