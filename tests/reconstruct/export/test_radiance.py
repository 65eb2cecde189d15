"""Exports for Radiance: how much is lost, and that no light is added."""

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf, Lobe
from photogonio.reconstruct.brdf.radiance import read_radiance
from photogonio.reconstruct.export import find_format, radiance_tree
from photogonio.reconstruct.export.radiance_klems import matrix
from photogonio.reconstruct.export.radiance_xml import LUMINANCE


def plain(albedo=0.5, lobes=()) -> Brdf:
    return Brdf(
        0,
        ("R", "G", "B"),
        np.array([[0, 0, 0]]),
        np.full((1, 3), 2 * albedo),  # the first mode is 1 / (2 pi)
        np.zeros((1, 3)),
        lobes=lobes,
    )


@pytest.mark.parametrize("basis", ["tree", "klems"])
def test_a_lambertian_surface_is_the_same_everywhere(tmp_path, basis):
    form = find_format("radiance", basis)
    form.write(plain(), tmp_path / "a.xml")
    loss = form.loss(plain(), tmp_path / "a.xml")
    assert max(loss.rms) < 1e-4  # five digits are written
    np.testing.assert_allclose(loss.albedo, 1.0, atol=1e-4)


def test_a_satin_surface_loses_little_in_a_tree(tmp_path, monkeypatch):
    monkeypatch.setattr(radiance_tree, "_DEEPEST", {3: 7, 4: 4})
    brdf = plain(0.3, (Lobe(0.3, np.full(3, 0.04), np.ones(3)),))
    form = find_format("radiance")
    form.write(brdf, tmp_path / "a.xml")
    loss = form.loss(brdf, tmp_path / "a.xml")
    # cells are 1/64 of the disk's radius wide, the lobe 0.3 of it: its slope times the cell over the root of 12
    assert loss.rms[0] < 0.01
    np.testing.assert_allclose(loss.albedo[:3], 1.0, atol=0.005)


def test_more_leaves_lose_less(tmp_path, monkeypatch):
    monkeypatch.setattr(radiance_tree, "_DEEPEST", {3: 6, 4: 3})
    brdf = plain(0.3, (Lobe(0.4, np.full(3, 0.04), np.ones(3)),))
    found = []
    for leaves in (500, 5_000, 50_000):
        monkeypatch.setattr(radiance_tree, "_LEAVES", leaves)
        find_format("radiance").write(brdf, tmp_path / "a.xml")
        text = (tmp_path / "a.xml").read_text()
        assert text.count("{ ") <= leaves + 8
        found.append(find_format("radiance").loss(brdf, tmp_path / "a.xml").rms[0])
    assert found[0] > 1.5 * found[1] > 2 * found[2]


def test_a_gloss_narrower_than_a_patch_adds_no_light():
    brdf = plain(0.3, (Lobe(0.03, np.full(3, 0.04), np.ones(3)),))
    value = matrix(brdf)
    from photogonio.reconstruct.export.radiance_klems import _projected_solid_angles

    albedo = _projected_solid_angles() @ value
    # of the outermost ring's farthest incidence, a smooth dielectric's at 90 degrees
    assert albedo.max() <= float(LUMINANCE @ brdf.directional_albedo(np.radians(89.9))) + 1e-9
    assert albedo[:100].max() < 0.4


def test_colours_become_gray_by_luminance(tmp_path):
    coefficients = np.array([[0.9, 0.5, 0.1]])
    brdf = Brdf(0, ("R", "G", "B"), np.array([[0, 0, 0]]), coefficients, np.zeros((1, 3)))
    find_format("radiance").write(brdf, tmp_path / "a.xml")
    up = np.array([[0.0, 0.0, 1.0]])
    found = read_radiance(tmp_path / "a.xml").evaluate(up, up)[0, 0]
    assert found == pytest.approx(float(coefficients[0] @ LUMINANCE) / (2 * np.pi), rel=1e-4)
