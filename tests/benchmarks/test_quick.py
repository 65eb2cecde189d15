"""The benchmarks run, in their quick mode, and print what they should."""

import json
import re

import pytest

from benchmarks import end_to_end, growth, kernel, symmetry_choice


def test_kernel_against_numpy(capsys):
    kernel.main(["--quick", "--level", "3"])
    lines = capsys.readouterr().out.splitlines()[2:]
    assert {line.split()[0] for line in lines} == {"ball", "plane"}
    for line in lines:
        assert float(line.split()[-1]) < 1e-9  # of a cell's value


@pytest.mark.parametrize("suffix", ["png", "exr", "jpg"])
def test_photos_to_table_against_decoding(capsys, suffix):
    end_to_end.main(["--quick", "--formats", suffix])
    line = capsys.readouterr().out.splitlines()[-1]
    assert line.startswith(suffix) and all(float(number) > 0 for number in line.split()[1:])


def test_a_measurement_apart(tmp_path, capsys):
    end_to_end.make_set(tmp_path / "set", end_to_end.made_setup(2, ".png", 0.06, 0.05), ".png")
    growth.main(["--child", str(tmp_path / "set"), "2", "0.05", "3"])
    assert json.loads(capsys.readouterr().out)["cells"] > 100


def test_growth(capsys):
    growth.main(["--quick"])
    out = capsys.readouterr().out
    assert len(re.findall(r"time ~ size\^", out)) == 3
    assert all(int(cells) > 0 for cells in re.findall(r"(\d+) cells", out))


def test_symmetry_is_chosen_right(capsys):
    symmetry_choice.main(["--quick"])
    out = capsys.readouterr().out
    assert re.findall(r"(\w+): 0 of (\d+) wrong", out) == [("isotropic", "2"), ("anisotropic", "2")]
