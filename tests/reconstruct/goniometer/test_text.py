"""Text tables as people's instruments and spreadsheets write them."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.goniometer.pabopto import beginning
from photogonio.reconstruct.goniometer.text import passed_over, read_text

ROWS = [[10, 0, 20, 90, 0.25], [30, 0, 40, 180, 1.5e-3], [50, 0, 60, 270, 2.0]]
NAMES = ["theta_i", "phi_i", "theta_r", "phi_r", "f"]


def written(tmp_path, lines, **options):
    path = tmp_path / "table.txt"
    path.write_text("\n".join(lines) + "\n", **options)
    return path


def lines_with(mark: str, decimal: str = ".") -> list[str]:
    rows = [mark.join(str(cell).replace(".", decimal) for cell in row) for row in ROWS]
    return [mark.join(NAMES), *rows]


def matrix(table) -> np.ndarray:
    return np.column_stack([table.number(name) for name in NAMES])


@pytest.mark.parametrize("mark", [",", ";", "\t", "|", ":", " ", "   ", ", ", " ; "])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_whatever_separates(tmp_path, mark, end):
    path = tmp_path / "table.txt"
    path.write_bytes(end.join(lines_with(mark)).encode())
    np.testing.assert_array_equal(matrix(read_text(path)), ROWS)


@pytest.mark.parametrize("mark", [";", "\t", " "])
def test_decimal_commas(tmp_path, mark):
    np.testing.assert_array_equal(matrix(read_text(written(tmp_path, lines_with(mark, ",")))), ROWS)


@pytest.mark.parametrize("remark", ["#", ";", "%", "!", "//", "  # "])
@pytest.mark.parametrize("mark", [",", ";", " "])
def test_remarks(tmp_path, remark, mark):
    header, *rows = lines_with(mark)
    said = f"{remark} of 12, 13, 14"
    table = read_text(written(tmp_path, [said, "", header, said, *rows, said]))
    np.testing.assert_array_equal(matrix(table), ROWS)
    np.testing.assert_array_equal(table.line, [5, 6, 7])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-32", "latin-1"])
def test_encodings(tmp_path, encoding):
    header, *rows = lines_with(",")
    path = tmp_path / "table.csv"
    path.write_bytes("\n".join(["# 20 °C, Prüfling", header, *rows]).encode(encoding))
    np.testing.assert_array_equal(matrix(read_text(path)), ROWS)
    path.write_bytes(b"\xff\x00\x01\x02" + path.read_bytes())
    with pytest.raises(InputError, match="not text"):
        read_text(path)


def test_lines_of_spreadsheets_and_notebooks(tmp_path):
    """What Excel writes above a table, and tables with bars about them."""
    np.testing.assert_array_equal(matrix(read_text(written(tmp_path, ["sep=;", *lines_with(";")]))), ROWS)
    header, *rows = (f"| {line} |" for line in lines_with(" | "))
    table = read_text(written(tmp_path, [header, "|---|---|---|---|---|", *rows]))
    assert np.isnan(matrix(table)[0]).all()
    np.testing.assert_array_equal(matrix(table)[1:], ROWS)


def test_a_row_with_an_empty_first_cell_is_no_remark(tmp_path):
    table = read_text(written(tmp_path, [*lines_with(";"), ";0;20;90;0.5"]))
    assert np.isnan(table.number("theta_i")[-1]) and table.number("f")[-1] == 0.5


def test_a_header_in_a_remark_and_a_line_of_units(tmp_path):
    header, *rows = lines_with(" ")
    np.testing.assert_array_equal(matrix(read_text(written(tmp_path, ["# " + header, *rows]))), ROWS)
    table = read_text(written(tmp_path, [header, "deg deg deg deg 1/sr", *rows]))
    np.testing.assert_array_equal(matrix(table), ROWS)
    assert table.units == ("deg", "deg", "deg", "deg", "1/sr")


@pytest.mark.parametrize(
    "cell", ["", ".", "-1.#IND", "1.#QNAN", "NaN", "n/a", "NA", "-", "--", "null", "#N/A", " "]
)
def test_cells_that_say_nothing(tmp_path, cell):
    header, *rows = lines_with(",")
    table = read_text(written(tmp_path, [header, *rows, f"1,2,3,4,{cell}"]))
    assert np.isnan(table.number("f")[-1])


def test_quoted_cells_and_a_comma_at_the_end(tmp_path):
    table = read_text(written(tmp_path, ['"theta_i",phi_i,"theta_r",phi_r,"f",name,', '"1",2,3,4,5,"a, b",']))
    assert table.number("theta_i")[0] == 1.0
    assert table.labels("name") == (["a, b"], np.array([0]))


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (['theta_i,phi_i,theta_r,phi_r,f', '1,2,"3,4,5'], "line 2: a quote is not closed"),
        (['theta_i,phi_i,theta_r,phi_r,f', '1,2,3,4,5', '1,2,3"4,5'], "line 3"),
        (["1,2,3,4,5", "1,2,3,4,6"], "line 1: expected a header line"),
        (["theta_i,phi_i,theta_r,phi_r,f", "1,2,3,4,5", "1,2,3,4"], "line 3: expected 5 columns, found 4"),
        (["# only remarks"], "empty"),
        (["a\0b,c,d", "1,2,3"], "not text"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_told_in_a_line(tmp_path, lines, said):
    with pytest.raises(InputError, match=said) as error:
        read_text(written(tmp_path, lines))
    assert "\n" not in str(error.value)


def test_chunks_join(tmp_path, monkeypatch):
    """A column of numbers in one chunk may have words in another."""
    monkeypatch.setattr("photogonio.reconstruct.goniometer.text._CHUNK", 2)
    rows = [f"{k},0,20,90,{'saturated' if k == 57 else k}" for k in range(60)]
    table = read_text(written(tmp_path, [",".join(NAMES), *rows]))
    np.testing.assert_array_equal(table.number("theta_i"), np.arange(60))
    with pytest.raises(InputError, match="line 59: f is 'saturated'"):
        table.number("f")


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be", "utf-32-le", "utf-32-be"])
def test_wide_letters_without_a_mark(tmp_path, encoding):
    path = tmp_path / "table.csv"
    path.write_bytes("\n".join([",".join(NAMES), "1,2,3,4,5", "6,7,8,9,10"]).encode(encoding))
    np.testing.assert_array_equal(read_text(path).number("f"), [5.0, 10.0])


@pytest.mark.parametrize("mark", [",", ";", "\t", " "])
@pytest.mark.parametrize("chunk", [3, 1 << 16])
def test_headers_between_blocks_and_words_behind_rows(tmp_path, monkeypatch, mark, chunk):
    monkeypatch.setattr("photogonio.reconstruct.goniometer.text._CHUNK", chunk)
    rows = [mark.join(str(float(k + j)) for j in range(5)) for k in range(60)]
    head = mark.join(NAMES)
    lines = [
        head,
        *rows[:55],
        head.upper(),
        *rows[55:],
        "---",
        "End of data",
        "Total: 60 readings of 3 scans by AB",
    ]
    table = read_text(written(tmp_path, lines))
    np.testing.assert_array_equal(table.number("f"), np.arange(60) + 4.0)
    assert table.passed == (63, 64, 65)
    assert passed_over(table.passed) == "lines 63 to 65 behind the rows: no measurements, passed over"


@pytest.mark.parametrize("last", ["1,2,3,4", "-,0", "1,2,3,4,5,6", ",,3"])
def test_a_row_cut_short_is_no_footer(tmp_path, last):
    with pytest.raises(InputError, match="line 4: expected 5 columns"):
        read_text(written(tmp_path, [",".join(NAMES), "1,2,3,4,5", "2,2,3,4,5", last]))


def test_words_between_rows_are_no_footer(tmp_path):
    with pytest.raises(InputError, match="line 3: expected 5 columns, found 1"):
        read_text(written(tmp_path, [",".join(NAMES), "1,2,3,4,5", "second scan", "2,2,3,4,5"]))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes in folders here")
def test_what_need_not_end_is_no_file(tmp_path):
    """A pipe that nobody writes to would be waited for, and zeros never end."""
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/zero")):
        with pytest.raises(InputError, match="is no file"):
            read_text(path)
        assert beginning(path) == ""


PLAIN = "theta_i,phi_i,theta_r,phi_r,value\n" + "".join(
    f"{i},0,{r},90,0.1\n" for i in (10, 40) for r in (0, 20, 50)
)


@pytest.mark.parametrize(
    "head",
    ["* run 3\n", "' run 3\n", "REM the run\n", "-- run\n", "Goniometer run of May\nSample: paint\n",
     "Operator: Ann\nDate: 2026-01-01\nWavelength: 633 nm\n", "Operator,Ann\nDate,2026\n",
     "[Header]\nsample=x\n[Data]\n",
     "incident,,reflected,,BRDF\n"],
)  # fmt: skip
def test_words_before_the_header_are_passed_over(tmp_path, head):
    path = tmp_path / "t.csv"
    for text in (
        PLAIN,
        PLAIN.replace(",", "\t"),
        PLAIN.replace("value\n", "value\ndeg,deg,deg,deg,1/sr\n", 1),
    ):
        path.write_text((head if "\t" not in text else head.replace(",", "\t")) + text)
        table = read_text(path)
        assert table.header == ("theta_i", "phi_i", "theta_r", "phi_r", "value") and len(table) == 6
        assert table.line[0] == (head + text).count("\n") - 5


def test_names_of_several_words_between_wide_blanks_and_degree_signs(tmp_path):
    path = tmp_path / "t.txt"
    path.write_text(
        "theta i (deg)  theta r (deg)  f value\n10\N{DEGREE SIGN}  20  0.1\n30\N{DEGREE SIGN}  20  0.2\n"
    )
    table = read_text(path)
    assert table.header == ("theta i (deg)", "theta r (deg)", "f value")
    assert table.number("theta i (deg)").tolist() == [10.0, 30.0]
