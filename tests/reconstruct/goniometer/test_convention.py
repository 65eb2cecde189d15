"""What a table's angles and values are in the project's terms, and what is asked before they are believed."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.goniometer.convention import per_brdf
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.goniometer.told import QUANTITIES, Told
from photogonio.reconstruct.modes.angles import pair_angles
from tests.places import SHARED

CASES = SHARED / "cases"
present = pytest.mark.skipif(not CASES.exists(), reason="the shared cases are not here")


def write(tmp_path, text: str):
    path = tmp_path / "table.csv"
    path.write_text(text)
    return path


def test_radians_are_asked_about_and_read(tmp_path):
    path = write(tmp_path, "theta_i,phi_i,theta_r,phi_r,f\n0.5,0,1.2,3.14,0.2\n0,0,1.4,6.2,0.3\n")
    with pytest.raises(InputError, match=r"are these radians.*--angles radians"):
        read_samples(path)
    np.testing.assert_allclose(read_samples(path, Told(angles="radians")).theta_r, [1.2, 1.4])
    np.testing.assert_allclose(np.degrees(read_samples(path, Told(angles="degrees")).theta_r), [1.2, 1.4])


def test_units_that_do_not_go_together_are_asked_about(tmp_path):
    path = write(tmp_path, "theta_i,phi_i,theta_r,phi_r,f\n0.5,0,1.2,180,0.2\n")
    with pytest.raises(InputError, match="azimuths reach 180"):
        read_samples(path)


def test_degrees_are_no_radians(tmp_path):
    path = write(tmp_path, "theta_i,phi_i,theta_r,phi_r,f\n0.5,0,1.2,180,0.2\n30,0,20,90,0.2\n")
    assert len(read_samples(path).value) == 2
    with pytest.raises(InputError, match="no radians"):
        read_samples(path, Told(angles="radians"))


def test_an_all_normal_table_is_not_asked_about(tmp_path):
    assert len(read_samples(write(tmp_path, "theta_i,phi_i,theta_r,phi_r,f\n0,0,0,0,0.2\n")).value) == 1


def test_azimuths_from_the_mirror_side(tmp_path):
    path = write(tmp_path, "theta_i,phi_i,theta_r,phi_r,f\n30,20,40,20,0.2\n30,20,40,110,0.3\n")
    samples = read_samples(path, Told(azimuth="mirror"))
    dphi = pair_angles(samples.incident, samples.exit)[2]
    np.testing.assert_allclose(np.abs(np.degrees(dphi)), [180, 90], atol=1e-9)


@pytest.mark.parametrize(("side", "dphi"), [("mirror", [180, 0, 0, 180]), ("lamp", [0, 180, 180, 0])])
def test_scans_in_the_plane_of_incidence(tmp_path, side, dphi):
    """Signed angles alone; the lamp may stand on either side."""
    path = write(tmp_path, "theta_i,theta_r,f\n30,20,3\n30,-20,1\n-30,20,1\n-30,-20,3\n")
    with pytest.raises(InputError, match=r"same sign as theta_i.*mirror side"):
        read_samples(path)
    samples = read_samples(path, Told(azimuth=side))
    found = np.degrees(np.abs(pair_angles(samples.incident, samples.exit)[2]))
    np.testing.assert_allclose(found, dphi, atol=1e-9)
    np.testing.assert_allclose(np.degrees(samples.theta_r), 20)


def test_at_normal_incidence_no_side_is_asked_for(tmp_path):
    assert len(read_samples(write(tmp_path, "theta_i,theta_r,f\n0,20,3\n0,-20,1\n")).value) == 2


def test_quantities_are_brought_to_f():
    """Each from its definition; all of a Lambertian surface of albedo a are a / pi."""
    theta_i, theta_r = np.radians([0.0, 30.0, 60.0]), np.radians([70.0, 10.0, 45.0])
    f = 0.4 / np.pi
    said = {
        "brdf": f,
        "brdf-cos": f * np.cos(theta_r),
        "brdf-cos-incident": f * np.cos(theta_i),
        "brdf-cos-cos": f * np.cos(theta_i) * np.cos(theta_r),
        "reflectance-factor": 0.4,
        "percent": 40.0,
    }
    assert set(said) == set(QUANTITIES)
    for quantity, value in said.items():
        np.testing.assert_allclose(value / per_brdf(quantity, theta_i, theta_r), f, rtol=1e-14)


def test_at_the_horizon_a_cosine_says_nothing(tmp_path):
    path = write(tmp_path, "theta_i,phi_i,theta_r,phi_r,f\n30,0,90,0,0\n30,0,60,0,0.1\n")
    samples = read_samples(path, Told(quantity="brdf-cos"))
    np.testing.assert_allclose(samples.value, [[0.2]])
    assert samples.left_out == 1 and "line 2" in samples.warnings[0]


@present
@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("radians", Told(angles="radians")),
        ("percent-of-white", Told(quantity="percent")),
        ("times-cosine", Told(quantity="brdf-cos")),
        ("azimuth-from-mirror-side", Told(azimuth="mirror")),
    ],
)
def test_the_cases_told_rightly_are_the_plain_table(name, told):
    plain, other = read_samples(CASES / "plain.csv"), read_samples(CASES / f"{name}.csv", told)
    at, right = (pair_angles(table.incident, table.exit) for table in (other, plain))
    np.testing.assert_allclose(at[:2], right[:2], atol=1e-5)
    off = np.minimum(np.sin(at[0]), np.sin(at[1])) * (
        np.abs(at[2]) - np.abs(right[2])
    )  # azimuths at the pole
    np.testing.assert_allclose(off, 0.0, atol=1e-5)
    np.testing.assert_allclose(other.value, plain.value, rtol=2e-5)  # six digits are written


def test_azimuths_in_radians_beside_degrees_are_asked_about(tmp_path):
    """Which of the two is meant nobody can tell: refused, unless the unit is said."""
    rows = [
        f"{i},0,{r},{p:.4f},0.1" for i in (0, 30, 60) for r in (10, 40, 70) for p in (0.0, 1.5708, 3.1416)
    ]
    path = tmp_path / "mixed.csv"
    path.write_text("\n".join(["theta_i,phi_i,theta_r,phi_r,value", *rows]))
    with pytest.raises(InputError, match="azimuths in radians"):
        read_samples(path)
    assert len(read_samples(path, Told(angles="degrees")).value) == len(rows)


@pytest.mark.parametrize("azimuths", [(0, 100, 390), (0, 100, 200), (-200, 50, 200)])
def test_gradians_are_asked_about_and_read(tmp_path, azimuths):
    path = tmp_path / "gradians.csv"
    rows = [f"50,0,{10 * k},{azimuth},0.2" for k, azimuth in enumerate(azimuths, 1)]
    path.write_text("theta_i,phi_i,theta_r,phi_r,value\n" + "\n".join(rows))
    with pytest.raises(InputError, match=r"are these gradians.*--angles gradians"):
        read_samples(path)
    np.testing.assert_allclose(np.degrees(read_samples(path, Told(angles="gradians")).theta_i), 45.0)
    assert len(read_samples(path, Told(angles="degrees")).value) == 3


@pytest.mark.parametrize("count", [4, 8, 16])
@pytest.mark.parametrize("first", [0, -200])
def test_even_steps_that_close_at_400_are_gradians(tmp_path, count, first):
    path = tmp_path / "gradians.csv"
    azimuths = first + 400.0 / count * np.arange(count)
    rows = [f"50,0,{r},{azimuth:.6g},0.2" for r in (30, 80) for azimuth in azimuths]
    path.write_text("theta_i,phi_i,theta_r,phi_r,value\n" + "\n".join(rows))
    with pytest.raises(InputError, match=r"are these gradians"):
        read_samples(path)
    path.write_text("theta_i,phi_i,theta_r,phi_r,value\n" + "\n".join(rows[:-count] + rows[: count - 1]))
    assert len(read_samples(path, Told(angles="degrees")).value)


@pytest.mark.parametrize("azimuths", [(0, 90, 180, 270), (0, 100), (0, 40, 80, 120, 160, 200, 240, 280, 320)])
def test_azimuths_of_degrees_are_no_gradians(tmp_path, azimuths):
    path = tmp_path / "degrees.csv"
    rows = [f"50,0,{r},{azimuth},0.2" for r in (30, 80) for azimuth in azimuths]
    path.write_text("theta_i,phi_i,theta_r,phi_r,value\n" + "\n".join(rows))
    assert len(read_samples(path).value) == 2 * len(azimuths)


def test_azimuths_of_a_lamp_that_goes_around_are_no_gradians(tmp_path):
    path = tmp_path / "turned.csv"
    path.write_text("theta_i,phi_i,theta_r,phi_r,value\n40,0,30,10,0.2\n40,200,30,390,0.2\n")
    assert len(read_samples(path).value) == 2


@pytest.mark.parametrize("name", ["theta_i", "theta_r"])
def test_elevations_are_asked_about(tmp_path, name):
    path = tmp_path / "elevations.csv"
    angles = {"theta_i": (0, 30, 60), "theta_r": (0, 30, 60)} | {name: (90, 60, 30)}
    rows = [f"{i},0,{r},180,0.2" for i, r in zip(*angles.values(), strict=True)]
    path.write_text("theta_i,phi_i,theta_r,phi_r,value\n" + "\n".join(rows))
    with pytest.raises(InputError, match=rf"{name} is between 30 and 90.*are these elevations"):
        read_samples(path)
    assert len(read_samples(path, Told(angles="degrees")).value) == 3
    path.write_text(path.read_text() + "\n0,0,0,180,0.2")
    assert len(read_samples(path).value) == 4


@pytest.mark.parametrize("unit", ["degrees", "radians"])
def test_elevations_named_so_count_from_the_surface(tmp_path, unit):
    scale = 1.0 if unit == "degrees" else np.pi / 180.0
    path = tmp_path / "elevations.csv"
    rows = [f"{scale * e},0,{scale * (90.0 - e)},{scale * 180.0},0.2" for e in (90.0, 65.0, 35.0)]
    path.write_text("el_i,az_i,theta_r,az_r,value\n" + "\n".join(rows))
    samples = read_samples(path, Told(angles=unit))
    np.testing.assert_allclose(np.degrees(samples.theta_i), [0.0, 25.0, 55.0], atol=1e-9)
    np.testing.assert_allclose(np.degrees(samples.theta_r), [0.0, 25.0, 55.0], atol=1e-9)
    assert any("taken from 90 degrees: el_i" in note for note in samples.notes)


def grid_of(tmp_path, polar, azimuth, unit=(1.0, 1.0, 1.0, 1.0)):
    rows = [(i, 0.0, r, p) for i in polar for r in polar for p in azimuth]
    lines = [",".join(f"{a / u:.6g}" for a, u in zip(row, unit, strict=True)) + ",0.2" for row in rows]
    return write(tmp_path, "theta_i,phi_i,theta_r,phi_r,f\n" + "\n".join(lines) + "\n"), np.radians(rows)


@pytest.mark.parametrize("unit", [(0.9, 1, 0.9, 1), (1, 1, 0.9, 1), (57.29578, 1, 1, 1), (1, 1, 57.29578, 1),
                                  (1, 1, 1, 0.9), (1, 1, 1, 57.29578), (0.9, 1, 0.9, 0.9)])  # fmt: skip
def test_each_angle_may_have_its_own_unit_and_an_odd_one_is_asked_about(tmp_path, unit):
    path, angles = grid_of(tmp_path, (10, 20, 30, 45, 60), range(0, 360, 45), unit)
    with pytest.raises(InputError, match=r"radians|gradians"):
        read_samples(path)
    names = {1: "degrees", 0.9: "gradians", 57.29578: "radians"}
    columns = ("theta_i", "phi_i", "theta_r", "phi_r")
    told = ",".join(f"{name}={names[one]}" for name, one in zip(columns, unit, strict=True))
    found = read_samples(path, Told(angles=told))
    np.testing.assert_allclose(np.column_stack([found.theta_r, found.phi_r]), angles[:, 2:], atol=1e-5)
    np.testing.assert_allclose(found.theta_i, angles[:, 0], atol=1e-5)
    with pytest.raises(InputError, match="theta=UNIT"):
        read_samples(path, Told(angles="theta=turns"))


def test_the_words_of_theta_and_phi_stand_for_both_columns():
    assert Told(angles="theta=degrees,phi=gradians").units() == {
        "theta_i": "degrees", "theta_r": "degrees", "phi_i": "gradians", "phi_r": "gradians"
    }  # fmt: skip
    assert Told().units() == {}


def test_small_even_incidences_are_degrees(tmp_path):
    path, angles = grid_of(tmp_path, (0.5, 1.0, 30, 60), (0, 90, 180))
    np.testing.assert_allclose(read_samples(path).theta_i, angles[:, 0])
    path = write(
        tmp_path, "theta_i,phi_i,theta_r,phi_r,f\n" + "".join(f"1,0,{r},180,0.2\n" for r in range(10, 70, 10))
    )
    assert len(read_samples(path).value) == 6
