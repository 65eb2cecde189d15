"""A result that cannot be physical is never called a success, and a right one is never doubted."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.setup import Light, Setup, ViewSetup
from photogonio.calib.setup_file import save_setup
from photogonio.capture.photoset import Sphere
from photogonio.cli import main
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.lobes.families import blinn_phong_lobe
from photogonio.reconstruct.table.cells import Cells
from photogonio.report.misfit import relative_misfit, shared_misfit
from photogonio.report.trust import (
    DISTRUSTED,
    OF_FITS,
    OF_SETUPS,
    _bright,
    _misfit,
    checks_table,
    setup_faults,
    tops_unseen,
)
from tests.places import ROOT, SHARED

ALBEDO = 0.4
QUICK = ("--order", "2", "--lobes", "none")


def matte_rows(factor: float = 1.0, noise: float = 0.003) -> np.ndarray:
    """Rows (n, 5) of a matte surface of :data:`ALBEDO`, times ``factor``."""
    rng = np.random.default_rng(1)
    angles = np.stack(np.meshgrid([0, 20, 40, 60], [0], [0, 25, 50, 70], [0, 60, 120, 180, 270]), -1).reshape(
        -1, 4
    )
    value = factor * ALBEDO / np.pi * (1.0 + noise * rng.normal(size=len(angles)))
    return np.column_stack([angles, value])


def written(path: Path, rows: np.ndarray) -> Path:
    np.savetxt(path, rows, delimiter=",", header="theta_i,phi_i,theta_r,phi_r,Y", comments="", fmt="%.9g")
    return path


def fitted(capsys, tmp_path: Path, rows: np.ndarray, *options: str) -> tuple[int, dict, str]:
    table = written(tmp_path / "table.csv", rows)
    status = main(["fit", str(table), "-o", str(tmp_path / "out"), *QUICK, "--json", *options])
    out, err = capsys.readouterr()
    return status, json.loads(out), err


def test_a_right_result_is_trusted(capsys, tmp_path):
    status, numbers, err = fitted(capsys, tmp_path, matte_rows())
    assert (status, numbers["trust"]) == (0, {"trusted": True, "codes": [], "faults": []})
    assert "TRUSTED" not in err
    assert DISTRUSTED not in json.loads((tmp_path / "out/coefficients.json").read_text())["fit"]
    assert "not to be trusted" not in (tmp_path / "out/report.html").read_text()


def test_a_header_that_names_another_quantity_is_asked_about_unless_it_is_told(capsys, tmp_path):
    """A dark sample's reflectance factor is no albedo above 1: nothing but the header tells."""
    table = written(tmp_path / "table.csv", matte_rows(0.5))
    table.write_text(table.read_text().replace(",Y", ",BRF"))
    for options, expected in ((), 3), (("--quantity", "brdf"), 0), (("--quantity", "reflectance-factor"), 0):
        assert main(["fit", str(table), "-o", str(tmp_path / "out"), *QUICK, "--json", *options]) == expected
        codes = json.loads(capsys.readouterr().out)["trust"]["codes"]
        assert codes == ["quantity-in-header"] * (expected == 3)


@pytest.mark.parametrize(("factor", "code"), [(100.0 * np.pi, "albedo-above-one"), (-1.0, "negative-albedo")])
def test_an_unphysical_result_is_written_and_every_outcome_says_so(capsys, tmp_path, factor, code):
    status, numbers, err = fitted(capsys, tmp_path, matte_rows(factor))
    assert status == 3
    assert code in numbers["trust"]["codes"]
    assert not numbers["trust"]["trusted"]
    outcome = err[err.index("NOT TO BE TRUSTED") :].splitlines()  # before the result in one sentence
    assert code in outcome[0] or code in outcome[1]
    assert "likeliest cause" in outcome[0]
    page = (tmp_path / "out/report.html").read_text()
    cards = page.partition('<div class="cards">')[2]
    assert cards.strip().startswith('<div class="card alarm"><span>not to be trusted: ')
    said = json.loads((tmp_path / "out/coefficients.json").read_text())["fit"][DISTRUSTED]
    assert said == numbers["trust"]["codes"]


@pytest.mark.parametrize("photos", [True, False])
def test_a_quantity_is_proposed_for_tables_alone(photos):
    """Photos have no option that says what their values are."""
    brdf = SimpleNamespace(scale="absolute", bihemispherical_albedo=lambda: np.array([2.0]))
    said = _bright(SimpleNamespace(brdf=brdf, known=SimpleNamespace() if photos else None))
    assert "albedo above 1" in said and ("--quantity" in said) != photos


