"""The coefficient file: whole on a round trip, refused in one line where it is wrong."""

from __future__ import annotations

import json

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf, Lobe, load_brdf
from photogonio.reconstruct.lobes.schlick import ggx
from photogonio.reconstruct.modes import basis as m
from photogonio.reconstruct.modes.angles import unit_vectors
from tests import oracles

LISTS = {"isotropic": m.isotropic_modes, "reciprocal": m.reciprocal_modes, "general": m.general_modes}


def make(symmetry: str = "isotropic", **given) -> Brdf:
    modes = LISTS[symmetry](2)
    rng = np.random.default_rng(1)
    values, errors = rng.normal(size=(len(modes), 3)), rng.uniform(size=(len(modes), 3))
    errors[0, 1] = np.nan
    lobe = Lobe(0.31, np.array([0.04, 0.05, 0.1 / 3]), np.ones(3), extra={"note": "kept"})
    rest = {
        "lobes": (lobe,),
        "scale": "relative",
        "valid": {"theta_i_max": 80.0, "theta_r_max": 75.5},
        "fit": {"order": "auto", "residual": 0.1 / 7, "rows": [1, 2]},
        "source": {"photos": ["a.png"]},
        "extra": {"licence": {"name": "none", "years": [1996]}},
    }
    return Brdf(2, ("R", "G", "B"), modes, values, errors, symmetry=symmetry, **(rest | given))


@pytest.mark.parametrize("quantity", ["brdf", "brdf_cos", "brdf_cos_cos"])
@pytest.mark.parametrize("symmetry", LISTS)
def test_round_trip(tmp_path, symmetry, quantity):
    given = make(symmetry, quantity=quantity)
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
    path.write_text(json.dumps(GOOD))
    load_brdf(path)
    path.write_text(json.dumps(GOOD | WRONG[key]))
    with pytest.raises(InputError) as refused:
        load_brdf(path)
    message = str(refused.value)
    assert message.startswith(f"{path}: {key.strip()}: ") and "\n" not in message


def test_files_that_are_none(tmp_path):
    with pytest.raises(InputError, match=r"absent\.json: "):
        load_brdf(tmp_path / "absent.json")
    for text in ("{", "[1, 2]", "null"):
        (tmp_path / "x.json").write_text(text)
        with pytest.raises(InputError, match=r"x\.json: "):
            load_brdf(tmp_path / "x.json")


def test_a_failed_save_leaves_the_old_file(tmp_path):
    path = tmp_path / "brdf.json"
    make().save(path)
    before = path.read_bytes()
    broken = make(extra={"object": object()})
    with pytest.raises(TypeError):
        broken.save(path)
    unwritable = make()
    values = unwritable.coefficients.copy()
    values[0, 0] = np.nan  # coefficients must be finite; only standard errors may be unknown
    with pytest.raises(ValueError, match="JSON"):
        Brdf(2, ("R", "G", "B"), unwritable.modes, values, values).save(path)
    assert path.read_bytes() == before and len(list(tmp_path.iterdir())) == 1


# --- evaluation ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("symmetry", LISTS)
def test_call_on_vectors_is_evaluation_at_angles(symmetry):
    brdf = make(symmetry)
    angles = np.random.default_rng(4).uniform(0, 1.5, (4, 7, 3))
    called = brdf(unit_vectors(angles[0], angles[1]), unit_vectors(angles[2], angles[3]))
    assert called.shape == (7, 3, 3)
    assert called == pytest.approx(brdf.evaluate(*angles), rel=1e-11, abs=1e-11)
    assert brdf.evaluate(0.1, 0.2, angles[2], 0.0).shape == (7, 3, 3)
    assert brdf.evaluate(0.1, 0.2, 0.3, 0.4).shape == (3,)
    assert brdf.evaluate(np.empty(0), 0.0, 0.3, 0.4).shape == (0, 3)


def test_only_the_difference_of_azimuths_counts_if_isotropic():
    brdf = make()
    phi = np.linspace(0, 40, 50)
    assert np.abs(brdf.evaluate(0.7, phi, 1.0, phi + 0.5) - brdf.evaluate(0.7, 0.0, 1.0, 0.5)).max() < 1e-12


def test_a_brdf_of_lobes_alone(tmp_path):
    none = np.empty((0, 1))
    lobe = Lobe(0.2, np.array([0.5]), np.array([2.0]))
    brdf = Brdf(0, ("Y",), np.empty((0, 3), int), none, none, lobes=(lobe,))
    brdf.save(tmp_path / "l.json")
    back = load_brdf(tmp_path / "l.json")
    assert back.evaluate(0.3, 0, 0.4, 2.0) == pytest.approx(2 * ggx(0.3, 0.4, 2.0, 0.2, [0.5]), rel=1e-14)
    assert back.directional_albedo(0.5) == pytest.approx(lobe.directional_albedo(0.5))
    assert back.directional_albedo(np.empty(0)).shape == (0, 1)
