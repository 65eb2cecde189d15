"""The contact sheet, the set-up as a browser draws it, and the page of a calibration."""

from __future__ import annotations

import base64
from dataclasses import replace

import cv2
import numpy as np

from photogonio.calib.report.overlay import CORNER, SAMPLE
from photogonio.report.calibration_report import calibration_html
from photogonio.report.viewer.contact_sheet import MOST_BYTES, contact_sheet
from photogonio.report.viewer.set_up_scene import set_up_scene
from photogonio.report.viewer.small_prints import WIDTH
from tests.drawn.small_setup import CORNERS, small_setup

GREY = np.full((WIDTH * 3 // 4, WIDTH, 3), 90, np.uint8)


def picture(jpeg: str) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(base64.b64decode(jpeg), np.uint8), cv2.IMREAD_COLOR)[..., ::-1]


def test_each_photo_is_there_once_with_what_became_of_it():
    setup = small_setup()
    sheet = contact_sheet(setup, setup.left_out, {"sample/0.png": GREY, "sample/9.png": GREY})
    assert [(one.name, one.state) for one in sheet] == [
        ("sample/0.png", "used"),
        ("sample/1.png", "used"),
        ("bare/0.png", "board"),
        ("sample/9.png", "left out"),
    ]
    assert "12 corners" in sheet[0].said and "light near" in sheet[0].said
    assert sheet[3].said == setup.left_out[0].reason
    assert all(picture(one.jpeg).shape == (240, 320, 3) for one in sheet)


def test_marks_lie_where_they_were_found():
    """Half as large as the photo: a corner at pixel p is at (p + 1/2) / 2 - 1/2."""
    setup = small_setup()
    first = picture(contact_sheet(setup, (), {"sample/0.png": GREY})[0].jpeg).astype(int)
    corner = setup.views[0].marks.corners[0]
    x, y = np.round((corner + 0.5) / 2 - 0.5).astype(int)
    green = np.abs(first[y - 4 : y + 5, x - 4 : x + 5] - CORNER).sum(-1).min()
    assert green < 150  # JPEG halves the colours' resolution
    radius = 25.0 * 900.0 / 575.0 / 2  # pixels of the print, of a ball seen from 575 above its middle
    assert np.abs(first[120, 160 - round(radius) - 1 : 162 - round(radius)] - SAMPLE).sum(-1).min() < 200


def test_many_photos_stay_small():
    noise = np.random.default_rng(0).integers(0, 255, GREY.shape, dtype=np.uint8)
    setup = small_setup()
    views = tuple(replace(setup.views[0], name=f"{k}.png") for k in range(60))
    sheet = contact_sheet(replace(setup, views=views), (), {view.name: noise for view in views})
    assert sum(len(one.jpeg) for one in sheet) <= MOST_BYTES and len(sheet) == 61


def test_the_scene_has_all_that_stood_there():
    scene = set_up_scene(small_setup())
    unit = np.ptp(CORNERS[:, 0])  # the board is wider than it is high
    board = np.array(scene["board"])
    np.testing.assert_allclose(np.ptp(board, axis=0), [1.0, 140.0 / unit, 0.0], atol=0.01)
    np.testing.assert_allclose(scene["sample"]["ball"], [0, 0, 0, 25.0 / unit], atol=1e-3)
    np.testing.assert_allclose(scene["lamps"][0]["at"], np.array([210.0, 30.0, 375.0]) / unit, atol=1e-3)
    assert scene["lamps"][1] == {"far": True, "at": [0.0, 0.6, 0.8]}
    assert len(scene["cameras"]) == 2 and len(scene["boards"]) == 1
    view = np.array(scene["cameras"][0]["view"])
    np.testing.assert_allclose(np.linalg.norm(view, axis=1), 1.0, atol=2e-3)
    assert (view[:, 2] < -0.8).all()  # downward


def test_the_page_of_a_calibration_says_what_to_know():
    text = calibration_html(small_setup(), {"sample/0.png": GREY}, name="oak <1>")
    assert "oak &lt;1&gt;" in text and "<b>oak <1>" not in text
    for said in (
        "What is missing",
        "1 photo",
        "no highlight of light sun",
        'id="set-up"',
        "0.10 px",
        "residual, px",
    ):
        assert said in text, said
    assert 'id="ball"' not in text
