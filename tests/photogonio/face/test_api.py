"""The BRDF in Python: docs/api.md runs as it stands, and what its methods give is true."""

from __future__ import annotations

import doctest
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import photogonio as pg
from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.errors import RelativeTable, Uncertain
from photogonio.reconstruct.export import table_grid
from photogonio.reconstruct.lobes.lobe import Lobe
from tests.places import ROOT

GROUND, F0 = np.array([0.35, 0.2, 0.1]), np.full(3, 0.043)


def plastic() -> pg.MeasuredBrdf:
    """Order 0 and a coat, its numbers known to a per cent or so."""
    one = np.ones(3)
    coat = Lobe(0.25, F0, one, "coat", fresnel="dielectric", ground=GROUND)
    names = ("S 0 0 0", "lobe 0 roughness", "lobe 0 f0", "lobe 0 weight", "lobe 0 ground")
    errors = np.array([[5e-4] * 3, [1e-3] * 3, [4e-4] * 3, [1e-9] * 3, [2e-3, 1.5e-3, 1e-3]])
    known = Uncertain(
        names,
        errors,
        np.stack([np.diag(column**2) for column in errors.T]),
        0.005,
        RelativeTable(np.array([45.0]), np.array([45.0]), np.array([90.0]), np.full((1, 1, 1), 0.002)),
    )
    return pg.MeasuredBrdf(
        order=0,
        channels=("R", "G", "B"),
        modes=np.zeros((1, 3), int),
        coefficients=np.array([[0.05, 0.04, 0.03]]),
        standard_errors=errors[:1],
        lobes=(coat,),
        valid={"theta_i_max": 80.0, "theta_r_max": 80.0},
        source={"name": "plastic", "command": "photogonio process plastic"},
        uncertainty=known,
    )


@pytest.fixture(autouse=True)
def short_tables(monkeypatch):
    """Tables of a fifth of the rows: what is asked of them here hangs on no number of rows."""
    monkeypatch.setattr(table_grid, "ROWS", {False: 40_000, True: 60_000})


