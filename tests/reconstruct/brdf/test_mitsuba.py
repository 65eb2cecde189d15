"""Mitsuba's tensor files: our reader against Mitsuba, and files that are none."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.mitsuba import read_mitsuba
from photogonio.reconstruct.export import mitsuba
from photogonio.reconstruct.export.formats import find_format
from photogonio.reconstruct.export.loss import pairs
from tests.drawn.exports import gloss, over_ground

FORM = find_format("mitsuba")


@pytest.mark.parametrize("lobe", [gloss(0.2), gloss((0.45, 0.2), azimuth=0.4)], ids=["isotropic", "brushed"])
def test_mitsuba_looks_up_the_same(tmp_path, lobe, monkeypatch):
    mi = pytest.importorskip("mitsuba", reason="mitsuba is not installed")
    mi.set_variant("scalar_rgb")
    monkeypatch.setattr(mitsuba, "_TURNING_SLICE", 24)
    brdf = over_ground(lobe)
    FORM.write(brdf, tmp_path / "a.bsdf")
    material = mi.load_dict({"type": "measured", "filename": str(tmp_path / "a.bsdf")})
    incident, exit, _ = pairs(np.radians(80.0), np.random.default_rng(3), isotropic=False, count=60)
    found = read_mitsuba(tmp_path / "a.bsdf").evaluate(incident, exit) * exit[:, 2:]
    for i, r, f in zip(incident, exit, found, strict=True):
        point = mi.SurfaceInteraction3f()
        point.wi = mi.Vector3f(*i)
        there = np.array(material.eval(mi.BSDFContext(), point, mi.Vector3f(*r)))
        np.testing.assert_allclose(there, f, rtol=2e-4, atol=1e-6)  # Mitsuba reckons in single precision


@pytest.mark.parametrize("damage", [lambda d: d[:40], lambda d: b"x" + d, lambda d: d[: len(d) // 2]])
def test_damaged_files_are_refused(tmp_path, damage):
    FORM.write(over_ground(gloss(0.3)), tmp_path / "a.bsdf")
    (tmp_path / "a.bsdf").write_bytes(damage((tmp_path / "a.bsdf").read_bytes()))
    with pytest.raises(InputError):
        read_mitsuba(tmp_path / "a.bsdf")