def test_a_negated_table_says_so_and_no_text_holds_what_is_no_number(capsys, tmp_path):
    status, numbers, err = fitted(capsys, tmp_path, matte_rows(-1.0))
    assert status == 3 and numbers["relative_median"] == [None]
    assert "100% of the values are: is their sign turned?" in err and "since no cell is above 0" in err
    text = re.sub(
        r"<(script|style).*?</\1>|<[^>]*>", " ", (tmp_path / "out/report.html").read_text(), flags=re.S
    )
    for said in (err, text):
        assert not re.search(r"\b(nan|inf)\b", said, re.IGNORECASE)


@pytest.mark.parametrize(
    ("misfit", "binned", "fault"), [(0.01, False, False), (0.2, False, True), (0.01, True, True)]
)
def test_a_result_that_holds_nowhere_is_excused_by_rows_alone(misfit, binned, fault):
    """A fit is close to photos that were brought to it, whatever they show."""
    value = np.ones((40, 1))
    cells = SimpleNamespace(value=value, binned=binned)
    result = SimpleNamespace(
        brdf=SimpleNamespace(valid={"theta_i_max": 0.0, "theta_r_max": 0.0}),
        fit=SimpleNamespace(cells=cells, predicted=(1.0 + misfit) * value),
    )
    (check,) = (one for one in OF_FITS if one.code == "not-determined")
    assert bool(check.found(result)) == fault


@pytest.mark.parametrize(
    ("off", "binned", "fault"), [(1.5, True, True), (1.1, True, False), (1.5, False, False)]
)
def test_a_photo_that_the_fit_misses_as_no_other_is_named(off, binned, fault):
    """As where two lamps' ids are exchanged: robust weights pass over it, and what is left need not be right."""
    photos, each = 6, 20
    group = np.repeat(np.arange(photos), each)
    fitted = np.linspace(0.1, 0.3, photos * each)[:, None] * [1.0, 0.5]
    noise = 1.0 + 0.01 * np.sign(np.arange(photos * each) % 2 - 0.5)[:, None]
    value = fitted * noise * np.where(group == 2, off, 1.0)[:, None]
    cells = SimpleNamespace(value=value, binned=binned, group=group, groups=tuple("abcdef"))
    cells.with_value = lambda changed: SimpleNamespace(**{**vars(cells), "value": changed})
    fit = SimpleNamespace(cells=cells, predicted=fitted, stray=np.zeros_like(fitted))
    (check,) = (one for one in OF_FITS if one.code == "photo-astray")
    said = check.found(SimpleNamespace(fit=fit))
    assert bool(said) == fault
    if fault:  # missed by 1 - 1 / 1.5
        assert "misses c by 33%" in said and "middle photo by 1.0%" in said


@pytest.mark.parametrize(
    ("valid", "error", "looked", "fault"),
    [
        (0.0, 0.05, 0.3, False),
        (0.0, 0.1, 0.0, True),
        (0.0, np.nan, 0.0, True),
        (60.0, 0.1, 0.01, False),  # a flash alone: what it saw it saw well
        (35.0, 0.1, 0.1, True),
        (35.0, 0.05, 0.1, False),
    ],
)
def test_an_albedo_that_nothing_tells_is_no_success(monkeypatch, valid, error, looked, fault):
    """A standard error of a fourth is half an albedo either way; plain paper's is an eighth."""
    monkeypatch.setattr("photogonio.report.trust.albedo_error", lambda brdf: np.array([0.01, error]))
    reach = {"theta_i_max": valid, "theta_r_max": valid}
    brdf = SimpleNamespace(valid=reach, bihemispherical_albedo=lambda: np.array([0.4, 0.4]))
    f = np.full((5, 2), 0.1)
    told = (
        np.array([0.001, 0.001, 1.0, 1.0, 1.0])[:, None] * looked * f
    )  # two cells of five are sure in any case
    fit = SimpleNamespace(
        cells=SimpleNamespace(binned=True),
        predicted=f,
        standard_error=lambda cells: told,
        uncertainty=SimpleNamespace(half_width=lambda error: 2.0 * error),
    )
    (check,) = (one for one in OF_FITS if one.code == "unsure")
    assert bool(check.found(SimpleNamespace(brdf=brdf, fit=fit))) == fault


