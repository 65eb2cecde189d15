"""The benchmarks run, in their quick mode, and print what they should."""

import json
import re

import numpy as np
import pytest

from benchmarks import all as everything
from benchmarks import (
    bare_folders,
    consumers,
    coverage,
    end_to_end,
    evaluation,
    far_lamps,
    fit,
    growth,
    in_order,
    kernel,
    lamps,
    left_out_rows,
    mitsuba_renders,
    modes_alone,
    narrow_gloss,
    png,
    row_symmetry,
    spectra,
    spoilt_tables,
    symmetry_choice,
    tone_curves,
    traced,
    versions,
    whole,
)
from photogonio.capture.files.images import read_image
from photogonio.capture.manifest.load import load_photoset
from photogonio.report.diagnoses import ENTRIES
from photogonio.synthetic.brdf.library import angle_grid


@pytest.mark.long
def test_kernel_against_numpy(capsys):
    kernel.main(["--quick", "--level", "3"])
    lines = capsys.readouterr().out.splitlines()[2:]
    assert {line.split()[0] for line in lines} == {"ball", "plane"}
    for line in lines:
        assert float(line.split()[-1]) < 1e-9  # of a cell's value


@pytest.mark.long
@pytest.mark.parametrize("suffix", ["png", "exr", "jpg"])
def test_photos_to_table_against_decoding(capsys, suffix):
    end_to_end.main(["--quick", "--formats", suffix])
    line = capsys.readouterr().out.splitlines()[-1]
    assert line.startswith(suffix) and all(float(number) > 0 for number in line.split()[1:])


def test_png_files_are_decoded_to_the_same_pixels(capsys):
    png.main(["--quick"])
    rows = [[float(one) for one in line.split()] for line in capsys.readouterr().out.splitlines()[1:]]
    assert [row[:2] for row in rows] == [[bits, channels] for bits in (8, 16) for channels in (1, 2, 3, 4)]
    assert all(len(row) == 8 and min(row) > 0 for row in rows)


@pytest.mark.long
def test_a_measurement_apart(tmp_path, capsys):
    end_to_end.make_set(tmp_path / "set", end_to_end.made_setup(2, ".png", 0.06, 0.05), ".png")
    growth.main(["--child", str(tmp_path / "set"), "2", "0.05", "3"])
    assert json.loads(capsys.readouterr().out)["cells"] > 100


@pytest.mark.long
def test_growth(capsys):
    growth.main(["--quick"])
    out = capsys.readouterr().out
    assert len(re.findall(r"time ~ size\^", out)) == 3
    assert all(int(cells) > 0 for cells in re.findall(r"(\d+) cells", out))


@pytest.mark.long
def test_modes_alone_beside_least_squares(capsys):
    modes_alone.main(["--quick"])
    rows = re.findall(r"^\| ([\w-]+) \| \w+ \| ([\d.]+) \|$", capsys.readouterr().out, re.MULTILINE)
    assert [name for name, _ in rows] == ["lambert"] * 2 + ["ggx-conductor"] * 2
    assert all(0.99 <= float(one) <= 1.1 for _, one in rows)


@pytest.mark.long
def test_a_tone_curve_is_found_with_greys(capsys):
    tone_curves.main(["--quick"])
    out = capsys.readouterr().out
    assert "with greys: within 1 % in 1 (rms)" in out and len(re.findall(r"[\d.]+%", out)) == 6


@pytest.mark.long
def test_symmetry_is_chosen_right(capsys):
    symmetry_choice.main(["--quick"])
    out = capsys.readouterr().out
    assert re.findall(r"(\w+): 0 of (\d+) wrong", out) == [("isotropic", "2"), ("anisotropic", "2")]


@pytest.mark.long
def test_fit_against_lstsq(capsys):
    fit.main(["--quick"])
    out = capsys.readouterr().out
    assert float(re.search(r"solutions within (\S+)", out)[1]) < 1e-6  # of the largest value
    assert re.search(r"orders 0 to 2: \d+ cells, \d+ views", out)


@pytest.mark.long
def test_a_narrow_gloss_is_found(capsys):
    narrow_gloss.main(["--quick"])
    error, near, roughness, stated, asked = map(float, capsys.readouterr().out.split()[-5:])
    assert asked == 1.2
    assert error < 4.0 and near < 5.0  # %: a small set is less sure than those of which 1.2 is asked
    assert abs(roughness - 1.0) < 0.05 and 0.0 < stated < 1.5


