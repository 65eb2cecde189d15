"""What export writes, every reader takes: fit's, that of compare and show, and the renderer's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.cli import main
from photogonio.compare.colours import in_common_colours
from photogonio.compare.known import Known
from photogonio.compare.reflectances import as_reflectance, load_known
from photogonio.reconstruct.export import principled, radiance_tree, table_grid
from photogonio.reconstruct.export.formats import FORMATS, find_format
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.synthetic.render.world import brdf_from
from tests.drawn.exports import gloss, over_ground, random_pairs, satin

# rms below 60 degrees that the file may lose: of a table by its steps, of a material by its model
LOST = {"csv": 0.03, "pabopto": 0.03, "merl": 0.02, "mitsuba": 0.01, "radiance": 0.04, "klems": 0.2}
LOST |= {"openpbr": 0.1, "gltf": 0.1, "modes": 1e-9, "scatmech": 0.02}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """One of each format, of a satin surface."""
    folder = tmp_path_factory.mktemp("files")
    found = {}
    monkeypatch = pytest.MonkeyPatch()
    monkeypatch.setattr(radiance_tree, "_DEEPEST", {3: 6, 4: 3})  # a tenth of the time
    monkeypatch.setattr(table_grid, "ROWS", {False: 6000, True: 60_000})
    monkeypatch.setattr(principled, "_ROUGHNESS", np.array([0.55]))
    for name in LOST:
        form = find_format("radiance", "klems") if name == "klems" else find_format(name)
        found[name] = folder / f"{name}{form.suffix}"
        form.write(satin(("G",)) if name == "scatmech" else satin(), found[name])
    monkeypatch.undo()
    assert {*FORMATS, "klems"} == set(LOST)
    return found


@pytest.mark.parametrize("name", LOST)
def test_each_reader_takes_each_format(files, name):
    path = files[name]
    source = satin(("G",)) if name == "scatmech" else satin()
    truth = Known("source", source.channels, True, source)
    pairs = random_pairs(3000, below=60.0)

    def missed(known: Known) -> float:
        a, b = (one.evaluate(*pairs) for one in in_common_colours(known, truth))
        return float(np.sqrt(np.mean((a - b) ** 2) / np.mean(b**2)))

    known = load_known(path)  # of compare, show and export
    assert missed(known) < LOST[name]
    samples = read_samples(path)  # of fit
    assert len(samples.value) > 1000 and np.isfinite(samples.value).all()
    at = replace(known, evaluate=lambda i, r: samples.value)
    pairs = samples.incident, samples.exit
    inside = np.minimum(*(one[:, 2] for one in pairs)) > 0.5
    a, b = (one.evaluate(*pairs)[inside] for one in in_common_colours(at, truth))
    assert np.sqrt(np.mean((a - b) ** 2) / np.mean(b**2)) < max(LOST[name], 1e-5)
    drawn = brdf_from({"file": path.name}, path.parent, "scene", as_reflectance)  # of synthesize
    up = np.array([[0.0, 0.0, 1.0]])
    a, b = drawn(up, up), satin()(up, up) if drawn(up, up).shape[1] == 3 else source(up, up)
    if drawn(up, up).shape[1] == 3 or name == "scatmech":
        np.testing.assert_allclose(a, b, rtol=3 * LOST[name] + 1e-6)


@pytest.mark.parametrize("name", ["csv", "mitsuba"])
def test_of_surfaces_that_turn_too(tmp_path, name, monkeypatch):
    """pab-opto's folder has a test of its own, and Radiance's four axes another."""
    monkeypatch.setattr(table_grid, "ROWS", {False: 5000, True: 60_000})
    brdf, path = over_ground(gloss((0.5, 0.35), azimuth=0.4), ("Y",)), tmp_path / f"a{FORMATS[name].suffix}"
    FORMATS[name].write(brdf, path)
    known = load_known(path)
    assert not known.isotropic and known.evaluate is not None
    pairs = random_pairs(500, below=60.0)
    np.testing.assert_allclose(known.evaluate(*pairs)[:, 0], brdf(*pairs)[:, 0], rtol=0.15)
    assert not as_reflectance(path).isotropic


def test_show_takes_a_folder_of_measurements(files, tmp_path, monkeypatch):
    """Pictures are drawn elsewhere: a small one will do."""
    monkeypatch.setattr("photogonio.report.plots.shaded_sphere", lambda *_, **__: np.ones((2, 2, 3)))
    assert main(["show", str(files["pabopto"]), "-o", str(tmp_path / "a.svg"), "--quiet"]) == 0
    assert "in_00.00_000.0.dat" in (tmp_path / "a.svg").read_text()