@pytest.mark.parametrize(("error", "fault"), [(0.08, False), (0.12, True)])
def test_an_albedo_of_rows_may_be_less_sure(monkeypatch, error, fault):
    """Their directions are known: two fifths either way is a slate's that was measured at 205 pairs."""
    monkeypatch.setattr("photogonio.report.trust.albedo_error", lambda brdf: np.array([error]))
    reach = {"theta_i_max": 0.0, "theta_r_max": 0.0}
    brdf = SimpleNamespace(valid=reach, bihemispherical_albedo=lambda: np.array([0.4]))
    (check,) = (one for one in OF_FITS if one.code == "unsure")
    fit = SimpleNamespace(cells=SimpleNamespace(binned=False))
    assert bool(check.found(SimpleNamespace(brdf=brdf, fit=fit))) == fault


def test_a_narrow_peak_is_the_cause_that_comes_first(capsys, tmp_path):
    """Matte but for half a degree about the mirror direction, which steps of 5 degrees meet at one row an incidence."""
    angles = np.stack(np.meshgrid(np.arange(0, 76, 15), [0], np.arange(0, 81, 5), np.arange(0, 360, 30)), -1)
    angles = angles.reshape(-1, 4)
    mirror = (angles[:, 0] == angles[:, 2]) & (angles[:, 3] == 180) | (angles[:, 0] + angles[:, 2] == 0)
    value = np.where(mirror, 86.0, 0.016) * (1.0 + 0.005 * np.random.default_rng(6).normal(size=len(angles)))
    table = written(tmp_path / "table.csv", np.column_stack([angles, value]))
    assert main(["fit", str(table), "-o", str(tmp_path / "out"), "--json"]) == 3
    out, err = capsys.readouterr()
    first = next(line for line in err.splitlines() if line.startswith("NOT TO BE TRUSTED"))
    assert "likeliest cause: a peak about the mirror direction" in first
    assert not {"rows-slipped", "azimuth-mirrored"} & set(json.loads(out)["trust"]["codes"])


def test_who_uses_the_file_is_told_and_quiet_is_not_silent(capsys, tmp_path):
    table = written(tmp_path / "table.csv", matte_rows(100.0))
    assert main(["fit", str(table), "-o", str(tmp_path / "out"), *QUICK, "--quiet"]) == 3
    out, err = capsys.readouterr()
    assert out == ""
    assert "NOT TO BE TRUSTED" in err
    coefficients = str(tmp_path / "out/coefficients.json")
    assert main(["export", coefficients, "--format", "csv", "-o", str(tmp_path / "t.csv")]) == 0
    assert "albedo-above-one" in capsys.readouterr().err


def test_rows_that_are_no_brdf_are_not_trusted(capsys, tmp_path):
    """Half the rows ten times the others, without any rule in the angles that a BRDF could have."""
    rows = matte_rows()
    rows[:, 4] *= np.where(np.random.default_rng(2).random(len(rows)) < 0.5, 0.1, 1.0)
    status, numbers, _ = fitted(capsys, tmp_path, rows)
    assert status == 3
    assert {"misfit", "not-determined"} & set(numbers["trust"]["codes"])


def test_noise_of_the_rows_own_is_no_misfit():
    """A third of the value: the median misfit is 0.67 of it, 22 %, and neighbours share next to nothing."""
    rng = np.random.default_rng(3)
    theta_i, theta_r, dphi = rng.uniform(0, 1.3, 2000), rng.uniform(0, 1.3, 2000), rng.uniform(0, np.pi, 2000)
    theta_i[:900] = theta_r[:900] = 0.0  # many rows of one pair of directions
    value = 0.1 * (1.0 + 0.33 * rng.normal(size=(2000, 1)))
    cells = Cells.of_angles(theta_i, theta_r, dphi).with_value(value)
    noise, off = np.full_like(value, 0.1), np.full_like(value, 0.2)
    assert relative_misfit(value, noise)[1][0] > 0.2
    assert shared_misfit(cells, noise)[0] < 0.1
    assert shared_misfit(cells, off)[0] > 0.5


def test_noise_about_zero_is_no_misfit_and_light_that_a_fit_lacks_is():
    """Black but for a gloss that one row of ten shows, noise of a per cent of it: half of the black rows lie below."""
    rng = np.random.default_rng(4)
    true = np.where(np.arange(1000) % 10 == 0, 1.0, 0.0)[:, None]
    value = true + 0.01 * rng.normal(size=true.shape)
    assert relative_misfit(value, true)[1][0] < 0.02
    assert relative_misfit(value, 0.5 * true)[1][0] == pytest.approx(0.5, abs=0.02)
    assert relative_misfit(value, true + 0.2)[1][0] > 0.2


