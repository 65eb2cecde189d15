"""Tabulated measurements: columns, rows, folding of angles, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.goniometer.read import lines_of, read_samples
from tests.places import SHARED

PTFE = SHARED / "data/nist-ptfe/PTFE.data.csv"


def write(tmp_path, text: str) -> Path:
    path = tmp_path / "table.csv"
    path.write_text(text)
    return path


def test_plain_columns(tmp_path):
    path = write(
        tmp_path, "theta_i,phi_i,theta_r,phi_r,R,G\n10,20,30,40,0.1,0.2\n\n# a remark\n50,0,60,180,0.3,0.4\n"
    )
    samples = read_samples(path)
    assert samples.channels == ("R", "G")
    np.testing.assert_allclose(np.degrees(samples.theta_i), [10, 50])
    np.testing.assert_allclose(np.degrees(samples.phi_r), [40, 180])
    np.testing.assert_array_equal(samples.value, [[0.1, 0.2], [0.3, 0.4]])
    assert samples.sigma is None


@pytest.mark.parametrize("mark", [";", "\t", " "])
def test_other_separators(tmp_path, mark):
    path = write(tmp_path, "theta_i theta_r phi_r f\n10 30 40 0.1\n".replace(" ", mark))
    np.testing.assert_allclose(read_samples(path).value, [[0.1]])
    np.testing.assert_array_equal(read_samples(path).phi_i, [0])


def test_columns_are_mapped_and_rows_chosen(tmp_path):
    path = write(
        tmp_path, "nm,ti,p,tr,pr,a,b,s\n500,1,2,3,4,5,6,0.5\n0.5e3,1,2,3,4,7,8,0.5\n600,1,2,3,4,9,9,0.5\n"
    )
    columns = {"theta_i": "ti", "phi_i": "p", "theta_r": "tr", "phi_r": "pr", "value": "b+a", "sigma": "s"}
    samples = read_samples(path, columns=columns, where=[("nm", "500")])
    assert samples.channels == ("b", "a")
    np.testing.assert_array_equal(samples.value, [[6, 5], [8, 7]])
    np.testing.assert_array_equal(samples.sigma, np.full((2, 2), 0.5))


def test_a_negative_angle_is_the_other_side(tmp_path):
    path = write(tmp_path, "theta_i,phi_i,theta_r,phi_r,f\n-30,0,40,10,1\n30,180,-40,190,1\n")
    samples = read_samples(path)
    for folded in (samples.incident, samples.exit):
        np.testing.assert_allclose(folded[0], folded[1], atol=1e-15)
    np.testing.assert_allclose(samples.incident[0], [-0.5, 0, np.sqrt(0.75)], atol=1e-15)


def test_rows_without_a_number_or_below_the_surface_are_counted(tmp_path):
    path = write(
        tmp_path, "theta_i,phi_i,theta_r,phi_r,f\n10,0,20,0,1\n10,0,20,0,\n10,0,20,0,nan\n10,0,95,0,1\n"
    )
    samples = read_samples(path)
    assert (len(samples.value), samples.left_out) == (1, 3)


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        ("", {}, "empty"),
        ("theta_i,phi_i,theta_r,phi_r,f\n", {}, "empty"),
        ("theta_i,phi_i,theta_r,f\n1,2,3,4\n", {}, "'phi_r'"),
        ("theta_i,phi_i,theta_r,phi_r,f,f\n1,2,3,4,5,6\n", {}, "more than once"),
        ("theta_i,phi_i,theta_r,phi_r,f\n1,2,3,4\n", {}, "line 2: expected 5 columns"),
        ("theta_i,phi_i,theta_r,phi_r,f\n1,2,3,4,five\n", {}, "line 2: f is 'five'"),
        ("theta_i,phi_i,theta_r,phi_r,f\n1,2,3,4,\n", {}, "no row has a value"),
        ("theta_i,phi_i,theta_r,phi_r,f\n1,2,3,4,5\n", {"columns": {"theta": "f"}}, "--columns theta"),
        ("theta_i,phi_i,theta_r,phi_r,f\n1,2,3,4,5\n", {"columns": {"value": "g"}}, "'g'"),
        ("theta_i,phi_i,theta_r,phi_r,f,w\n1,2,3,4,5,6\n", {"where": [("w", "7")]}, "found 6"),
        ("theta_i,phi_i,theta_r,phi_r,f,sigma\n1,2,3,4,5,0\n", {}, "above zero"),
    ],
)
def test_what_cannot_be_used_is_refused(tmp_path, text, options, said):
    path = write(tmp_path, text)
    with pytest.raises(InputError) as error:
        read_samples(path, **options)
    assert said in str(error.value)


def noted(tmp_path, sigma, **told):
    """Twelve rows of 0.2 with standard errors."""
    rows = [f"30,0,{5 * k},0,0.2,{one}" for k, one in enumerate(sigma)]
    header = "theta_i,phi_i,theta_r,phi_r,f,sigma\n"
    return read_samples(write(tmp_path, header + "\n".join(rows) + "\n"), **told)


@pytest.mark.parametrize("sigma", ["1e300", "1e9", "5"])
def test_standard_errors_that_values_do_not_scatter_by_are_refused_in_a_line(tmp_path, sigma):
    """Values of 0.2 with such errors would be anywhere."""
    with pytest.raises(InputError) as error:
        noted(tmp_path, 12 * [sigma])
    assert "standard errors (sigma) are about" in str(error.value) and "\n" not in str(error.value)
    samples = noted(tmp_path, 12 * [sigma], columns={"sigma": "none"})
    assert samples.sigma is None and "not read: sigma" in samples.notes[0]


def test_single_rows_whose_error_says_that_they_are_none_are_left_out_by_name(tmp_path):
    samples = noted(tmp_path, [*(11 * ["0.002"]), "1e30"])
    assert len(samples.value) == len(samples.sigma) == 11 and samples.sigma.max() == 0.002
    (told,) = samples.diagnoses
    assert told.code == "rows-left-out" and "standard error" in told.message and "line 13" in told.message


@pytest.mark.skipif(not PTFE.exists(), reason="the measured PTFE table is not here")
def test_a_real_table():
    columns = {"theta_i": "thetai", "phi_i": "phi", "theta_r": "thetar", "phi_r": "phir", "value": "f_r11"}
    samples = read_samples(PTFE, columns=columns, where=[("lambda", "0.532")])
    assert samples.value.shape == (1824, 1)
    # sintered PTFE is a near-perfect white diffuser: f is about 1/pi
    assert abs(np.median(samples.value) * np.pi - 1) < 0.1


def test_line_numbers_in_words():
    assert lines_of(np.array([5, 3, 4, 9, 11, 12])) == "lines 3 to 5, 9, 11 to 12"
    assert lines_of(np.array([7])) == "line 7"
    assert lines_of(np.arange(0, 100, 2), most=3) == "lines 0, 2, 4 and 47 more"


def test_an_azimuth_of_many_turns_is_a_mark(tmp_path):
    rows = [
        f"30,0,{r},{azimuth},0.2" for r, azimuth in ((10, 0), (20, 999), (30, -999), (40, 540), (50, 180))
    ]
    found = read_samples(write(tmp_path, "theta_i,phi_i,theta_r,phi_r,value\n" + "\n".join(rows)))
    np.testing.assert_allclose(np.degrees(found.theta_r), [10.0, 40.0, 50.0])
    assert "2 rows left out" in found.warnings[0] and "lines 3 to 4" in found.warnings[0]


def test_angles_that_most_rows_lack_are_refused(tmp_path):
    """Written once for the rows below, or in another unit."""
    header, rows = (
        "theta_i,phi_i,theta_r,phi_r,value\n",
        [(i, r) for i in (10, 30, 50) for r in range(5, 80, 5)],
    )
    filled = "".join(f"{i if r == 5 else ''},0,{r},180,0.2\n" for i, r in rows)
    with pytest.raises(InputError, match="one stands for the rows below"):
        read_samples(write(tmp_path, header + filled))
    minutes = "".join(f"{i},0,{r},{60 * 179},0.2\n" for i, r in rows)
    with pytest.raises(InputError, match="another unit"):
        read_samples(write(tmp_path, header + minutes))
