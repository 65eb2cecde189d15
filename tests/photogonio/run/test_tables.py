"""Tables that nothing went into are refused with the reason."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.evaluate.hard_tables import one_cell
from photogonio.options import Options
from photogonio.reconstruct.goniometer.told import Told
from photogonio.reconstruct.table.facet_table import LEFT_OUT, of_groups
from photogonio.run.tables import WHY_UNUSED, quantity_developed, read_table, refuse_empty
from photogonio.system.progress import Reporter


def empty(**counts: int):
    """A table without a cell, whose photo lost so many pixels by each reason."""
    left_out = np.array([[counts.get(reason, 0) for reason in LEFT_OUT]])
    nothing = of_groups(one_cell(np.ones(1), np.ones(1)), ())
    return replace(nothing, groups=("s000.png",), left_out=left_out)


def test_a_table_with_a_cell_passes():
    refuse_empty(one_cell(np.ones(1), np.ones(1)))


def test_the_commonest_reason_is_told():
    with pytest.raises(InputError, match="90 % are lit or seen at more than 85 degrees"):
        refuse_empty(empty(grazing=900, outline=60, unlit=40))


def test_a_sample_that_no_photo_shows_is_told():
    with pytest.raises(InputError, match="no pixel shows it"):
        refuse_empty(empty())


def test_every_reason_has_its_words():
    assert set(WHY_UNUSED) == set(LEFT_OUT)


def table_file(tmp_path, values):
    rows = [f"{i},0,{r},{p},{v}" for (i, r, p), v in zip(np.ndindex(3, 3, 4), values, strict=True)]
    scaled = [",".join([str(20 * int(a)), b, str(20 * int(c)), str(60 * int(d)), v])
              for a, b, c, d, v in (row.split(",") for row in rows)]  # fmt: skip
    path = tmp_path / "rows.csv"
    path.write_text("\n".join(["theta_i,phi_i,theta_r,phi_r,wavelength,f", *(
        f"{row.rpartition(',')[0]},550,{row.rpartition(',')[2]}" for row in scaled
    )]))  # fmt: skip
    return path


def test_what_is_left_out_of_a_table_is_told_by_code_with_the_file(tmp_path):
    values = np.full(36, 0.1)
    values[7] = -999.0
    reporter = Reporter(quiet=True)
    read = read_table(table_file(tmp_path, values), Options(), Told(), reporter)
    assert len(read.table) == 35 and read.scale == "absolute"
    (told,) = reporter.diagnoses
    assert told.code == "rows-left-out" and told.message.startswith("rows.csv: 1 row left out")
    assert "line 9" in told.message


def test_values_in_per_cent_are_f_when_told(tmp_path):
    path = table_file(tmp_path, np.full(36, 50.0))
    read = read_table(path, Options(), Told(quantity="percent"), Reporter(quiet=True))
    np.testing.assert_allclose(read.table.value, 0.5 / np.pi)


def test_what_is_developed_is_f_unless_least_squares_of_q_are_asked_for():
    plain = Options(prior="none", robust=False)
    csv, npz = Path("rows.csv"), Path("table.npz")
    for path in (csv, npz):
        assert quantity_developed(path, plain, Told(quantity="brdf-cos")) == "brdf_cos"
        assert quantity_developed(path, plain, Told(quantity="brdf-cos-cos")) == "brdf_cos_cos"
        assert quantity_developed(path, plain, Told()) == "brdf"
    assert quantity_developed(csv, Options(prior="none"), Told(quantity="brdf-cos")) == "brdf"
    for options, quantity in ((Options(robust=False), "brdf-cos"), (plain, "percent")):
        with pytest.raises(InputError, match="holds f"):
            quantity_developed(npz, options, Told(quantity=quantity))
