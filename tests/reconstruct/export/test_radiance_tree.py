"""Tensor trees for Radiance: how much is lost."""

import re

import numpy as np

from photogonio.reconstruct.brdf.brdf import Lobe
from photogonio.reconstruct.export import radiance_tree
from photogonio.reconstruct.export.formats import find_format
from tests.drawn.exports import plain


def test_a_lambertian_surface_is_the_same_everywhere(tmp_path):
    form = find_format("radiance", "tree")
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
    for leaves in (500, 4_000, 32_000):
        monkeypatch.setattr(radiance_tree, "_FEW", leaves)
        monkeypatch.setattr(radiance_tree, "_MOST", leaves)
        find_format("radiance").write(brdf, tmp_path / "a.xml")
        text = (tmp_path / "a.xml").read_text()
        assert len(re.findall(r"[0-9.e-]+", text.partition("<ScatteringData>")[2])) <= leaves + 16
        found.append(find_format("radiance").loss(brdf, tmp_path / "a.xml").rms[0])
    assert found[0] > 1.5 * found[1] > 2 * found[2]


def test_a_gloss_toward_grazing_adds_no_light(tmp_path, monkeypatch):
    monkeypatch.setattr(radiance_tree, "_MOST", 400_000)
    brdf = plain(0.3, (Lobe(0.1, np.full(3, 0.04), np.ones(3)),))
    form = find_format("radiance")
    form.write(brdf, tmp_path / "a.xml")
    # the quadrature falls on cells of another size each, which is worth half a hundredth
    assert max(form.loss(brdf, tmp_path / "a.xml").albedo) < 1.005
