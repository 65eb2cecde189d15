"""Measured tables: rows left out in neighbourhoods, and the ways to predict them."""

import json

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.evaluate.history import load_scores, regressions
from photogonio.evaluate.measured_tables import FOLDS, block_folds, evaluate_tables, score_of
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


def test_rows_in_too_few_neighbourhoods_are_refused_in_a_line():
    with pytest.raises(InputError, match="few: its 3 rows lie in fewer than 5 neighbourhoods"):
        score_of("few", drawn(rows=3))
