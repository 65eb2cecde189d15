"""Mitsuba's tensor files: no light is added, turning surfaces and wavelengths, and our reader against Mitsuba."""

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf, Lobe
from photogonio.reconstruct.brdf.mitsuba import read_mitsuba, read_tensors
from photogonio.reconstruct.export import find_format, mitsuba
from photogonio.reconstruct.export.loss import pairs

FORM = find_format("mitsuba")


def brdf_of(lobe: Lobe, channels=("R", "G", "B")) -> Brdf:
    count = len(channels)
    return Brdf(
        0, channels, np.array([[0, 0, 0]]), np.full((1, count), 0.4), np.zeros((1, count)), lobes=(lobe,)
    )


def mirror(roughness, count=3, **more) -> Lobe:
    return Lobe(roughness, np.linspace(0.04, 0.06, count), np.ones(count), **more)


@pytest.mark.parametrize("roughness", [0.03, 0.1, 0.3])
def test_no_light_is_added_toward_grazing(tmp_path, roughness):
    brdf = brdf_of(mirror(roughness))
    FORM.write(brdf, tmp_path / "a.bsdf")
    loss = FORM.loss(brdf, tmp_path / "a.bsdf")
    assert max(loss.albedo) < 1.01
    assert loss.rms[0] < 0.01 and loss.rms[1] < 0.02


def test_a_brushed_surface_keeps_its_turn(tmp_path):
    brdf = brdf_of(mirror((0.45, 0.2), azimuth=0.4))
    FORM.write(brdf, tmp_path / "a.bsdf")
    assert read_tensors(tmp_path / "a.bsdf")["phi_i"][0] == pytest.approx(-np.pi)
    assert FORM.loss(brdf, tmp_path / "a.bsdf").rms[0] < 0.02


def test_wavelengths_are_spectra_in_their_order(tmp_path):
    brdf = brdf_of(mirror(0.3, 4), ("650", "450", "550 nm", "500"))
    FORM.write(brdf, tmp_path / "a.bsdf")
    found = read_mitsuba(tmp_path / "a.bsdf")
    assert found.channels == ("450", "500", "550", "650")
    up = np.array([[0.0, 0.1, 0.995]])
    np.testing.assert_allclose(found.evaluate(up, up)[0], brdf(up, up)[0, [1, 3, 2, 0]], rtol=0.01)


@pytest.mark.parametrize(
    "lobe", [mirror(0.2), mirror((0.45, 0.2), azimuth=0.4)], ids=["isotropic", "brushed"]
)
def test_mitsuba_looks_up_the_same(tmp_path, lobe, monkeypatch):
    mi = pytest.importorskip("mitsuba", reason="mitsuba is not installed")
    mi.set_variant("scalar_rgb")
    monkeypatch.setattr(mitsuba, "_TURNING_SLICE", 24)
    brdf = brdf_of(lobe)
    FORM.write(brdf, tmp_path / "a.bsdf")
    material = mi.load_dict({"type": "measured", "filename": str(tmp_path / "a.bsdf")})
    incident, exit, _ = pairs(np.radians(80.0), np.random.default_rng(3), isotropic=False, count=60)
    found = read_mitsuba(tmp_path / "a.bsdf").evaluate(incident, exit) * exit[:, 2:]
    for i, r, f in zip(incident, exit, found, strict=True):
        point = mi.SurfaceInteraction3f()
        point.wi = mi.Vector3f(*i)
        there = np.array(material.eval(mi.BSDFContext(), point, mi.Vector3f(*r)))
        np.testing.assert_allclose(there, f, rtol=2e-4, atol=1e-6)  # Mitsuba reckons in single precision


def test_every_slice_has_light_to_sample(tmp_path):
    black = Brdf(0, ("R", "G", "B"), np.zeros((0, 3), int), np.zeros((0, 3)), np.zeros((0, 3)))
    FORM.write(black, tmp_path / "a.bsdf")
    assert (read_tensors(tmp_path / "a.bsdf")["luminance"] > 0).all()


@pytest.mark.parametrize("damage", [lambda d: d[:40], lambda d: b"x" + d, lambda d: d[: len(d) // 2]])
def test_damaged_files_are_refused(tmp_path, damage):
    FORM.write(brdf_of(mirror(0.3)), tmp_path / "a.bsdf")
    (tmp_path / "a.bsdf").write_bytes(damage((tmp_path / "a.bsdf").read_bytes()))
    with pytest.raises(InputError):
        read_mitsuba(tmp_path / "a.bsdf")
