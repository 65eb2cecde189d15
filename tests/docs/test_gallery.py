"""The gallery's scripts run as a user runs them, and what they print is true."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from tests.places import ROOT

SCRIPTS = sorted((ROOT / "docs" / "gallery").glob("*.py"))
STATED = re.compile(r"found (\S+) \+- (\S+) true (\S+)")


def run(name: str, folder: Path) -> str:
    """What the script prints; it may write to ``folder`` alone, and stands in another."""
    away = folder / "away"
    away.mkdir()
    threads = {key: "1" for key in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")}
    environment = os.environ | threads | {"PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}
    command = [sys.executable, "-W", "error", str(ROOT / "docs" / "gallery" / f"{name}.py"), str(folder)]
    done = subprocess.run(command, cwd=away, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert list(away.iterdir()) == []
    return done.stdout


def stated(text: str) -> np.ndarray:
    """(n, 3) found, half of the 95 % interval, true."""
    return np.array(STATED.findall(text), float)


def numbers_after(words: str, text: str) -> np.ndarray:
    (found,) = re.findall(rf"{words} \[([^]]*)\]", text)
    return np.array(found.split(), float)


def shows_something(picture: Path) -> bool:
    import cv2

    return cv2.imread(str(picture)).std() > 5


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_scripts_have_a_head_that_says_what_they_are(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    title, rule, blank, text = (ast.get_docstring(tree) or "").split("\n", 3)
    assert set(rule) == {"="} and len(rule) == len(title) and not blank and f"{path.name} FOLDER" in text
    assert not any(isinstance(node, ast.Assert) for node in ast.walk(tree))


def test_how_sure(tmp_path):
    text = run("how_sure", tmp_path)
    found, half, true = stated(text).T
    assert len(found) == 5
    # 2.5 standard errors of each of five numbers are passed by chance in one of seventeen; the noise is of one seed
    assert (np.abs(found - true) < 2.5 / 1.96 * half).all()
    assert (half < 0.05 * found).all()  # 252 rows of 3 %
    (same,), (darker,) = (re.findall(rf"p = (\S+) against the {word}", text) for word in ("same", "darker"))
    # an albedo of 0.3 % (one standard error of it in each) is ten times as well known as they differ
    assert float(same) > 0.05 > 0.01 > float(darker)
    assert shows_something(tmp_path / "how_sure.png")


@pytest.mark.long
def test_goniometer_to_radiance(tmp_path):
    text = run("goniometer_to_radiance", tmp_path)
    found, half, true = stated(text).T
    assert len(found) == 3 and (np.abs(found - true) < 2.5 / 1.96 * half).all()
    assert (half < 0.05 * found).all()
    (below_60,) = re.findall(r"loses (\S+) % below 60", text)
    assert float(below_60) < 1.0
    if find_spec("pyradiance"):
        # what a cell of the tree holds is a mean, and off by no more than the rms says, thrice
        np.testing.assert_allclose(numbers_after("Radiance finds", text), found, rtol=0.03 * float(below_60))
    assert shows_something(tmp_path / "satin.png")


@pytest.mark.long
@pytest.mark.slow
def test_photoset_to_mitsuba(tmp_path):
    text = run("photoset_to_mitsuba", tmp_path)
    found, true = numbers_after("found", text), numbers_after("true", text)
    # the white patch is known to a per cent at best
    np.testing.assert_allclose(found, true, rtol=0.02)
    (below_60,) = re.findall(r"loses (\S+) % below 60", text)
    assert float(below_60) < 0.5
    if find_spec("mitsuba"):
        # 16,000 samples whose spread is no more than their mean: 0.8 %, thrice
        np.testing.assert_allclose(numbers_after("Mitsuba sends", text), found, rtol=0.024)
        assert shows_something(tmp_path / "mitsuba.png")
    assert shows_something(tmp_path / "red-plastic.png")
    assert (tmp_path / "red-plastic-brdf" / "report.html").is_file()


@pytest.mark.long
@pytest.mark.slow
def test_known_truth(tmp_path):
    text = run("known_truth", tmp_path)
    found, half, true = stated(text).T
    assert len(found) == 3 and (np.abs(found - true) < 2.5 / 1.96 * half).all()
    assert (half < 0.1 * found).all()
    (within,) = re.findall(r"within the 95 % interval: (\S+) %", text)
    # errors of one set are one draw, and go together over all pairs: most of it, not 95 % to a few
    assert float(within) > 80.0
    assert (numbers_after("relative_l2", text) < 0.03).all() and (
        numbers_after("correlation", text) > 0.9
    ).all()
    assert shows_something(tmp_path / "known_truth.png")
