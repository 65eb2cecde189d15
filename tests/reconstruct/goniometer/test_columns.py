"""Columns that nobody mapped: which may be channels."""

from __future__ import annotations

import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.goniometer.columns import (
    is_value,
    match_columns,
    quantity_said,
    units_of,
    unused_note,
)
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.goniometer.text import read_text
from photogonio.reconstruct.goniometer.told import Told

ANGLES = "theta_i,phi_i,theta_r,phi_r"


def table_of(tmp_path, more: str, cells: str):
    path = tmp_path / "table.csv"
    path.write_text(f"{ANGLES},{more}\n10,0,20,90,{cells}\n")
    return read_text(path)


@pytest.mark.parametrize(
    "header",
    ["lambda", "Lambda", "wavelength", "wavelength_nm", "Wavelength [nm]", "lambda_um", "sigma", "f_sigma", "stderr",
     "uncertainty", "Uncertainty (k=2)", "error_R", "temperature", "Temp", "temperature_C", "index", "row", "run",
     "polarization", "time", "date", "sample_id", "std dev", "σ", "λ"],
)  # fmt: skip
def test_never_a_channel(tmp_path, header):
    assert not is_value(header)
    matched = match_columns(table_of(tmp_path, f"brdf,{header}", "0.2,1"), Told())
    assert matched.values == ("brdf",)
    assert ("sigma" == header) == (matched.sigmas == ("sigma",))


@pytest.mark.parametrize(
    "header",
    ["value", "f", "R", "value_R", "f_r11", "BRDF", "Y", "450", "550nm", "reflectance", "fr (1/sr)", "green"],
)
def test_a_channel(header):
    assert is_value(header)


def test_words_are_no_channel_and_errors_are_offered(tmp_path):
    matched = match_columns(
        table_of(tmp_path, "R,G,operator name,R_unc,G_unc", "0.1,0.2,Ann,0.01,0.02"), Told()
    )
    assert matched.values == ("R", "G")
    note = unused_note(matched)
    assert "operator name" in note and "--columns sigma=R_unc+G_unc" in note


def test_what_was_mapped_is_obeyed(tmp_path):
    told = Told(columns={"value": "lambda"})
    assert match_columns(table_of(tmp_path, "brdf,lambda", "0.2,1"), told).values == ("lambda",)


def test_without_values_it_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"--columns value=\.\.\."):
        match_columns(table_of(tmp_path, "wavelength,sigma", "500,1"), Told())


@pytest.mark.parametrize(
    ("header", "unit"),
    [
        ("Theta_i,Phi_i,Theta_r,Phi_r", None),
        ("thetaIn,phiIn,thetaOut,phiOut", None),
        ("theta_i [deg],phi_i [deg],theta_o [deg],phi_o [deg]", None),
        ("θi (°),φi (°),θr (°),φr (°)", None),
        ("theta_i (rad),phi_i (rad),theta_r (rad),phi_r (rad)", "radians"),
        ("theta_i_rad,phi_i_rad,theta_r_rad,phi_r_rad", "radians"),
        ("theta_i [gon],phi_i [gon],theta_r [gon],phi_r [gon]", "gradians"),
    ],
)
def test_angles_as_others_write_them(tmp_path, header, unit):
    path = tmp_path / "table.csv"
    path.write_text(f"{header},f,raw,t_int_ms\n10,0,20,90,0.2,3000,50\n", encoding="utf-8")
    table = read_text(path)
    matched = match_columns(table, Told())
    assert list(matched.angles.values()) == header.split(",")
    assert matched.values == ("f",)
    assert units_of(table, matched.angles) == ({} if unit is None else dict.fromkeys(matched.angles, unit))


def unit_table(tmp_path, header: str, below: str = ""):
    path = tmp_path / "table.csv"
    path.write_text(f"{header},f\n{below}0.1,0,0.2,90,0.2\n0.2,0,0.3,90,0.2\n", encoding="utf-8")
    table = read_text(path)
    return table, match_columns(table, Told()).angles


def test_each_angle_has_its_own_unit_if_all_name_one(tmp_path):
    told = {"theta_i": "radians", "phi_i": "degrees", "theta_r": "radians", "phi_r": "degrees"}
    of_header = unit_table(tmp_path, "theta_i (rad),phi_i (deg),theta_r (rad),phi_r (deg)")
    assert units_of(*of_header) == told
    of_line = unit_table(tmp_path, ANGLES, "rad,deg,rad,deg,1/sr\n")
    assert units_of(*of_line) == told
    with pytest.raises(InputError, match="more than one unit"):
        units_of(*unit_table(tmp_path, "theta_i (rad),phi_i,theta_r (rad),phi_r"))


