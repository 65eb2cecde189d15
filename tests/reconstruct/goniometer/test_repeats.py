"""Several values at the same directions: wavelengths below one another, or measurements made again."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.goniometer.repeats import pair_numbers
from photogonio.reconstruct.goniometer.told import Told
from tests.places import SHARED

TWO = SHARED / "cases/two-wavelengths.csv"
ANGLES = [(ti, tr, p) for ti in (0, 30, 60) for tr in (0, 20, 40, 60) for p in (0, 90, 180)]


def long_table(tmp_path, header: str, factors: dict[str, float], noise: float = 0.01):
    rng = np.random.default_rng(1)
    lines = [f"theta_i,phi_i,theta_r,phi_r,{header},f"]
    for label, factor in factors.items():
        lines += [f"{i},0,{r},{p},{label},{factor * (1 + noise * rng.normal()):.5f}" for i, r, p in ANGLES]
    path = tmp_path / "long.csv"
    path.write_text("\n".join(lines))
    return path


@pytest.mark.parametrize("header", ["wavelength_nm", "lambda", "band", "sample", "polarization"])
def test_rows_that_a_column_tells_apart_are_asked_about(tmp_path, header):
    path = long_table(tmp_path, header, {"450": 0.1, "650": 0.3})
    told = Told(columns={"value": "f"})
    with pytest.raises(InputError, match=f"--where {header}=450.*--channel-by {header}"):
        read_samples(path, told)
    chosen = read_samples(path, Told(columns={"value": "f"}, where=((header, "650"),)))
    assert len(chosen.value) == len(ANGLES) and abs(np.median(chosen.value) - 0.3) < 0.01


def test_wavelengths_are_asked_about_even_of_a_grey_surface(tmp_path):
    with pytest.raises(InputError, match="--channel-by wavelength"):
        read_samples(long_table(tmp_path, "wavelength", {"450": 0.1, "650": 0.1}))


@pytest.mark.parametrize("header", ["run", "temperature", "sample"])
def test_measurements_made_again_are_not(tmp_path, header):
    path = long_table(tmp_path, header, {"1": 0.1, "2": 0.1})
    assert len(read_samples(path).value) == 2 * len(ANGLES)


@pytest.mark.parametrize("header", ["temperature", "sigma"])
@pytest.mark.parametrize("mixed", [False, True])
def test_values_a_factor_apart_are_refused_though_no_column_tells_them_apart(tmp_path, header, mixed):
    alike = ("0.02", "0.020") if header == "sigma" else ("20", "20.0")
    path = long_table(tmp_path, header, dict(zip(alike, (0.1, 0.3), strict=True)))
    lines = path.read_text().splitlines()
    if mixed:
        lines[1:] = np.random.default_rng(2).permutation(lines[1:])
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"come with several values.*no column tells them apart"):
        read_samples(path, Told(columns={"value": "f"}))


@pytest.mark.parametrize("noise", [0.03, 0.2])
def test_noise_of_measurements_made_again_is_none_such(tmp_path, noise):
    path = long_table(tmp_path, "run", {"1": 0.1, "2": 0.1}, noise)
    assert len(read_samples(path, Told(columns={"value": "f"})).value) == 2 * len(ANGLES)


@pytest.mark.parametrize("labels", [("450", "650"), ("blue", "red")])
def test_each_value_of_a_column_becomes_a_channel(tmp_path, labels):
    path = long_table(tmp_path, "band", dict(zip(labels, (0.1, 0.3), strict=True)), noise=0.0)
    samples = read_samples(path, Told(channel_by="band"))
    assert samples.channels == labels
    np.testing.assert_allclose(samples.value, np.tile([0.1, 0.3], (len(ANGLES), 1)))
    np.testing.assert_array_equal(samples.line[0], [2, 2 + len(ANGLES)])


def test_a_pair_that_lacks_a_channel_is_left_out_and_counted(tmp_path):
    path = long_table(tmp_path, "band", {"450": 0.1, "650": 0.3})
    path.write_text(path.read_text().rsplit("\n", 2)[0])
    samples = read_samples(path, Told(channel_by="band"))
    assert len(samples.value) == len(ANGLES) - 2
    assert samples.warnings[0].startswith("2 rows left out")


def test_pairs_that_share_nothing_are_refused(tmp_path):
    path = tmp_path / "apart.csv"
    path.write_text("theta_i,phi_i,theta_r,phi_r,nm,f\n10,0,20,0,450,1\n30,0,20,0,650,1\n")
    with pytest.raises(InputError, match="no pair of directions was measured at all of 450, 650"):
        read_samples(path, Told(channel_by="nm"))


def test_pairs_are_the_same_whatever_the_turns():
    theta_i, phi_i = np.array([0.3, 0.3, 0.0, 0.0, 0.3]), np.array([0.0, 2 * np.pi, 1.0, 2.0, 0.1])
    pair = pair_numbers((theta_i, phi_i, np.full(5, 0.5), np.full(5, -np.pi)))
    np.testing.assert_array_equal(pair, [0, 0, 1, 1, 2])


@pytest.mark.skipif(not TWO.exists(), reason="the shared cases are not here")
def test_the_case_of_two_wavelengths():
    with pytest.raises(InputError, match=r"--where wavelength_nm=450.*--channel-by wavelength_nm"):
        read_samples(TWO)
    samples = read_samples(TWO, Told(channel_by="wavelength_nm"))
    assert samples.channels == ("450", "650") and len(samples.value) == 648
    assert abs(np.median(samples.value[:, 1] / samples.value[:, 0]) - 3.0) < 0.01
