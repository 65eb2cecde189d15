"""Intervals of fresh readings, of a fit and of its file."""

import json
from dataclasses import replace

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import load_brdf
from photogonio.reconstruct.fit import fit_table
from photogonio.reconstruct.table.cells import cells_of
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.goniometer import rows_of, table_of_rows
from tests.drawn.tables import Plan, simulate

NOISE = 0.05
SEEN = 300


@pytest.fixture(scope="module")
def rows():
    """A fit of some rows, and others of the same surface and noise."""
    value, *angles = rows_of("plastic", {"albedo": (0.3,), "roughness": 0.3})
    value = value * (1.0 + NOISE * np.random.default_rng(2).normal(size=value.shape))
    used, fresh = (
        table_of_rows(value[part], *(angle[part] for angle in angles))
        for part in (slice(SEEN), slice(SEEN, None))
    )
    return fit_table(used), cells_of(fresh)


def test_intervals_hold_fresh_rows(rows):
    fit, fresh = rows
    low, high = fit.prediction_interval(fresh)
    held = np.mean((low <= fresh.value) & (fresh.value <= high))
    assert 0.9 <= held <= 0.995
    narrow = fit.prediction_interval(fresh, level=0.5)
    np.testing.assert_array_less(narrow[1] - narrow[0], high - low)


def test_the_file_says_the_same_as_the_fit(rows, tmp_path):
    """Its standard errors are widened and its tables coarse, which noise outweighs."""
    fit, fresh = rows
    fit.brdf.save(tmp_path / "coefficients.json")
    again = load_brdf(tmp_path / "coefficients.json").only([0])
    low, high = again.prediction_interval(fresh.theta_i, 0.0, fresh.theta_r, fresh.dphi)
    own = np.subtract(*fit.prediction_interval(fresh)[::-1])
    assert np.median((high - low) / own) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("told", [{}, {"noise": 3}, "much", {"noise": {}, "widened": [1.0]}], ids=str)
def test_what_a_file_tells_of_readings_is_looked_at(rows, tmp_path, told):
    path = tmp_path / "coefficients.json"
    rows[0].brdf.save(path)
    document = json.loads(path.read_text())
    document["fit"]["fresh reading"] = told
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=r"coefficients\.json: fit\.fresh reading: needs noise"):
        load_brdf(path)


def test_photos_have_no_rows():
    table = simulate(make_brdf("lambert"), replace(Plan(), views=4, pixels=300, level=2))
    fit = fit_table(table)
    with pytest.raises(TypeError, match="no rows"):
        fit.prediction_interval(fit.cells)
    assert np.isnan(fit.brdf.prediction_interval(0.3, 0.0, 0.4, 1.0)).all()
