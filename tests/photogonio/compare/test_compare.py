"""Comparing files of BRDFs: what is read, matched and refused, and what the eye would see."""

from __future__ import annotations

import json

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.cli import main
from photogonio.compare.appearance import appearance
from photogonio.compare.compare import compare
from photogonio.compare.known import Known
from photogonio.compare.metrics import directional_albedo
from photogonio.compare.reflectances import load_known
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.merl import bin_values, write_merl
from photogonio.synthetic.brdf.library import make_brdf

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
    write_merl(files / "m.binary", bin_values(brdf))
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


@pytest.mark.parametrize("isotropic", [True, False])
def test_two_lambertians_by_closed_form(isotropic):
    """f = a / pi against g = b / pi: every measure is an integral over a cap that has a closed form."""
    a, b, mask = np.array([0.8, 0.3]), np.array([0.5, 0.4]), np.radians(70.0)
    one, two = (
        Known(name, ("X", "Y"), isotropic=isotropic, evaluate=lambertian(*albedo, channels=("X", "Y")))
        for name, albedo in (("a", a), ("b", b))
    )
    found = compare(one, two, mask=mask).measures
    f, g, c = a / np.pi, b / np.pi, np.cos(mask)
    mean_square = (1 - c**3) / (3 * (1 - c))  # of cos over the cap
    mean_root = 3 * (1 - c ** (5 / 3)) / (5 * (1 - c))  # of cos^(2/3)
    u = np.linspace(c, 1.0, 100_001)[:, None]
    mean_log = np.trapezoid((np.log1p(f * u) - np.log1p(g * u)) ** 2, u, axis=0) / (1 - c)
    expected = {
        "relative_l2": np.abs(a - b) / b,
        "ngan_l2": np.abs(f - g) * np.sqrt(mean_square),
        "standard_log": np.sqrt(mean_log),
        "cube_root": np.abs(np.cbrt(f) - np.cbrt(g)) * np.sqrt(mean_root),
        "maximum": np.abs(f - g),
        "albedo_error": np.abs(a - b),
        "negative_fraction": np.zeros(2),
        "reciprocity_residual": np.zeros(2),
    }
    for name, value in expected.items():
        np.testing.assert_allclose(found[name], value, rtol=1e-7, atol=1e-12, err_msg=name)


def test_glossy_models_against_plain_sampling():
    """Plastic against satin paint: each measure as its formula over directions drawn evenly from the caps."""
    one, two = make_brdf("plastic"), make_brdf("satin-paint")
    mask, n = np.radians(80.0), 400_000
    rng = np.random.default_rng(2)
    cos, phi = rng.uniform(np.cos(mask), 1.0, (2, n)), rng.uniform(0, 2 * np.pi, (2, n))
    sin = np.sqrt(1 - cos**2)
    i, r = np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], axis=-1)
    f, g, cos_i, cos_r = one(i, r)[:, 0], two(i, r)[:, 0], cos[0], cos[1]
    samples = {
        "ngan_l2": ((f - g) * cos_i) ** 2,
        "standard_log": (np.log(1 + f * cos_i) - np.log(1 + g * cos_i)) ** 2,
        "cube_root": ((f * cos_i) ** (1 / 3) - (g * cos_i) ** (1 / 3)) ** 2,
    }
    names = ("R", "G", "B")
    found = compare(
        Known("a", names, isotropic=True, evaluate=one),
        Known("b", names, isotropic=True, evaluate=two),
        mask=mask,
    ).measures
    for name, values in samples.items():
        expected, error = values.mean(), values.std() / np.sqrt(n)
        assert found[name][0] ** 2 == pytest.approx(expected, abs=4 * error + 5e-3 * expected), name
    w = cos_i * cos_r
    parts = np.stack([w * (f - g) ** 2, w * g**2])
    ratio = parts[0].mean() / parts[1].mean()
    error = np.sqrt(np.sum((parts.std(1) / parts.mean(1)) ** 2) / n) * ratio
    assert found["relative_l2"][0] ** 2 == pytest.approx(ratio, abs=4 * error + 5e-3 * ratio)
    # light from 45 degrees, exits drawn with the cosine: the albedo is pi times the mean
    up, turn = np.sqrt(rng.uniform(0, 1, n)), rng.uniform(0, 2 * np.pi, n)
    exits = np.stack([np.sqrt(1 - up**2) * np.cos(turn), np.sqrt(1 - up**2) * np.sin(turn), up], axis=-1)
    values = np.pi * one(np.array([np.sin(np.pi / 4), 0.0, np.cos(np.pi / 4)]), exits)[:, 0]
    albedo = directional_albedo(one, np.array([np.pi / 4]))[0, 0]
    assert albedo == pytest.approx(values.mean(), abs=4 * values.std() / np.sqrt(n))


def test_the_correlation_told_is_that_of_the_scatter():
    glossy = Known("m", ("R", "G", "B"), isotropic=True, evaluate=make_brdf("plastic"))
    assert compare(glossy, glossy, mask=MASK).measures["correlation"] == pytest.approx(1.0)
    other = Known("n", ("R", "G", "B"), isotropic=True, evaluate=make_brdf("satin-paint"))
    both = compare(glossy, other, mask=MASK)
    for k in range(3):
        expected = np.corrcoef(both.a[:, k], both.b[:, k])[0, 1]
        assert both.measures["correlation"][k] == pytest.approx(expected, rel=1e-9)


def test_a_table_that_shares_one_channel_is_compared_in_it(tmp_path):
    """A and B against B, G and R: not as many, and in other places."""
    rows = [(i, r, p) for i in (10, 30, 50) for r in (0, 20, 40) for p in (0, 90)]
    lines = "".join(f"{i},0,{r},{p},.3,.2\n" for i, r, p in rows)
    (tmp_path / "one.csv").write_text("theta_i,phi_i,theta_r,phi_r,A,B\n" + lines)
    one = load_known(tmp_path / "one.csv")
    brdf = Known(
        "m", ("B", "G", "R"), isotropic=True, evaluate=lambertian(0.3, 0.2, 0.1, channels=("B", "G", "R"))
    )
    found = compare(one, brdf)
    assert found.channels == ("B",) and len(found.a) == len(rows)
    np.testing.assert_allclose(found.a, 0.2)
    np.testing.assert_allclose(found.b, 0.3 / np.pi)
