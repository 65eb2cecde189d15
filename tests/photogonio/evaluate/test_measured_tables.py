"""Measured tables: rows left out in neighbourhoods, and the ways to predict them."""

import json

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.evaluate import measured_tables
from photogonio.evaluate.history import load_scores, regressions
from photogonio.evaluate.measured_tables import FOLDS, TableScore, block_folds, evaluate_tables, score_of
from photogonio.reconstruct.goniometer.told import Told
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.cells import cells_of
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples, samples_table
from photogonio.synthetic.brdf.library import make_brdf
from photogonio.system.progress import Reporter

NOISE = 0.02


def drawn(rows=160):
    rng = np.random.default_rng(0)
    theta_i, theta_r = np.arccos(rng.uniform(0.25, 1.0, (2, rows)))
    phi_r = rng.uniform(0.0, 2.0 * np.pi, rows)
    value = make_brdf("plastic", {"albedo": (0.3,), "roughness": 0.35})(
        unit_vectors(theta_i, 0.0 * theta_i), unit_vectors(theta_r, phi_r)
    )[:, :1]
    value = value * (1.0 + NOISE * rng.standard_normal(value.shape))
    return samples_table(GoniometerSamples(theta_i, 0.0 * theta_i, theta_r, phi_r, value, None, ("Y",)))


def test_reciprocal_twins_are_left_out_together():
    cells = cells_of(drawn())
    other = type(cells).of_angles(cells.theta_r, cells.theta_i, cells.dphi)
    fold = block_folds(cells)
    np.testing.assert_array_equal(fold, block_folds(other))
    assert sorted(set(fold.tolist())) == list(range(FOLDS))


def test_a_gloss_among_our_own_is_predicted_better_than_by_smoothers():
    score = score_of("drawn", drawn())
    assert score.fit < min(score.ridge, score.least_squares, score.spline)
    assert score.fit < 0.1 and score.turning == 0


def test_an_earlier_evaluation_of_tables_is_held_against_a_new_one(tmp_path):
    row = {"table": "a.csv", "fit": 0.1, "seconds": 1.0}
    file = tmp_path / "evaluate.json"
    file.write_text(json.dumps({"tables": [row]}))
    former = load_scores(file, "table")
    assert regressions(former, [row]) == []
    assert len(regressions(former, [row | {"fit": 0.12}])) == 1


def test_no_table_is_refused_in_a_line(tmp_path):
    with pytest.raises(InputError, match="expected tables"):
        evaluate_tables([str(tmp_path)], Told(), Reporter(quiet=True))


def written(file, rows, where):
    theta_i, theta_r = np.degrees(np.arccos(np.random.default_rng(where).uniform(0.25, 1.0, (2, rows))))
    lines = [
        f"{i},0,{r},{9 * k},{0.2 + 0.001 * k}" for k, (i, r) in enumerate(zip(theta_i, theta_r, strict=True))
    ]
    file.parent.mkdir(exist_ok=True)
    file.write_text("theta_i,phi_i,theta_r,phi_r,Y\n" + "\n".join(lines) + "\n")


def test_what_is_no_measured_table_is_passed_over_in_a_folder_and_refused_by_name(
    tmp_path, monkeypatch, capsys
):
    for k, name in enumerate(("a", "b")):
        written(tmp_path / name / "01.csv", 40, k)
    written(tmp_path / "b" / "02.csv", 40, 3)
    written(tmp_path / "a" / "few.csv", 3, 4)
    coefficients = tmp_path / "a" / "ptfe.coeff.csv"
    coefficients.write_text("1, 1, 0, 0, 0, 0, 0, 2.0\n1, 1, 1, 1, 1, 1, 0, -0.4\n")
    scored = []

    def score(name, table):
        scored.append((name, len(table)))
        return TableScore(name, len(table), 0.1, 0.1, 0.1, 0.1, 0.95, 1.0, 0)

    monkeypatch.setattr(measured_tables, "score_of", score)
    reporter = Reporter()
    folders = [str(tmp_path / "a"), str(tmp_path / "b"), str(tmp_path / "b")]
    evaluate_tables(folders, Told(), reporter)
    assert scored == [("a/01.csv", 40), ("b/01.csv", 40), ("02.csv", 40)]
    told = capsys.readouterr().err
    assert "few.csv" in told and "ptfe.coeff.csv: says f everywhere" in told
    for name, why in ((coefficients, "everywhere"), (tmp_path / "a" / "few.csv", "neighbourhoods")):
        with pytest.raises(InputError, match=why):
            evaluate_tables([str(name)], Told(), reporter)


def test_tables_of_one_name_are_not_held_against_others(tmp_path):
    row = {"table": "a.csv", "fit": 0.1, "seconds": 1.0}
    file = tmp_path / "evaluate.json"
    file.write_text(json.dumps({"tables": [row, row]}))
    with pytest.raises(InputError, match="several tables of the same name"):
        load_scores(file, "table")


def test_rows_in_too_few_neighbourhoods_are_refused_in_a_line():
    with pytest.raises(InputError, match="few: its 3 rows lie in fewer than 5 neighbourhoods"):
        score_of("few", drawn(rows=3))
