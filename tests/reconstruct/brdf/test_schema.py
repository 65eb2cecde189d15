"""The coefficient file: whole on a round trip, refused in one line where it is wrong."""

from __future__ import annotations

import json

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import load_brdf
from tests import file_oracle, oracles
from tests.drawn.brdfs import LISTS, directions, refused, with_every_key


@pytest.mark.parametrize("quantity", ["brdf", "brdf_cos", "brdf_cos_cos"])
@pytest.mark.parametrize("symmetry", LISTS)
def test_round_trip(tmp_path, symmetry, quantity):
    given = with_every_key(symmetry, quantity=quantity)
    given.save(tmp_path / "one.json")
    back = load_brdf(tmp_path / "one.json")
    back.save(tmp_path / "two.json")
    assert (tmp_path / "one.json").read_bytes() == (tmp_path / "two.json").read_bytes()
    for name in ("modes", "coefficients", "standard_errors"):
        assert np.array_equal(getattr(back, name), getattr(given, name), equal_nan=name == "standard_errors")
    for name in ("order", "channels", "quantity", "symmetry", "scale", "valid", "fit", "source", "extra"):
        assert getattr(back, name) == getattr(given, name)
    assert back.lobes[0].extra == {"note": "kept"} and back.lobes[0].roughness == 0.31
    assert np.array_equal(back.lobes[0].f0, given.lobes[0].f0)
    assert [p.name for p in tmp_path.iterdir() if p.suffix != ".json"] == []


def test_the_file_of_the_page(tmp_path):
    """As docs/modes.md shows it, comments and all."""
    page = {
        "format": "surface-scattering-modes", "version": 1, "quantity": "brdf", "_": "a comment",
        "symmetry": "isotropic",
        "order": 8, "channels": ["R", "G", "B"], "modes": [[0, 0, 0], [1, 1, 1]],
        "coefficients": [[0.5, 0.4, 0.3], [0.0, 0.0, 0.1]], "standard_errors": [[0.001] * 3, [0.002] * 3],
        "lobes": [{"model": "ggx", "roughness": 0.31, "f0": [0.04] * 3, "weight": [1.0] * 3}],
        "scale": "absolute", "valid": {"theta_i_max": 80.0, "theta_r_max": 80.0}, "fit": {}, "source": {},
    }  # fmt: skip
    path = tmp_path / "page.json"
    path.write_text(json.dumps(page))
    brdf = load_brdf(path)
    brdf.save(path)
    assert json.loads(path.read_text()) == page
    angles = (0.4, 0.9, 2.2)
    exact = [
        a * oracles.isotropic(0, 0, 0, *angles)
        + b * oracles.isotropic(1, 1, 1, *angles)
        + oracles.ggx(*angles, 0.31, 0.04)
        for a, b in zip(*page["coefficients"], strict=True)
    ]
    assert brdf.evaluate(0.4, 0.0, 0.9, 2.2) == pytest.approx(exact, rel=1e-12)


def test_defaults_of_what_may_be_left_out(tmp_path):
    path = tmp_path / "short.json"
    path.write_text(json.dumps({"format": "surface-scattering-modes", "version": 1, "channels": ["Y"],
                                "modes": [[2, 0, 0]], "coefficients": [[0.5]]}))  # fmt: skip
    brdf = load_brdf(path)
    assert (brdf.order, brdf.quantity, brdf.symmetry, brdf.scale, brdf.lobes) == (
        2,
        "brdf",
        "isotropic",
        "absolute",
        (),
    )
    assert np.isnan(brdf.standard_errors).all()


def test_version_1_is_read_and_written_back_as_it_was(tmp_path):
    lobes = [
        {"model": "ggx", "roughness": 0.31, "f0": [0.04], "weight": [1.0]},
        {"model": "retro-beckmann", "roughness": 0.2, "f0": [1.0], "weight": [0.3]},
    ]
    page = {"format": "surface-scattering-modes", "version": 1, "quantity": "brdf", "symmetry": "isotropic",
            "order": 0, "channels": ["Y"], "modes": [[0, 0, 0]], "coefficients": [[0.5]], "standard_errors": [[0.1]],
            "lobes": lobes, "scale": "absolute", "valid": {}, "fit": {}, "source": {}}  # fmt: skip
    (tmp_path / "one.json").write_text(json.dumps(page))
    brdf = load_brdf(tmp_path / "one.json")
    incident, exit = directions(300)
    page_f = file_oracle.f_of(tmp_path / "one.json", incident, exit)
    np.testing.assert_allclose(brdf(incident, exit), page_f, rtol=1e-9)
    brdf.save(tmp_path / "back.json")
    assert json.loads((tmp_path / "back.json").read_text()) == page


GOOD = {"format": "surface-scattering-modes", "version": 1, "order": 2, "channels": ["Y"],
        "modes": [[0, 0, 0], [2, 2, 0]],
        "coefficients": [[1.0], [2.0]], "standard_errors": [[0.1], [0.1]]}  # fmt: skip
LOBE = {"model": "ggx", "roughness": 0.3, "f0": [0.04], "weight": [1.0]}
WRONG = {
    "format": {"format": "other"},
    "version": {"version": 3},
    "channels": {"channels": []},
    "quantity": {"quantity": "f"},
    "symmetry": {"symmetry": "round"},
    "scale": {"scale": 3},
    "order": {"order": 1},
    "modes": {"modes": [[0, 0, 0], [1, 2, 0]]},
    "modes ": {"modes": [[0, 0], [1, 1]]},
    "modes  ": {"modes": [[0, 0, 0], [0, 0, 0]]},
    "modes   ": {"modes": [[0, 0, 0], [2, 0, 0.5]]},
    "modes    ": {"modes": None},
    "coefficients": {"coefficients": [[1.0]]},
    "coefficients ": {"coefficients": [[1.0], [None]]},
    "coefficients  ": {"coefficients": "many"},
    "standard_errors": {"standard_errors": [[1.0, 2.0], [1.0, 2.0]]},
    "fit": {"fit": 3},
    "lobes": {"lobes": {"model": "ggx"}},
    "lobes[0].model": {"lobes": [LOBE | {"model": "phong"}]},
    "lobes[0].roughness": {"lobes": [LOBE | {"roughness": 0}]},
    "lobes[0].f0": {"lobes": [LOBE | {"f0": [0.1, 0.2]}]},
    "lobes[0].weight": {"lobes": [LOBE | {"weight": None}]},
}


@pytest.mark.parametrize("key", WRONG)
def test_what_is_refused(tmp_path, key):
    path = tmp_path / "bad.json"
    assert refused(path, GOOD, WRONG[key]).startswith(f"{path}: {key.strip()}: ")