@pytest.fixture
def here(tmp_path, tiny_set, monkeypatch):
    """A folder with what docs/api.md takes."""
    tiny_set.folder.rename(tmp_path / "my-set")
    (tmp_path / "plastic-brdf").mkdir()
    plastic().save(tmp_path / "plastic-brdf" / "coefficients.json")
    polar, turn = np.arange(10.0, 71.0, 15.0), np.arange(0.0, 181.0, 30.0)
    rows = [f"{i},0,{r},{d},{0.3 / np.pi:.6f}" for i in polar for r in polar for d in turn]
    (tmp_path / "goniometer.csv").write_text("\n".join(["theta_i,phi_i,theta_r,phi_r,Y", *rows]) + "\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_page_runs_as_it_stands(here):
    page = (ROOT / "docs/api.md").read_text(encoding="utf-8")
    test = doctest.DocTestParser().get_doctest(page, {}, "docs/api.md", "docs/api.md", 0)
    assert len(test.examples) > 20
    told: list[str] = []
    # libraries that other tests import set numpy's older way to print
    with np.printoptions(legacy=False):
        doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(test, out=told.append)
    assert not told, "".join(told)


def test_import_is_light():
    code = (
        "import sys, photogonio; print([name for name in ('numpy', 'scipy', 'numba') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_name_of_the_package_is_in_its_stub():
    stub = (ROOT / "photogonio/__init__.pyi").read_text()
    assert {name for name in pg.__all__ if f" as {name}\n" not in stub} == {"__version__"}
    assert all(getattr(pg, name) is not None for name in pg.__all__)
    assert (ROOT / "photogonio/py.typed").is_file()


def test_draws_spread_as_the_covariance_says():
    b = plastic()
    where = np.radians([30.0, 50.0, 150.0])
    spread = np.std([one.angles(*where) for one in b.sample(400, seed=2)], axis=0)
    alone = replace(b, uncertainty=replace(b.uncertainty, scale=0.0, misfit=None))
    # 400 draws know a standard deviation to 3.5 %
    np.testing.assert_allclose(spread, alone.standard_error(*where), rtol=0.1)
    first, second = (b.sample(3, seed=4)[2].lobes[0] for _ in range(2))
    assert first.roughness == second.roughness and first.roughness != b.lobes[0].roughness
    with pytest.raises(InputError, match="how sure"):
        replace(b, uncertainty=None).sample(1)


def test_the_albedos_error_is_that_of_draws_and_of_what_is_beyond():
    b = plastic()
    albedo = b.albedo()
    drawn = np.std([one.bihemispherical_albedo() for one in b.sample(150, seed=1)], axis=0)
    beyond = np.hypot(0.005, 0.002) * albedo.value
    # 150 draws know a standard deviation to 6 %, which is half of the variance
    np.testing.assert_allclose(albedo.error, np.hypot(drawn, beyond), rtol=0.05)
    assert np.isnan(replace(b, uncertainty=None).albedo().error).all()


def test_errors_by_directions_and_by_angles_are_the_same():
    b, t = plastic(), np.radians([20.0, 60.0])
    wi = np.column_stack([np.sin(t), 0.0 * t, np.cos(t)])
    wr = wi * [-1.0, 1.0, 1.0]
    np.testing.assert_allclose(b.standard_error(wi, wr), b.standard_error(t, t, np.pi), rtol=1e-9)
    np.testing.assert_allclose(b(wi, wr), b.angles(t, t, np.pi), rtol=1e-9)
    with pytest.raises(TypeError):
        b.standard_error(t)


@pytest.mark.parametrize("name", ["csv", "merl", "mitsuba", "radiance", "openpbr", "gltf", "modes"])
def test_what_is_exported_is_loaded_again(tmp_path, name):
    from photogonio.reconstruct.export.formats import FORMATS

    path = tmp_path / f"b{FORMATS[name].suffix}"
    b = plastic()
    b.export(name, path)
    again = pg.load(path)
    assert len(repr(again).splitlines()) == 5
    assert "<div" in again._repr_html_() and "<svg" in again._repr_html_()
    if name == "csv":  # at its own pairs exactly, but for what its remark says that rows were lowered by
        lowered = re.search(r"lowered by up to (\S+) %", path.read_text())
        most = 1.05 * float(lowered[1]) / 100.0 if lowered else 1e-6  # the remark has two digits
        assert most < 0.005 and b.compare(again).measures["relative_l2"].max() < most
        assert len(again.plot().axes) > 0
    assert again.angles(0.4, 0.6, 1.0)[0] == pytest.approx(b.angles(0.4, 0.6, 1.0)[:1].mean(), rel=0.7)
    assert (again.angles(0.4, 2.0, 1.0) == 0.0).all()


def test_scatmechs_file_and_one_channel(tmp_path):
    said = plastic().export("scatmech", tmp_path / "s.csv", channel="G", order=8)
    assert "modes to order 8 lose" in said
    assert isinstance(pg.load(tmp_path / "s.csv"), pg.MeasuredBrdf)
    with pytest.raises(InputError, match="channel Q"):
        plastic().export("csv", tmp_path / "c.csv", channel="Q")


def test_tables_of_renderers_are_handed_on_and_ask_for_no_coefficients(tmp_path):
    plastic().export("merl", tmp_path / "m.binary")
    merl = pg.load(tmp_path / "m.binary")
    merl.export("mitsuba", tmp_path / "m.bsdf")
    assert pg.load(tmp_path / "m.bsdf").angles(0.3, 0.5, 1.0) == pytest.approx(
        merl.angles(0.3, 0.5, 1.0), rel=0.05
    )
    assert merl.albedo().value == pytest.approx(plastic().albedo().value, rel=0.03)
    with pytest.raises(InputError, match="holds no coefficients"):
        merl.export("modes", tmp_path / "m.json")


def test_the_card_and_the_lines_are_for_reading():
    b = plastic()
    assert len(repr(b).splitlines()) == 5
    card = b._repr_html_()
    assert "<svg" in card and "data:image/png;base64," in card and len(card) < 60_000
    odd = replace(b, source={"name": "<b>"})
    assert "<b>:" not in odd._repr_html_() and "&lt;b&gt;" in odd._repr_html_()


def test_without_xarray_it_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(ImportError, match=r"pip install .photogonio\[xarray\]"):
        plastic().to_xarray()


def test_arrays_are_labelled():
    xarray = pytest.importorskip("xarray", reason="an optional package")
    b = plastic()
    found = b.to_xarray()
    assert isinstance(found, xarray.Dataset)
    one = found.sel(theta_i=30.0, theta_r=45.0, dphi=90.0)
    angles = np.radians([30.0, 45.0, 90.0])
    np.testing.assert_allclose(one.f.values, b.angles(*angles))
    np.testing.assert_allclose(one.standard_error.values, b.standard_error(*angles))


def test_commands_take_folders_and_whatever_another_wrote(here, capsys):
    from photogonio.cli import main

    assert main(["export", "plastic-brdf", "--format", "merl", "-o", "m.binary"]) == 0
    assert main(["export", "m.binary", "--format", "csv", "-o", "m.csv"]) == 0
    assert main(["show", "plastic-brdf", "-o", "b.svg", "--json"]) == 0
    assert '"model": "order 0 and a coat of roughness 0.25 over a diffuse ground"' in capsys.readouterr().out
    assert main(["show", "m.binary", "-o", "m.png"]) == 0
    assert main(["compare", "plastic-brdf", "m.binary"]) == 0
    assert main(["compare", "m.csv", "plastic-brdf/coefficients.json"]) == 0
    capsys.readouterr()
    assert main(["export", "m.binary", "--format", "modes"]) == 2
    assert "m.binary: holds no coefficients" in capsys.readouterr().err
    assert main(["show", "m.csv"]) == 0
    lines = (here / "m.csv").read_text().splitlines()
    (here / "some.csv").write_text("\n".join(lines[:-1]) + "\n")
    capsys.readouterr()
    assert main(["show", "some.csv"]) == 2
    assert "some.csv: is known at single pairs of directions only" in capsys.readouterr().err
    assert main(["show", "nothing"]) == 2