@pytest.mark.parametrize(
    "other",
    [
        "Spannung",
        "thickness",
        "dwell",
        "+/-",
        "ci95",
        "tilt",
        "mu",
        "enc1",
        "X",
        "reflectance",
        "btdf",
        "lower",
        "QF",
    ],
)
def test_beside_a_column_that_is_called_a_brdf_no_unknown_one_is_a_channel(tmp_path, other):
    for name in ("value", "BRDF (1/sr)", "f_r"):
        assert match_columns(table_of(tmp_path, f"{name},{other}", "0.2,1"), Told()).values == (name,)
    assert match_columns(table_of(tmp_path, "f_450,f_550", "0.2,1"), Told()).values == ("f_450", "f_550")
    assert match_columns(table_of(tmp_path, "R,G,B,value", "0,1,2,3"), Told()).values == (
        "R",
        "G",
        "B",
        "value",
    )


def test_a_line_of_units_says_what_values_are(tmp_path):
    assert quantity_said(tmp_path, ("value", "f"), ("1/sr", "%")) == ("f", "percent")


@pytest.mark.parametrize(
    ("header", "quantity"),
    [("BRF", "reflectance-factor"), ("Reflectance factor", "reflectance-factor"), ("R (%)", "percent"),
     ("cosine-corrected BRDF", "brdf-cos"), ("BRDF", None), ("R", None), ("reflectance", None), ("550nm", None)],
)  # fmt: skip
def test_a_header_says_what_its_values_are(tmp_path, header, quantity):
    assert quantity_said(tmp_path, (header,)) == (None if quantity is None else (header, quantity))


@pytest.mark.parametrize("header", ["BTDF", "Transmission", "BTDF (1/sr)"])
def test_transmission_is_refused(tmp_path, header):
    with pytest.raises(InputError, match="of transmission"):
        quantity_said(tmp_path, (header,))
    table = table_of(tmp_path, f"{header},BRDF", "0.2,0.1")
    assert match_columns(table, Told()).values == ("BRDF",)


@pytest.mark.parametrize("header", ["log10(BRDF)", "BRDF (dB)", "ln f"])
def test_logarithms_are_refused(tmp_path, header):
    with pytest.raises(InputError, match="logarithms"):
        quantity_said(tmp_path, (header,))


@pytest.mark.parametrize(
    "header",
    ["SZA,SAA,VZA,VAA,BRF", "Solar Zenith Angle [deg],Solar Azimuth Angle [deg],View_Zenith_Angle,view azimuth,BRF",
     "aoi (deg),az_i,exit angle,az_r,BRF", "theta_source,phi_source,theta_view,phi_view,BRF"],
)  # fmt: skip
def test_angles_as_others_call_them(tmp_path, header):
    path = tmp_path / "table.csv"
    path.write_text(f"{header}\n10,0,20,90,0.2\n")
    matched = match_columns(read_text(path), Told())
    assert list(matched.angles.values()) == header.split(",")[:4]
    assert list(matched.angles) == ["theta_i", "phi_i", "theta_r", "phi_r"] and matched.values == ("BRF",)


def test_a_relative_azimuth_does_for_both(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("SZA,VZA,RAA,f\n10,20,90,0.2\n")
    assert match_columns(read_text(path), Told()).angles == {
        "theta_i": "SZA",
        "theta_r": "VZA",
        "phi_r": "RAA",
    }


def test_an_angle_beside_another_is_no_channel(tmp_path):
    assert match_columns(table_of(tmp_path, "AOI,el_r,f", "10,70,0.2"), Told()).values == ("f",)


def test_what_is_the_same_number_in_every_row_is_no_channel(tmp_path):
    """A circumstance that nobody mapped, whatever its name; but a surface may be the same everywhere."""
    path = tmp_path / "table.csv"
    rows = [(i, r, 0.1 + 0.001 * (i + r)) for i in range(0, 60, 10) for r in range(0, 60, 10)]
    path.write_text(
        "theta_i,phi_i,theta_r,phi_r,RH,green,T_degC\n"
        + "\n".join(f"{i},0,{r},180,45.0,{f:.4f},22.5" for i, r, f in rows)
    )
    found = read_samples(path)
    assert found.channels == ("green",) and "RH, T_degC" in found.notes[0]
    path.write_text(
        "theta_i,phi_i,theta_r,phi_r,value,T\n" + "\n".join(f"{i},0,{r},180,0.2,{f}" for i, r, f in rows)
    )
    assert "value" in read_samples(path).channels


@pytest.mark.parametrize("header", ["RAA", "dphi", "delta_phi", "relative azimuth (deg)", "Δφ"])
def test_a_relative_azimuth_is_the_difference_of_both(tmp_path, header):
    path = tmp_path / "t.csv"
    for before, cells in (("", ""), (",phi_i", ",30")):
        path.write_text(
            f"theta_i,theta_r,{header}{before},value\n" + f"10,20,90{cells},0.1\n40,20,180{cells},0.2\n"
        )
        samples = read_samples(path)
        assert ((samples.phi_r - samples.phi_i) * 2.0 / 3.141592653589793).round(6).tolist() == [1.0, 2.0]
