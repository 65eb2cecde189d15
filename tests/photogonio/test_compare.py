"""Comparing files of BRDFs: what is read, matched and refused, and what the eye would see."""

from __future__ import annotations

import json

import numpy as np
import pytest

from capture.errors import InputError
from photogonio.appearance import appearance
from photogonio.cli import main
from photogonio.compare import compare
from photogonio.reflectances import Known, load_known
from reconstruct.brdf import Brdf
from reconstruct.merl import write_merl

MASK = np.radians(80.0)


def lambertian(*albedo: float, channels=("R", "G", "B")) -> Brdf:
    """The first mode is 1 / pi over the hemispheres' norm: S000 = 1 / (2 pi) with its c = 2."""
    modes = np.array([[0, 0, 0]])
    unit = Brdf(0, channels, modes, np.ones((1, len(albedo))), np.zeros((1, len(albedo))))
    value = unit.evaluate(0.3, 0.0, 0.4, 1.0)
    scale = np.array(albedo) / np.pi / value
    return Brdf(0, channels, modes, scale[None], np.zeros((1, len(albedo))))


@pytest.fixture
def files(tmp_path):
    lambertian(0.8, 0.5, 0.2).save(tmp_path / "a.json")
    lambertian(0.4, 0.5, 0.1).save(tmp_path / "b.json")
    return tmp_path


def test_two_coefficient_files(files):
    found = compare(load_known(files / "a.json"), load_known(files / "b.json"), mask=MASK)
    np.testing.assert_allclose(found.measures["relative_l2"], [1, 0, 1], atol=1e-12)
    np.testing.assert_allclose(found.measures["albedo_error"], [0.4, 0, 0.1], atol=1e-12)
    np.testing.assert_allclose(found.measures["maximum"], np.array([0.4, 0, 0.1]) / np.pi, atol=1e-12)
    np.testing.assert_allclose(found.measures["negative_fraction"], 0)


def test_scale_takes_out_one_factor_a_channel(files):
    found = compare(load_known(files / "a.json"), load_known(files / "b.json"), mask=MASK, scale=True)
    np.testing.assert_allclose(found.scale, [0.5, 1, 0.5], rtol=1e-12)
    np.testing.assert_allclose(found.measures["relative_l2"], 0, atol=1e-12)


def test_a_grid_is_compared_at_its_own_points_below_the_mask(files):
    angles = np.radians(np.arange(0.0, 90.0, 10.0))
    grid = np.stack(np.meshgrid(angles, angles, np.radians([0.0, 90.0, 180.0]), indexing="ij"), -1).reshape(
        -1, 3
    )
    value = np.tile(np.array([0.4, 0.5, 0.1]) / np.pi, (len(grid), 1))
    value[grid[:, 0] > np.radians(65)] = 100.0  # must not count
    np.savez(files / "truth.npz", grid=grid, brdf=value)
    found = compare(load_known(files / "a.json"), load_known(files / "truth.npz"), mask=np.radians(70.0))
    assert found.at.cos_i.min() > np.cos(np.radians(65.0))
    np.testing.assert_allclose(found.measures["relative_l2"], [1, 0, 1], atol=1e-9)
    assert found.appearance is None


def test_merl_and_csv_and_folders(files, capsys):
    brdf = lambertian(0.4, 0.5, 0.1)
    write_merl(files / "m.binary", brdf)
    (files / "t.csv").write_text(
        "theta_i,phi_i,theta_r,phi_r,R,G,B\n"
        + "\n".join(f"{t},0,30,50,{0.4 / np.pi},{0.5 / np.pi},{0.1 / np.pi}" for t in (0, 20, 50))
    )
    (files / "out").mkdir()
    brdf.save(files / "out/coefficients.json")
    for other in ("m.binary", "t.csv", "out"):
        assert main(["compare", str(files / other), str(files / "b.json"), "--json", "--quiet"]) == 0
        numbers = json.loads(capsys.readouterr().out)
        np.testing.assert_allclose(numbers["relative_l2"], 0, atol=1e-6)


def test_channels_match_by_name_then_by_place(files):
    swapped = lambertian(0.2, 0.8, 0.5, channels=("B", "R", "G"))
    a = load_known(files / "a.json")
    b = Known("b", swapped.channels, isotropic=True, evaluate=swapped)
    np.testing.assert_allclose(compare(a, b, mask=MASK).measures["relative_l2"], 0, atol=1e-12)
    one = Known("one", ("Y",), isotropic=True, evaluate=lambertian(0.5, channels=("Y",)))
    np.testing.assert_allclose(compare(a, one, mask=MASK).measures["relative_l2"], [0.6, 0, 0.6], atol=1e-12)
    two = Known("two", ("X", "Z"), isotropic=True, evaluate=lambertian(1, 1, channels=("X", "Z")))
    with pytest.raises(InputError, match="are not those of"):
        compare(a, two, mask=MASK)


@pytest.mark.parametrize(
    ("name", "text"),
    [("x.json", "{"), ("x.json", "[1]"), ("x.npz", ""), ("x.binary", ""), ("x.txt", ""), ("x.csv", "")],
)
def test_what_is_no_brdf_is_refused(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError):
        load_known(tmp_path / name)


def test_equal_brdfs_look_equal_and_brighter_ones_differ():
    brdf = lambertian(0.4, 0.5, 0.1)
    same = appearance(brdf, brdf, brdf.channels).to_dict()
    assert same["psnr"] == np.inf
    assert same["delta_e_itp_95"] == same["delta_e_2000_95"] == 0
    little, much = (
        appearance(lambertian(*(np.array([0.4, 0.5, 0.1]) * k)), brdf, brdf.channels) for k in (1.01, 1.2)
    )
    assert 0 < little.to_dict()["delta_e_itp_mean"] < much.to_dict()["delta_e_itp_mean"]
    assert little.psnr > much.psnr
    # 1 % of luminance is about one just noticeable difference, which Delta E ITP calls 1
    assert 0.2 < little.to_dict()["delta_e_itp_95"] < 2


def test_pictures_and_numbers_are_written_together(files):
    out = files / "comparison"
    assert main(["compare", str(files / "a.json"), str(files / "b.json"), "--quiet", "-o", str(out)]) == 0
    assert sorted(path.name for path in out.iterdir()) == ["balls.png", "comparison.json", "scatter.png"]
    assert json.loads((out / "comparison.json").read_text())["source"]["inputs"].keys() == {
        "a.json",
        "b.json",
    }