@pytest.mark.long
def test_the_whole_command_against_decoding(capsys, tmp_path):
    whole.main(["--quick", "--formats", "png"])
    line = capsys.readouterr().out.splitlines()[-1]
    assert line.startswith("png") and all(float(number) > 0 for number in line.split()[1:])


@pytest.mark.long
def test_another_format_is_the_same_set(tmp_path):
    source = tmp_path / "png"
    whole.make_board_set(source, 3, 1, 0.03)
    whole.converted(source, tmp_path / "exr", ".exr")
    for name in ("sample/s002", "calibration/c00"):
        a, b = (read_image(tmp_path / kind / f"{name}.{kind}") for kind in ("png", "exr"))
        # half floats have 11 bits
        np.testing.assert_allclose(b.pixels, a.pixels / 65535, rtol=2**-11, atol=2**-24)
    assert load_photoset(tmp_path / "exr").photos[0].file.endswith(".exr")


def test_all_run_what_is_asked(monkeypatch, capsys):
    ran = []
    monkeypatch.setattr(everything, "run", lambda name, words: ran.append((name, words)) or True)
    monkeypatch.setattr(everything, "startup", lambda *words: 0.1)
    assert everything.main(["--quick", "--only", "kernel,fit"]) == 0
    assert ran == [("kernel", ["--quick"]), ("fit", ["--quick"])]
    assert "cores" in capsys.readouterr().out


@pytest.mark.long
def test_coverage_of_a_calibrations_intervals(capsys):
    coverage.main(["--quick", "--workers", "1"])
    rows = {line.split()[0]: line.split()[1:] for line in capsys.readouterr().out.splitlines()[2:]}
    assert set(rows) == {"camera", "pose", "light", "sample", "radiance"}
    for numbers in rows.values():
        # four set-ups tell little; errors of the stated size have an rms of 1, those of a wrong slope had 4
        assert 0.2 < float(numbers[-1]) < 2.0


@pytest.mark.long
def test_rows_left_out_of_measurements(capsys, tmp_path):
    """White noise of 1 % about a Lambertian: nothing predicts left-out rows better, and neither way is far off."""
    theta, phi = np.arange(0.0, 80.0, 15.0), np.arange(0.0, 181.0, 30.0)
    i, r, d = (one.ravel() for one in np.meshgrid(theta, theta, phi, indexing="ij"))
    f = 0.3 * (1 + 0.01 * np.random.default_rng(0).normal(size=len(i)))
    rows = "".join(f"0.5,{a:g},0,{b:g},{c:g},{v:.6f}\n" for a, b, c, v in zip(i, r, d, f, strict=True))
    (tmp_path / "rows.csv").write_text("lambda,thetai,phi,thetar,phir,f_r11\n" + rows)
    left_out_rows.main([str(tmp_path / "rows.csv"), "--wavelengths", "0.5", "--smoother", "--quick"])
    line = capsys.readouterr().out
    left, smoothed = (
        float(one) for one in re.search(r"left out (\S+),.*smoother \S+, (\S+),", line).groups()
    )
    chance = 0.01 * 3.0 / np.sqrt(2.0 * len(i) / 3.0)  # three standard errors of an rms of so many rows
    assert left == pytest.approx(0.01, abs=chance) and smoothed == pytest.approx(0.01, abs=chance)


@pytest.mark.long
def test_lamps_against_their_truth(capsys):
    lamps.main(["--quick"])
    direction, tail, place, _ = (float(one) for one in capsys.readouterr().out.splitlines()[-1].split()[2:])
    assert 0.0 < direction < 0.3 and direction <= tail < 2.0  # degrees, in photos of 420 pixels
    assert 0.0 < place < 0.02


@pytest.mark.long
def test_sets_in_order_stay_below_what_is_told(capsys):
    """The thresholds of what is told of a set, by code, are above what drawn sets in order have."""
    in_order.main(["--quick"])
    lines = [line.split(",", 1) for line in capsys.readouterr().out.splitlines()]
    amounts = {
        code: float(rest.split(" of ")[-2].split()[-1]) for code, rest in lines if "errors" not in rest
    }
    least = {entry.code: entry.least for entry in ENTRIES}
    assert len(amounts) >= 8
    del amounts["vignetting"]  # of one set's paper it is known to a few hundredths: told by standard errors
    assert {code for code, amount in amounts.items() if amount >= least[code]} == set()


