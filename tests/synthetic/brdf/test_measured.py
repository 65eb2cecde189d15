"""BRDFs from files: coefficient files, MERL cubes, tables."""

import json

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.synthetic.brdf.expansion import hemisphere_mode, isotropic_mode
from photogonio.synthetic.brdf.files import MERL_SCALE, MERL_SHAPE, read_brdf
from photogonio.synthetic.brdf.library import angle_grid, directions, make_brdf, on_grid
from photogonio.synthetic.brdf.reflectance import PairAngles
from photogonio.synthetic.render.world import brdf_from


def hemisphere(polar: int, turns: int) -> tuple[np.ndarray, np.ndarray]:
    node, weight = np.polynomial.legendre.leggauss(polar)
    theta, phi = np.meshgrid(np.arccos(0.5 * (node + 1)), np.arange(turns) * 2 * np.pi / turns, indexing="ij")
    return directions(theta.ravel(), phi.ravel()), np.repeat(0.5 * weight * 2 * np.pi / turns, turns)


def coefficient_file(path, **changes):
    data = {"format": "surface-scattering-modes", "version": 1, "quantity": "brdf", "symmetry": "isotropic"}
    data |= {"order": 0, "channels": ["Y"], "modes": [[0, 0, 0]], "coefficients": [[2.0]], **changes}
    path.write_text(json.dumps(data))
    return path


def test_first_isotropic_modes_are_the_printed_ones():
    i, r = np.meshgrid([0.2, 0.9, 1.3], [0.1, 0.7, 1.5])
    i, r, d = i.ravel(), r.ravel(), np.linspace(0.1, 3.0, 9)
    pairs = PairAngles(directions(i, np.zeros(9)), directions(r, d))
    printed = {
        (0, 0, 0): 1 / np.pi / 2,
        (1, 1, 1): 4 / np.pi * np.sin(i / 2) * np.sin(r / 2) * np.cos(d) / np.sqrt(2),
        (2, 0, 0): np.sqrt(3) / np.pi * (1 - np.cos(i) - np.cos(r)) / np.sqrt(2),
        (2, 2, 0): 3 / np.pi * (1 - 2 * np.cos(i)) * (1 - 2 * np.cos(r)) / 2,
        (2, 2, 2): 3 / np.pi * (1 - np.cos(i)) * (1 - np.cos(r)) * np.cos(2 * d) / np.sqrt(2),
    }
    for mode, expected in printed.items():
        assert isotropic_mode(*mode, pairs) == pytest.approx(np.broadcast_to(expected, 9), abs=1e-13)


def test_hemisphere_modes_are_orthonormal():
    place, weight = hemisphere(24, 40)
    modes = [(n, az) for n in range(7) for az in range(-n, n + 1, 2)]
    values = np.stack([hemisphere_mode(n, az, place) for n, az in modes])
    assert (values * weight) @ values.T == pytest.approx(np.eye(len(modes)), abs=1e-12)


def test_lambert_is_the_first_mode_alone(tmp_path):
    brdf = read_brdf(coefficient_file(tmp_path / "c.json"))
    assert on_grid(brdf, angle_grid(15.0)) == pytest.approx(1 / np.pi, rel=1e-14)


def test_quantities_are_divided_by_their_cosines(tmp_path):
    grid = angle_grid(15.0)
    for quantity, expected in (
        ("brdf_cos", 1 / np.cos(grid[:, 0])),
        ("brdf_cos_cos", 1 / np.cos(grid[:, 0]) / np.cos(grid[:, 1])),
    ):
        brdf = read_brdf(coefficient_file(tmp_path / "c.json", quantity=quantity))
        assert on_grid(brdf, grid)[:, 0] == pytest.approx(expected / np.pi, rel=1e-12)


def test_lobe_of_a_file_is_the_ggx_of_the_library(tmp_path):
    lobe = {"model": "ggx", "roughness": 0.3, "f0": [0.2], "weight": [0.5]}
    brdf = read_brdf(coefficient_file(tmp_path / "c.json", coefficients=[[0.0]], lobes=[lobe]))
    metal = make_brdf("ggx-conductor", {"f0": (0.2,), "roughness": 0.3})
    grid = angle_grid(15.0)
    assert on_grid(brdf, grid) == pytest.approx(0.5 * on_grid(metal, grid), rel=1e-12)


def test_general_modes_follow_their_symmetry(tmp_path):
    place = np.random.default_rng(1).normal(size=(2, 50, 3))
    place[..., 2] = np.abs(place[..., 2])
    i, r = place / np.linalg.norm(place, axis=-1, keepdims=True)
    modes = {"modes": [[2, 0, 1, 1]], "coefficients": [[1.0]]}
    one_way = read_brdf(coefficient_file(tmp_path / "g.json", symmetry="general", **modes))
    both = read_brdf(coefficient_file(tmp_path / "r.json", symmetry="reciprocal", **modes))
    assert both(i, r) == pytest.approx((one_way(i, r) + one_way(r, i)) / np.sqrt(2), abs=1e-13)
    assert one_way(i, r)[:, 0] == pytest.approx(
        hemisphere_mode(2, 0, i) * hemisphere_mode(1, 1, r), abs=1e-13
    )


def merl_directions(theta_h, theta_d, phi_d):
    """Incident and exit of Rusinkiewicz's angles, by rotation, with phi_h = 0."""
    d = directions(theta_d, phi_d)
    cos, sin = np.cos(theta_h), np.sin(theta_h)
    incident = np.stack(
        [cos * d[..., 0] + sin * d[..., 2], d[..., 1], -sin * d[..., 0] + cos * d[..., 2]], axis=-1
    )
    half = np.stack([sin, np.zeros_like(sin), cos], axis=-1)
    return incident, 2 * np.sum(incident * half, axis=-1, keepdims=True) * half - incident


