"""Each benchmark of the mathematics runs in its quick mode and says what it must."""

from __future__ import annotations

import csv
import re
import sys

import numpy as np
import pytest

from benchmarks import evaluation, facet_lookup, intervals, paper_figures, truncation
from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import load_brdf
from photogonio.reconstruct.brdf.scatmech import read_scatmech
from photogonio.reconstruct.table.facets import facet_index


@pytest.mark.long
def test_evaluation(capsys, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "pySCATMECH", None)
    evaluation.main(["--quick"])
    text = capsys.readouterr().out
    assert "order  8, 3 channels" in text and "left out, pyscatmech is not installed" in text
    apart = re.findall(r"design matrix and product .* within (\S+)", text)
    assert len(apart) == 4 and max(map(float, apart)) < 1e-12


def test_evaluation_beside_scatmech(capsys, tmp_path):
    pytest.importorskip("pySCATMECH.brdf", reason="pyscatmech is not installed")
    path = tmp_path / "few.csv"
    path.write_text(
        "1,1,0,0,0,0,0,2.0\n1,1,2,0,0,0,0,0.2\n1,1,3,1,1,1,0,-0.3\n1,1,0,2,0,0,0,0.1\n1,2,0,2,0,2,0,0.05\n"
    )
    found = evaluation.scatmech_comparison(read_scatmech(path), 1000, 40, 1)
    assert found["difference"] < 1e-12
    evaluation.main(["--quick", "--ptfe", str(path)])
    assert "ratio" in capsys.readouterr().out
    with pytest.raises(InputError):
        read_scatmech(tmp_path)


def test_facet_lookup(capsys):
    facet_lookup.main(["--quick", "--level", "3"])
    assert "mismatches against every facet in turn: 0 of 20000" in capsys.readouterr().out
    # the brute force is able to disagree
    directions = facet_lookup.random_directions(2000, seed=1)
    assert np.mean(facet_lookup.brute_force(directions[:, [1, 0, 2]], 3) == facet_index(directions, 3)) < 0.1


def test_paper_figures(tmp_path):
    first, second = tmp_path / "a", tmp_path / "b"
    for folder in (first, second):
        paper_figures.main(["--quick", "-o", str(folder)])
    for name in ("modes-to-order-4.png", "glossy-paint.png"):
        assert (first / name).read_bytes() == (second / name).read_bytes()
        assert (first / name).read_bytes().startswith(b"\x89PNG")


def test_glossy_paint_grows_a_lobe_in_the_mirror_direction():
    """Its lobe's height at order N is 2 % of the flat spectrum's sum; at order 2 little more than Lambert is left."""
    turn = np.linspace(-np.pi, np.pi, 181)
    peaks = []
    for order in (2, 4, 6, 8):
        value = paper_figures.glossy_paint(order, np.full(turn.shape, np.pi / 4), turn)
        assert np.argmax(value) in (0, 180)
        peaks.append(value.max() * np.pi - 1)
    assert peaks[0] < 0.1 and (np.diff(peaks) > 0).all()


def test_truncation(tmp_path):
    truncation.main(["--quick", "-o", str(tmp_path), "--coefficients", str(tmp_path / "files")])
    lambert = load_brdf(tmp_path / "files" / "lambert.brdf.json")
    assert lambert.bihemispherical_albedo() == pytest.approx([0.5], rel=1e-12)
    rows = list(csv.DictReader((tmp_path / "truncation.csv").read_text().splitlines()))
    ends = {(row["model"], row["quantity"]): row["ends_at"] for row in rows}
    assert ends["Lambert", "brdf"] == "0" and ends["Lambert", "brdf_cos_cos"] == "2"
    assert ends["Minnaert, k = 2", "brdf"] == "2" and ends["Minnaert, k = 0.7", "brdf"] == ""
    errors = {key: [float(row[f"order_{n}"]) for n in range(5)] for key, row in zip(ends, rows, strict=True)}
    assert errors["Lambert", "brdf"] == [0.0] * 5
    assert (
        errors["Minnaert, k = 0.7", "brdf_cos_cos"][4]
        < 0.05
        < errors["Minnaert, k = 0.7", "brdf_cos_cos"][2]
        < 0.2
    )
    assert (tmp_path / "truncation.png").stat().st_size > 5000


@pytest.mark.long
def test_intervals(capsys):
    intervals.main(["--quick"])
    line = capsys.readouterr().out.splitlines()[-1].split()
    assert line[:2] == ["all", "2"] and 0.0 < float(line[2]) <= 100.0
    scores = [intervals.drawn(seed)[0] for seed in range(len(intervals.KINDS))]
    assert tuple(scores) == intervals.KINDS
