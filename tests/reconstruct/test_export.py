"""Exported files, read again by readers written from the formats' own descriptions."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf, Lobe, load_brdf
from photogonio.reconstruct.brdf.merl import read_merl
from photogonio.reconstruct.brdf.scatmech import read_scatmech, scatmech_brdf
from photogonio.reconstruct.export import FORMATS, find_format
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.modes.basis import isotropic_modes, reciprocal_modes


def satin(channels: tuple[str, ...] = ("R", "G", "B"), *, lobes: bool = True) -> Brdf:
    c = len(channels)
    modes = isotropic_modes(2)
    coefficients = np.zeros((len(modes), c))
    coefficients[0] = np.linspace(2.0, 1.0, c)
    coefficients[1] = 0.1
    lobe = Lobe(0.3, np.full(c, 0.04), np.ones(c))
    return Brdf(2, channels, modes, coefficients, np.zeros_like(coefficients), lobes=(lobe,) if lobes else ())


def pairs(count: int, below: float = 80.0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    theta = np.arccos(rng.uniform(np.cos(np.radians(below)), 1, (2, count)))
    phi = rng.uniform(0, 2 * np.pi, (2, count))
    return unit_vectors(theta[0], phi[0]), unit_vectors(theta[1], phi[1])


def read_tensors(path: Path) -> dict[str, np.ndarray]:
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
    FORMATS["mitsuba"].write(brdf, tmp_path / "a.bsdf")
    tensors = read_tensors(tmp_path / "a.bsdf")
    assert (tensors["vndf"] == 1).all()
    assert tensors["luminance"].min() > 0
    assert tensors["jacobian"][0] == 1
    incident, exit = pairs(400)
    found = np.array([measured_value(tensors, i, r) for i, r in zip(incident, exit, strict=True)])
    expected = brdf(incident, exit) * exit[:, 2:]
    # nodes lie 0.9 degrees of half vector and 3 degrees of incidence apart, or less
    error = np.sqrt(((found - expected) ** 2).sum() / (expected**2).sum())
    assert error < 0.01


def test_mitsuba_itself_opens_it(tmp_path):
    mi = pytest.importorskip("mitsuba", reason="mitsuba is not installed")
    mi.set_variant("scalar_rgb")
    brdf = satin()
    FORMATS["mitsuba"].write(brdf, tmp_path / "a.bsdf")
    material = mi.load_dict({"type": "measured", "filename": str(tmp_path / "a.bsdf")})
    incident, exit = pairs(50)
    for i, r in zip(incident, exit, strict=True):
        point = mi.SurfaceInteraction3f()
        point.wi = mi.Vector3f(*i)
        found = material.eval(mi.BSDFContext(), point, mi.Vector3f(*r))
        np.testing.assert_allclose(np.array(found), brdf(i[None], r[None])[0] * r[2], rtol=0.05)


def test_merl_keeps_channels_by_name(tmp_path):
    brdf = satin(("B", "G", "R"))
    FORMATS["merl"].write(brdf, tmp_path / "a.binary")
    incident, exit = pairs(300)
    found = read_merl(tmp_path / "a.binary").evaluate(incident, exit)
    # a bin is a degree or two wide, and this lobe 0.3 rad
    np.testing.assert_allclose(found, brdf(incident, exit)[:, ::-1], rtol=0.1)


def test_one_channel_is_repeated(tmp_path):
    brdf = satin(("Y",))
    for name in ("merl", "mitsuba"):
        FORMATS[name].write(brdf, tmp_path / name)
    found = read_merl(tmp_path / "merl").evaluate(*pairs(5))
    np.testing.assert_allclose(found[:, 0], found[:, 2], rtol=1e-12)
    rgb = read_tensors(tmp_path / "mitsuba")["rgb"]
    np.testing.assert_array_equal(rgb[:, :, 0], rgb[:, :, 1])


def test_scatmech_keeps_every_digit(tmp_path):
    brdf = satin(("Y",), lobes=False)
    FORMATS["scatmech"].write(brdf, tmp_path / "a.csv")
    table = read_scatmech(tmp_path / "a.csv")
    assert table.unpolarised.all()
    np.testing.assert_array_equal(np.sort(table.values), np.sort(brdf.coefficients[:, 0]))


@pytest.mark.parametrize(
    ("name", "brdf"),
    [
        ("merl", satin(("A", "B"))),
        ("mitsuba", satin(("A", "B"))),
        ("scatmech", satin(lobes=False)),
        (
            "merl",
            Brdf(0, ("Y",), reciprocal_modes(0), np.ones((1, 1)), np.zeros((1, 1)), symmetry="reciprocal"),
        ),
    ],
)
def test_what_a_format_cannot_hold_is_refused(tmp_path, name, brdf):
    with pytest.raises(InputError):
        FORMATS[name].write(brdf, tmp_path / "a")
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_format_is_refused():
    with pytest.raises(InputError, match="csv, merl, mitsuba, radiance, openpbr, gltf, modes, scatmech"):
        find_format("obj")


def coated(roughness: float = 0.4) -> Brdf:
    """A coat over a diffuse ground, which version 1 of the file does not know."""
    one = np.ones(1)
    coat = Lobe(roughness, 0.04 * one, one, "coat", fresnel="dielectric", ground=0.3 * one)
    return Brdf(0, ("Y",), isotropic_modes(0), np.full((1, 1), 0.1), np.zeros((1, 1)), lobes=(coat,))


def loss_of(found: Brdf, given: Brdf) -> float:
    """Rms of the difference over that of f, cosine weighted, both angles below 70 degrees, at random pairs."""
    rng = np.random.default_rng(5)
    theta = np.arcsin(np.sin(np.radians(70.0)) * np.sqrt(rng.uniform(size=(2, 20_000))))
    dphi = rng.uniform(0.0, np.pi, 20_000)
    f, g = (one.evaluate(theta[0], 0.0, theta[1], dphi) for one in (found, given))
    return float(np.sqrt(np.mean((f - g) ** 2) / np.mean(g**2)))


def test_modes_are_version_1_at_the_order_asked_and_the_loss_is_true(tmp_path):
    losses = []
    for order in (2, 8):
        said = FORMATS["modes"].write(coated(), tmp_path / "m.json", order=order)
        found = load_brdf(tmp_path / "m.json")
        assert found.version == 1 and found.order == order and "coat" not in (tmp_path / "m.json").read_text()
        losses.append(loss_of(found, coated()))
        # two digits are told, and the pairs are random
        stated = float(re.search(r"lose ([\d.e-]+) % of f", said)[1]) / 100.0
        assert losses[-1] == pytest.approx(stated, rel=0.12)
    assert losses[1] < losses[0] < 0.05
    assert FORMATS["modes"].write(satin(), tmp_path / "m.json") is None  # version 1 knows all of it
    assert load_brdf(tmp_path / "m.json").evaluate(0.3, 0.0, 0.9, 2.0) == pytest.approx(
        satin().evaluate(0.3, 0.0, 0.9, 2.0), rel=1e-12
    )


def test_scatmechs_modes_stand_for_lobes_and_what_they_lose_is_said(tmp_path):
    said = FORMATS["scatmech"].write(coated(), tmp_path / "s.csv", order=12)
    found = scatmech_brdf(read_scatmech(tmp_path / "s.csv"))
    assert not found.lobes and found.order == 12
    assert "modes to order 12 lose" in said
    assert loss_of(found, coated()) < 0.02
    with pytest.raises(InputError, match="--order 1"):
        FORMATS["scatmech"].write(satin(("Y",)), tmp_path / "s.csv", order=1)