@pytest.mark.long
def test_the_symmetry_of_drawn_rows_is_judged(tmp_path, capsys):
    rng = np.random.default_rng(0)
    theta = np.degrees(np.arccos(rng.uniform(0.2, 1.0, (2, 120))))
    phi = rng.uniform(-180.0, 180.0, (2, 120))
    value = 0.2 * (1.0 + 0.02 * rng.normal(size=120))
    rows = np.column_stack([theta[0], phi[0], theta[1], phi[1], value])
    header = "theta_i,phi_i,theta_r,phi_r,value"
    np.savetxt(tmp_path / "rows.csv", rows, delimiter=",", header=header, comments="")
    row_symmetry.main([str(tmp_path), "--kind", "isotropic", "--quick"])
    assert "isotropic: 0 of 2 wrong" in capsys.readouterr().out


@pytest.mark.long
def test_what_the_distance_of_lamps_costs(capsys):
    far_lamps.main(["--quick", "--workers", "1"])
    rows = [line.split() for line in capsys.readouterr().out.splitlines() if line.startswith("matte-ball")]
    assert [row[2] for row in rows] == ["near", "3", "sun"]
    errors = [float(row[-6]) for row in rows]
    assert 0.0 < max(errors) < 2.0  # per cent
    assert all(row[-2] == "yes" and row[-3] == "0" for row in rows)


@pytest.mark.long
def test_no_spoilt_table_is_silent(capsys):
    spoilt_tables.main(["--quick"])
    *_, total = capsys.readouterr().out.splitlines()
    assert total.split() == ["all", "2", "1", "0", "0", "0"]  # right, refused, distrusted, warned, silent


@pytest.mark.long
def test_what_consumers_read(capsys):
    consumers.main(["--quick"])
    rows = re.findall(
        r"^\| (\w+) \| [\w ]+ \| ([\w .]+) \| ([\d.]+) \|", capsys.readouterr().out, re.MULTILINE
    )
    assert [row[:2] for row in rows] == [(f, m) for f in ("mitsuba", "csv") for m in ("matte", "gloss 0.3")]
    assert all(float(lost) < 1.0 for _, _, lost in rows)


@pytest.mark.long
def test_what_mitsuba_makes_of_a_file(capsys):
    pytest.importorskip("mitsuba", reason="Mitsuba is not installed")
    mitsuba_renders.main(["--materials", "gloss 0.3", "--size", "16", "--samples", "24"])
    *_, row = capsys.readouterr().out.splitlines()
    albedo, rms, mean, _ = map(float, row.strip("| ").split(" | ")[1:])
    assert abs(albedo) < 1.5 and rms < 1.0 and mean < 1.0


def test_a_coat_in_modes_is_further_from_the_truth(tmp_path, capsys):
    """The truth is the file itself: as found nothing is lost, and in version 1 no more than it says of itself."""
    brdf = evaluation.plastic()
    brdf.save(tmp_path / "coefficients.json")
    grid = angle_grid()[::7]
    np.savez(tmp_path / "truth.npz", grid=grid, brdf=brdf.evaluate(grid[:, 0], 0.0, grid[:, 1], grid[:, 2]))
    versions.main(["--results", str(tmp_path / "coefficients.json"), str(tmp_path / "truth.npz")])
    second, first, _, loss, _ = (float(one) for one in capsys.readouterr().out.splitlines()[-1].split()[1:])
    assert second == 0.0
    assert 0.0 < first < 3.0 * loss  # the grid's seventh is not their hemisphere


@pytest.mark.long
def test_sets_of_another_renderer(capsys):
    """A diffuse ball: Mitsuba's light and ours agree to a per cent, and no interval misses by much."""
    pytest.importorskip("mitsuba", reason="Mitsuba is not installed")
    traced.main(["--sets", "1", "--size", "300", "--samples", "16", "--workers", "1"])
    first = capsys.readouterr().out.splitlines()[0]
    assert first.startswith("diffuse, ball") and float(first.split()[2]) < 1.0


@pytest.mark.long
def test_a_folder_without_a_word_of_help(capsys):
    bare_folders.main(["--cases", "2", "--width", "660", "--no-process"])
    row, total = capsys.readouterr().out.splitlines()
    assert row.startswith("2 sphere both dng") and ": right," in row and total == "right: 1 of 1"


@pytest.mark.long
def test_a_spectrum_beside_three_channels(capsys):
    spectra.main(["--quick"])
    found = re.search(r"7 channels over 3: (\S+) times", capsys.readouterr().out)
    assert found and 0.0 < float(found[1]) < 7.0 / 3.0
