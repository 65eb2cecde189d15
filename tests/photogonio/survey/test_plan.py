"""A plan says where to stand, in words, numbers and as a page."""

import json
from dataclasses import replace

import numpy as np
import pytest

from photogonio.cli import main
from photogonio.reconstruct.design.materials import material
from photogonio.reconstruct.design.places import Step
from photogonio.reconstruct.design.spots import Piece, Spot, Stance
from photogonio.survey.plan_words import purpose


def test_before_any_photo_a_plan_lowers_what_is_open(tmp_path, capsys):
    out = tmp_path / "plan.html"
    assert (
        main(["plan", "--material", "matte", "--shape", "ball", "--add", "2", "-o", str(out), "--json"]) == 0
    )
    said = json.loads(capsys.readouterr().out)
    assert said["helps"] and len(said["photos"]) == 2
    first, second = said["photos"]
    assert first["mean_variance_before"] > first["mean_variance_after"] > second["mean_variance_after"]
    camera = first["camera"]
    up, turn = np.radians([camera["elevation"], camera["azimuth"]])
    height = camera["distance"] * np.sin(up) + 25.0  # of a ball that stands on the board
    there = camera["distance"] * np.cos(up) * np.array([np.cos(turn), np.sin(turn)])
    np.testing.assert_allclose(camera["position"], [*there, height], atol=0.05)
    page = out.read_text(encoding="utf-8")
    assert page.count('class="tick"') == 2 and "<svg" in page


def result(tmp_path, shrink):
    """A coefficient file whose errors are ``shrink`` times those of a kind of material."""
    brdf = material("satin")
    errors = shrink * brdf.uncertainty.standard_errors
    known = replace(brdf.uncertainty, standard_errors=errors, scale=0.02)
    path = tmp_path / "coefficients.json"
    replace(brdf, uncertainty=known, standard_errors=errors[:1]).save(path)
    return path


def test_of_a_result_that_knows_all_it_is_told_that_more_would_not_help(tmp_path, capsys):
    assert main(["plan", str(result(tmp_path, 1e-3)), "--add", "1", "--json"]) == 0
    sure = json.loads(capsys.readouterr().out)
    assert not sure["helps"] and "would not help" in sure["verdict"]
    assert main(["plan", str(result(tmp_path, 1.0)), "--add", "1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["helps"]


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (["plan", "nowhere"], "no such folder"),
        (["plan", "--still"], "no photos"),
        (["plan", "a-set", "--shape", "ball"], "--shape: photos and results say themselves"),
        (["plan", "-o", "plan.pdf"], "ends in .html"),
    ],
)
def test_what_cannot_be_planned_is_one_line(words, what, capsys):
    assert main(words) == 2
    assert what in capsys.readouterr().err


def test_a_photo_is_called_what_it_shows():
    flat = Piece(False, (30.0, 30.0))
    mirror = Stance(Spot(40.0, -90.0, 500.0), Spot(40.0, 90.0, 500.0))
    assert purpose(mirror, flat) == "in the mirror direction"
    assert "retro" in purpose(Stance(mirror.camera, Spot(45.0, -80.0, 500.0)), flat)
    assert purpose(Stance(mirror.camera, Spot(8.0, 0.0, 500.0)), flat) == "grazing"
    assert Step(mirror, 1.0, 0.5).worth and not Step(mirror, 1.0, 0.99).worth
