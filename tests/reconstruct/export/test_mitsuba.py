"""Mitsuba's tensor files: no light is added, turning surfaces and wavelengths, and our reader against Mitsuba."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.mitsuba import read_mitsuba, read_tensors
from photogonio.reconstruct.export import mitsuba
from photogonio.reconstruct.export.formats import find_format
from tests.drawn.exports import gloss, over_ground, random_pairs, satin

FORM = find_format("mitsuba")


@pytest.mark.parametrize("roughness", [0.03, 0.1, 0.3])
def test_no_light_is_added_toward_grazing(tmp_path, roughness):
    brdf = over_ground(gloss(roughness))
    FORM.write(brdf, tmp_path / "a.bsdf")
    loss = FORM.loss(brdf, tmp_path / "a.bsdf")
    assert max(loss.albedo) < 1.005
    assert loss.rms[0] < 0.005 and loss.rms[1] < 0.02


def test_a_brushed_surface_keeps_its_turn(tmp_path):
    brdf = over_ground(gloss((0.45, 0.2), azimuth=0.4))
    FORM.write(brdf, tmp_path / "a.bsdf")
    assert read_tensors(tmp_path / "a.bsdf")["phi_i"][0] == pytest.approx(-np.pi)
    assert FORM.loss(brdf, tmp_path / "a.bsdf").rms[0] < 0.02


def test_wavelengths_are_spectra_in_their_order(tmp_path):
    brdf = over_ground(gloss(0.3, 4), ("650", "450", "550 nm", "500"))
    FORM.write(brdf, tmp_path / "a.bsdf")
    found = read_mitsuba(tmp_path / "a.bsdf")
    assert found.channels == ("450", "500", "550", "650")
    up = np.array([[0.0, 0.1, 0.995]])
    np.testing.assert_allclose(found.evaluate(up, up)[0], brdf(up, up)[0, [1, 3, 2, 0]], rtol=0.01)


def test_every_slice_has_light_to_sample(tmp_path):
    black = Brdf(0, ("R", "G", "B"), np.zeros((0, 3), int), np.zeros((0, 3)), np.zeros((0, 3)))
    FORM.write(black, tmp_path / "a.bsdf")
    assert (read_tensors(tmp_path / "a.bsdf")["luminance"] > 0).all()


def tensors_of(path: Path) -> dict[str, np.ndarray]:
    """Mitsuba's tensor file, from its description."""
    data = path.read_bytes()
    assert data[:14] == b"tensor_file\0\1\0"
    (count,) = struct.unpack_from("<I", data, 14)
    place, tensors = 18, {}
    for _ in range(count):
        (length,) = struct.unpack_from("<H", data, place)
        name = data[place + 2 : place + 2 + length].decode()
        place += 2 + length
        ndim, kind, offset = struct.unpack_from("<HBQ", data, place)
        shape = struct.unpack_from(f"<{ndim}Q", data, place + 11)
        place += 11 + 8 * ndim
        dtype = {1: np.uint8, 10: np.float32}[kind]
        tensors[name] = np.frombuffer(data, dtype, int(np.prod(shape)), offset).reshape(shape)
    return tensors


def bilinear(table: np.ndarray, x: float, y: float) -> np.ndarray:
    """Of (..., rows, columns) at x along columns and y along rows, both 0 to 1."""
    n = table.shape[-1] - 1
    i, j = min(int(x * n), n - 1), min(int(y * n), n - 1)
    a, b = x * n - i, y * n - j
    low, high = ((1 - a) * table[..., row, i] + a * table[..., row, i + 1] for row in (j, j + 1))
    return (1 - b) * low + b * high


def measured_value(tensors: dict[str, np.ndarray], incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
    """f cos(exit) as the ``measured`` material looks it up (its warp is even, ndf / (4 sigma) is one)."""
    half = (incident + exit) / np.linalg.norm(incident + exit)
    theta_m, phi_m = np.arccos(min(half[2], 1.0)), np.arctan2(half[1], half[0])
    turn = phi_m - np.arctan2(incident[1], incident[0])
    u = np.sqrt(theta_m * 2 / np.pi)
    v = (turn + np.pi) / (2 * np.pi)
    v -= np.floor(v)
    theta_i, nodes = np.arccos(incident[2]), tensors["theta_i"]
    k = min(int(np.searchsorted(nodes, theta_i, side="right")) - 1, len(nodes) - 2)
    part = (theta_i - nodes[k]) / (nodes[k + 1] - nodes[k])
    low, high = (bilinear(tensors["rgb"][0, m], u, v) for m in (k, k + 1))
    factor = bilinear(tensors["ndf"], u, v) / (4 * bilinear(tensors["sigma"], u, v))
    return ((1 - part) * low + part * high) * factor


def test_mitsubas_tensor_file(tmp_path):
    brdf = satin()
    FORM.write(brdf, tmp_path / "a.bsdf")
    tensors = tensors_of(tmp_path / "a.bsdf")
    assert (tensors["vndf"] == 1).all()
    assert tensors["luminance"].min() > 0
    assert tensors["jacobian"][0] == 1
    incident, exit = random_pairs(400)
    found = np.array([measured_value(tensors, i, r) for i, r in zip(incident, exit, strict=True)])
    expected = brdf(incident, exit) * exit[:, 2:]
    # nodes lie 0.9 degrees of half vector and 3 degrees of incidence apart, or less
    error = np.sqrt(((found - expected) ** 2).sum() / (expected**2).sum())
    assert error < 0.01


def test_mitsuba_itself_opens_it(tmp_path):
    mi = pytest.importorskip("mitsuba", reason="mitsuba is not installed")
    mi.set_variant("scalar_rgb")
    brdf = satin()
    FORM.write(brdf, tmp_path / "a.bsdf")
    material = mi.load_dict({"type": "measured", "filename": str(tmp_path / "a.bsdf")})
    incident, exit = random_pairs(50)
    for i, r in zip(incident, exit, strict=True):
        point = mi.SurfaceInteraction3f()
        point.wi = mi.Vector3f(*i)
        found = material.eval(mi.BSDFContext(), point, mi.Vector3f(*r))
        np.testing.assert_allclose(np.array(found), brdf(i[None], r[None])[0] * r[2], rtol=0.05)


def test_two_channels_that_are_no_wavelengths_are_refused(tmp_path):
    with pytest.raises(InputError, match="--format mitsuba"):
        FORM.write(satin(("A", "B")), tmp_path / "a")
    assert list(tmp_path.iterdir()) == []


def test_one_channel_is_repeated(tmp_path):
    FORM.write(satin(("Y",)), tmp_path / "a.bsdf")
    rgb = tensors_of(tmp_path / "a.bsdf")["rgb"]
    np.testing.assert_array_equal(rgb[:, :, 0], rgb[:, :, 1])


def test_lines_between_nodes_are_near(tmp_path, monkeypatch):
    """Values on the curve would be off by its bend: h^2 f'' / 12 on the mean, which nodes a little lower take away."""
    brdf, form, found = over_ground(gloss(0.1)), find_format("mitsuba"), []
    for between in (mitsuba._between, lambda value, nodes: value):
        monkeypatch.setattr(mitsuba, "_between", between)
        form.write(brdf, tmp_path / "a.bsdf")
        found.append(form.loss(brdf, tmp_path / "a.bsdf").rms[0])
    assert found[0] < 0.005
    assert found[0] < 0.5 * found[1]