def test_merl_cube_of_a_known_model_comes_back(tmp_path):
    model = make_brdf("plastic", {"roughness": 0.5})
    h, d, p = (np.arange(n) + 0.5 for n in MERL_SHAPE)
    theta_h, theta_d, phi_d = np.meshgrid(
        (h / 90) ** 2 * np.pi / 2, np.radians(d), np.radians(p), indexing="ij"
    )
    cube = model(*merl_directions(theta_h, theta_d, phi_d))
    raw = np.moveaxis(cube, -1, 0) / np.array(MERL_SCALE)[:, None, None, None]
    path = tmp_path / "plastic.binary"
    path.write_bytes(np.array(MERL_SHAPE, "<i4").tobytes() + raw.astype("<f8").tobytes())
    grid = angle_grid()
    grid = grid[(grid[:, :2] < np.radians(60)).all(axis=1)]  # beyond, cells straddle the horizon
    # interpolation over one-degree cells of a lobe of 0.5 rad: second differences about (1/57)^2 / 8 / 0.25
    assert on_grid(read_brdf(path), grid) == pytest.approx(on_grid(model, grid), rel=2e-3)
    path.write_bytes(path.read_bytes()[:-8])
    with pytest.raises(InputError, match="MERL"):
        read_brdf(path)


def test_grid_file_returns_its_own_values(tmp_path):
    grid = angle_grid(10.0)
    values = on_grid(make_brdf("oren-nayar"), grid)
    np.savez(tmp_path / "t.npz", grid=grid, brdf=values)
    assert on_grid(read_brdf(tmp_path / "t.npz"), grid) == pytest.approx(
        values, rel=1e-8
    )  # axes are rounded to 1e-9


def test_scattered_table_is_read_with_mapped_columns(tmp_path):
    """Rows at random angles of a smooth BRDF; negative theta_i lies on the other side."""
    model, random = make_brdf("oren-nayar", {"sigma": 0.2}), np.random.default_rng(2)
    angles = random.uniform([0, 0, 0], [1.4, 1.4, np.pi], size=(4000, 3))
    values = on_grid(model, angles)[:, 0]
    degrees = np.degrees(angles)
    lines = ["band,ti,pi,tr,pr,f"]
    for (ti, tr, dphi), f in zip(degrees, values, strict=True):
        lines.append(f"1,{-ti:.9f},0,{tr:.9f},{180 + dphi:.9f},{f:.12g}")
    lines.append("2,10,0,10,0,99")
    path = tmp_path / "t.csv"
    path.write_text("\n".join(lines))
    names = {"theta_i": "ti", "phi_i": "pi", "theta_r": "tr", "phi_r": "pr", "value": "f"}
    table = read_brdf(path, columns=names, select={"band": 1})
    assert on_grid(table, angles[:200])[:, 0] == pytest.approx(values[:200], rel=1e-6)
    between = angle_grid(10.0)
    between = between[(between[:, :2] < 1.2).all(axis=1)]
    error = np.abs(on_grid(table, between) / on_grid(model, between)[:, :1] - 1)
    assert np.median(error) < 0.002 and error.max() < 0.05  # rows are some five degrees apart


def test_bad_files_are_one_clear_line(tmp_path):
    for name, text in (("a.json", "{}"), ("b.csv", "x,y\n1,2\n"), ("c.txt", "")):
        (tmp_path / name).write_text(text)
        with pytest.raises(InputError, match=name):
            read_brdf(tmp_path / name)
    with pytest.raises(InputError, match="no such file"):
        read_brdf(tmp_path / "none.json")


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.csv", "", "a line of headers"),
        ("a.csv", "theta_i,phi_i,theta_r,phi_r,value\n# nothing yet\n", "a line of headers"),
        ("a.csv", "theta_i,phi_i,theta_r,phi_r,value\n10,0,x,0,1\n", "not a table of numbers"),
        ("a.npz", "no", "arrays `grid` and `brdf`"),
        ("a.json", "[1]", "not a coefficient file"),
        ("a.binary", "no", "not a MERL file"),
        ("a.txt", "", "expected a file"),
    ],
)
def test_files_that_hold_no_brdf_are_refused(tmp_path, name, text, says):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=says) as caught:
        read_brdf(tmp_path / name)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("described", "says"),
    [
        ({"file": "a.csv", "colums": {}}, "unknown key 'colums'"),
        ({"file": "a.csv", "columns": "R"}, "columns: expected a table"),
        ({"file": "a.csv", "columns": {"value": "R+G"}}, "has 2 channels"),
        ({"file": "a.csv", "columns": {"value": "R"}, "where": {"G": 7}}, "no row has the values"),
        ({"model": "lambert", "albedo": [0.5, 0.5]}, "has 2 channels"),
        ({"model": "lambert", "albedo": -0.5}, "albedo: expected 0 or more"),
    ],
)
def test_what_a_scene_asks_of_a_brdf_is_checked(tmp_path, described, says):
    rows = [f"{t},0,{u},40,0.1,0.2,0.3" for t in (5, 30, 60) for u in (10, 50, 70)]
    (tmp_path / "a.csv").write_text("theta_i,phi_i,theta_r,phi_r,R,G,B\n" + "\n".join(rows))
    with pytest.raises(InputError, match=says):
        brdf_from(described, tmp_path, "scene: brdf")
