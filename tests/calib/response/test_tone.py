"""What is said of a curve that the print told, and what follows of its error."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Camera
from photogonio.calib.response.tone import tone_doubt, tone_note, with_tone
from photogonio.calib.setup import PrintTone, Setup
from photogonio.capture.photoset import Sphere

TONE = PrintTone(
    table=np.linspace(0, 1, 5)[:, None],
    error=np.zeros((5, 1)),
    seen=np.array([0.1, 0.9]),
    ink=np.array([0.05]),
    misfit=0.001,
    photos=10,
    scale_error=0.03,
)
SETUP = Setup(
    Camera(np.eye(3), np.zeros(5), (6, 4)), Sphere(np.zeros(3), 1.0), (), "absolute", ("Y",), scale_error=0.04
)


def test_its_error_is_one_that_all_photos_share():
    found = with_tone(SETUP, TONE, {"a.jpg": 2.0})
    assert found.scale_error == pytest.approx(0.05)
    assert found.tone == replace(TONE, exposures={"a.jpg": 2.0})
    assert [one.code for one in found.diagnoses] == ["tone-curve-unsure"]


def test_a_curve_that_is_sure_is_only_noted():
    sure = replace(TONE, scale_error=0.005)
    assert tone_doubt(sure) is None
    assert with_tone(SETUP, sure).diagnoses == ()
    assert "0.5%" in tone_note(sure) and "10 photos" in tone_note(sure)
