"""The result in linear sRGB or XYZ, by the matrix of a chart; and when that is refused."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from photogonio.capture.linear.colour_chart import (
    ColourCorrection,
    correct,
    reference_xyz,
    srgb_from_xyz,
    white_xyz,
)
from photogonio.capture.linear.prepare import prepare
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.photoset import Radiometry
from photogonio.cli import main
from photogonio.reconstruct.brdf.brdf import Brdf, Lobe
from photogonio.run import calibrate_photos, colours
from photogonio.run.colours import find_correction, in_colours
from tests.drawn.tiny_set import ALBEDO, TinySet

MIXED = np.array([[0.7, 0.2, 0.1], [0.1, 0.8, 0.1], [0.05, 0.15, 0.8]])  # camera RGB of XYZ, of no camera
CORRECTION = correct(reference_xyz() @ MIXED.T)
ANGLES = np.random.default_rng(2).uniform(0, 1.3, (4, 50))
QUICK = ("--lobes", "none", "--order", "2")


def brdf() -> Brdf:
    rng = np.random.default_rng(1)
    modes = np.array([[0, 0, 0], [1, 1, 1], [2, 0, 0]])
    ggx = Lobe(0.3, np.array([0.04, 0.05, 0.9]), np.array([1.0, 0.8, 0.6]))
    return Brdf(2, ("R", "G", "B"), modes, rng.normal(size=(3, 3)), rng.random((3, 3)), lobes=(ggx,))


def test_a_camera_that_mixes_xyz_is_undone():
    np.testing.assert_allclose(CORRECTION.delta_e, 0, atol=1e-3)
    white = MIXED @ white_xyz()
    np.testing.assert_allclose(CORRECTION.white, white, rtol=1e-4)
    np.testing.assert_allclose(CORRECTION.matrix @ np.diag(1 / white), np.linalg.inv(MIXED), atol=2e-3)


@pytest.mark.parametrize("space", ["srgb", "xyz"])
def test_modes_and_lobes_are_mixed_as_their_values_are(space):
    before = brdf()
    after = in_colours(before, CORRECTION.matrix, space)
    matrix = CORRECTION.matrix if space == "xyz" else srgb_from_xyz() @ CORRECTION.matrix
    np.testing.assert_allclose(
        after.evaluate(*ANGLES), before.evaluate(*ANGLES) @ matrix.T, rtol=1e-9, atol=1e-12
    )
    assert after.channels == (("X", "Y", "Z") if space == "xyz" else ("R", "G", "B"))
    assert after.lobes[0].roughness == before.lobes[0].roughness


def test_white_stays_white():
    white = replace(brdf(), coefficients=np.outer([1.0, 0, 0], np.ones(3)), lobes=())
    np.testing.assert_allclose(in_colours(white, CORRECTION.matrix, "srgb").coefficients[0], 1.0, atol=1e-3)
    np.testing.assert_allclose(
        in_colours(white, CORRECTION.matrix, "xyz").coefficients[0], white_xyz(), atol=1e-3
    )


def test_errors_of_channels_add_as_independent():
    after = in_colours(brdf(), CORRECTION.matrix, "xyz")
    expected = np.sqrt(brdf().standard_errors ** 2 @ (CORRECTION.matrix**2).T)
    np.testing.assert_allclose(after.standard_errors, expected)


def asked(tiny_set: TinySet, space: str, *, chart: bool) -> None:
    tiny_set.manifest += f'\n[radiometry]\ncolour = "{space}"\n'
    if chart:
        tiny_set.manifest += '[[photo]]\nfile = "sample/s0.png"\nrole = "chart"\n'
    tiny_set.save()


@pytest.mark.parametrize(("chart", "said"), [(False, 'role "chart"'), (True, "no 24-patch ColorChecker")])
def test_colours_that_cannot_be_had_are_refused(capsys, tmp_path, tiny_set: TinySet, chart, said):
    asked(tiny_set, "srgb", chart=chart)
    assert main(["process", str(tiny_set.folder), "-o", str(tmp_path / "out"), *QUICK]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_chart_of_no_use_is_told_where_nothing_is_asked(tiny_set: TinySet):
    asked(tiny_set, "camera", chart=True)
    photoset, said = load_photoset(tiny_set.folder), []
    assert photoset.radiometry == Radiometry()
    assert find_correction(photoset, prepare(photoset), said.append) is None
    assert len(said) == 1 and said[0].code == "chart-unusable"


def test_a_relative_scale_has_no_colours(capsys, tmp_path, tiny_set: TinySet, monkeypatch):
    monkeypatch.setattr(colours, "colour_correction", lambda reader: CORRECTION)
    asked(tiny_set, "srgb", chart=True)
    assert main(["process", str(tiny_set.folder), "-o", str(tmp_path / "out"), *QUICK]) == 2
    assert "needs a white patch" in capsys.readouterr().err


def test_the_coefficients_are_in_the_colours_asked_for(capsys, tmp_path, tiny_set: TinySet, monkeypatch):
    """With the radiance patch of a relative set declared absolute: a gray ball is the same gray in sRGB."""
    monkeypatch.setattr(colours, "colour_correction", lambda reader: CORRECTION)
    found = calibrate_photos.find_setup
    monkeypatch.setattr(
        calibrate_photos, "find_setup", lambda *a, **k: replace(found(*a, **k), scale="absolute")
    )
    asked(tiny_set, "xyz", chart=True)
    # in the proportions of the set's lamps the ball is whiter than white, which is told
    assert main(["process", str(tiny_set.folder), "-o", str(tmp_path / "out"), *QUICK, "--json"]) == 3
    numbers = json.loads(capsys.readouterr().out)
    assert numbers["channels"] == ["X", "Y", "Z"]
    assert numbers["trust"]["codes"] == ["albedo-above-one"]
    np.testing.assert_allclose(numbers["albedo"], 3 * ALBEDO * white_xyz(), rtol=0.01)
    written = json.loads((tmp_path / "out/coefficients.json").read_text())
    assert written["channels"] == ["X", "Y", "Z"]
    setup = json.loads((tmp_path / "out/setup.json").read_text())
    assert setup["residuals"]["colour"]["delta_e_2000_max"] < 0.01
    assert main(["fit", str(tmp_path / "out/table.npz"), "-o", str(tmp_path / "again"), *QUICK]) == 3
    again = json.loads((tmp_path / "again/coefficients.json").read_text())
    assert again | {"source": None} == written | {"source": None}


def test_a_correction_is_plain_json():
    assert isinstance(CORRECTION, ColourCorrection)
    json.dumps(colours.correction_note(CORRECTION), allow_nan=False)