def test_what_a_fit_misses_of_all_but_black_cells_is_nothing_beside_the_light_of_the_room():
    """A metal beside its peak: half of what is left there is missed, a twentieth of what photos show."""
    rng = np.random.default_rng(5)
    theta_i, theta_r, dphi = rng.uniform(0, 1.3, 500), rng.uniform(0, 1.3, 500), rng.uniform(0, np.pi, 500)
    cells = Cells.of_angles(theta_i, theta_r, dphi).with_value(np.full((500, 1), 2e-3))
    fit = SimpleNamespace(cells=cells, predicted=np.full((500, 1), 1e-3 / 1.5), stray=np.full((500, 1), 0.02))
    assert _misfit(SimpleNamespace(fit=fit)) == ""
    fit.stray = np.zeros((500, 1))
    assert "by 67%" in _misfit(SimpleNamespace(fit=fit))


@pytest.mark.parametrize(("roughness", "missed"), [(0.06, True), (0.11, False)])
def test_a_peak_of_which_photos_show_tails_alone(roughness, missed):
    """The closest of the half vectors lies 5 degrees from the normal: a slope of 0.087."""
    lobes = LobeSet((blinn_phong_lobe(absolute=True),), (np.array([roughness]),))
    model = Model(Basis("isotropic", 0), np.zeros((1, 1)), lobes, np.full((1, 1), 0.05))
    theta = np.radians([25.0, 40.0])
    cells = Cells.of_angles(theta, np.radians([35.0, 20.0]), np.full(2, np.pi))
    assert tops_unseen(model, cells) == missed
    assert not tops_unseen(replace(model, lobes=LobeSet()), cells)


def drawn_setup() -> Setup:
    pose = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 500.0]))
    lamp = Light("L", "point", np.array([100.0, 0, 300]), np.eye(3), "given")
    views = tuple(
        ViewSetup(f"s{k}.png", lamp, pose, np.ones(1), np.full(1, 0.01), "white patch", pose_rms=0.2)
        for k in range(3)
    )
    camera = Camera(np.array([[900.0, 0, 400], [0, 900, 300], [0, 0, 1]]), np.zeros(5), (800, 600))
    return Setup(camera, Sphere(np.array([0.0, 0, 25]), 25.0), views, "absolute", ("Y",))


def test_a_calibration_is_judged_too():
    setup = drawn_setup()
    assert setup_faults(setup) == ()

    def spoilt(**change: object) -> list[str]:
        return [
            one.code
            for one in setup_faults(replace(setup, views=tuple(replace(v, **change) for v in setup.views)))
        ]

    assert spoilt(pose_rms=51.0) == ["board-residual"]
    assert spoilt(strength_error=np.ones(1)) == ["lamp-strength"]
    assert spoilt(pose=Pose(np.eye(3), np.array([0.0, 0.0, 500.0]))) == ["camera-place"]
    wide = replace(setup.camera, matrix=np.array([[50.0, 0, 400], [0, 50, 300], [0, 0, 1]]))
    assert [one.code for one in setup_faults(replace(setup, camera=wide))] == ["camera-place"]
    wild = replace(setup, views=(replace(setup.views[0], pose_rms=51.0), *setup.views[1:]))
    assert setup_faults(wild) == ()  # one photo of three does not decide


def test_calibrate_ends_with_status_3(capsys, tmp_path, monkeypatch):
    setup = drawn_setup()
    setup = replace(setup, views=tuple(replace(view, pose_rms=51.0) for view in setup.views))

    def found(folder, out, reporter, *, workers):
        save_setup(setup, out)
        return setup

    monkeypatch.setattr("photogonio.commands.calibrate.calibrate", found)
    assert main(["calibrate", "set", "-o", str(tmp_path / "setup.json")]) == 3
    assert capsys.readouterr().out.startswith("NOT TO BE TRUSTED: the board lies 51.0 pixels")


def test_every_check_has_its_code_and_the_docs_list_them():
    checks = (*OF_SETUPS, *OF_FITS)
    assert len({one.code for one in checks}) == len(checks)
    assert checks_table() in (ROOT / "docs/cli.md").read_text(encoding="utf-8")


@pytest.mark.skipif(not SHARED.is_dir(), reason="no cases beside the checkout")
@pytest.mark.parametrize("name", ["percent-of-white", "radians"])
def test_cases_that_once_were_called_a_success(capsys, tmp_path, name):
    """What a reader does not refuse must not be trusted."""
    table = SHARED / f"cases/{name}.csv"
    assert main(["fit", str(table), "-o", str(tmp_path / "out"), *QUICK, "--quiet"]) in (2, 3)
