"""pab-opto's files: our reader finds the BRDF in them, and so does Radiance's converter."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from photogonio.compare.colours import in_rgb
from photogonio.compare.reflectances import load_known
from photogonio.reconstruct.export import table_grid
from photogonio.reconstruct.export.pabopto_files import XYZ_OF_RGB, write_pabopto
from photogonio.reconstruct.goniometer.read import read_samples
from tests.drawn.exports import gloss, matte, over_ground, random_pairs, satin


def test_its_rows_are_f_in_x_y_and_z(tmp_path):
    write_pabopto(satin(), tmp_path / "a")
    samples = read_samples(tmp_path / "a")
    assert samples.channels == ("X", "Y", "Z") and samples.left_out == 0
    f = satin()(samples.incident, samples.exit) @ XYZ_OF_RGB.T
    np.testing.assert_allclose(samples.value, f, rtol=1e-6)  # of seven digits


def test_a_grey_surface_is_its_luminance_and_white_has_that_of_one(tmp_path):
    np.testing.assert_allclose(XYZ_OF_RGB.sum(1), [0.95046, 1.0, 1.08906], atol=1e-4)  # D65
    write_pabopto(satin(("W",)), tmp_path / "a")
    samples = read_samples(tmp_path / "a")
    assert samples.channels == ("Y",)
    np.testing.assert_allclose(samples.value, satin(("W",))(samples.incident, samples.exit), rtol=1e-6)


def test_a_brushed_surface_is_known_between_its_rows(tmp_path, monkeypatch):
    monkeypatch.setattr(table_grid, "ROWS", {False: 5000, True: 60_000})
    brdf = over_ground(gloss((0.5, 0.35), azimuth=0.4))
    write_pabopto(brdf, tmp_path / "a")
    known = load_known(tmp_path / "a")
    assert not known.isotropic and known.evaluate is not None
    incident, exit = random_pairs(2000, below=60.0)
    f, g = brdf(incident, exit), in_rgb(known).evaluate(incident, exit)
    # an eighth of the steps' squares times the curve of a peak of that width: two polar angles, two azimuths
    step, turn = np.radians(10.0), np.radians(15.0)
    bound = (2 * step**2 + 2 * (turn * np.sin(np.radians(60.0))) ** 2) / (8 * 0.35**2)
    assert np.sqrt(np.mean((f - g) ** 2) / np.mean(f**2)) < bound


def test_radiances_converter_takes_them(tmp_path, monkeypatch):
    pyradiance = pytest.importorskip("pyradiance", reason="pyradiance is not installed")
    tool = Path(pyradiance.__file__).parent / "bin" / "pabopto2bsdf"
    tool = tool if tool.is_file() else shutil.which("pabopto2bsdf", path=str(Path(sys.executable).parent))
    if tool is None:
        pytest.skip("this pyradiance has no pabopto2bsdf")
    monkeypatch.setattr(table_grid, "ROWS", {False: 5000, True: 60_000})
    write_pabopto(matte(), tmp_path / "a")
    files = sorted(str(path) for path in (tmp_path / "a").iterdir())
    done = subprocess.run([str(tool), "-n", "1", *files], capture_output=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr.decode()
    header = done.stdout.split(b"\n\n")[0].decode("latin-1")
    assert "SYMMETRY=" in header or "FORMAT=BSDF_RBFmesh" in header
