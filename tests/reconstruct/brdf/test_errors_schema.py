"""Errors in the coefficient file: kept to the bit, beside it where they are many, refused where they are wrong."""

from __future__ import annotations

import json

import pytest

from photogonio.reconstruct.brdf.brdf import load_brdf
from tests.drawn.brdfs import RETROS, brdf_of, coat, mirror, refused, uncertain


def test_a_round_trip_keeps_every_bit(tmp_path):
    brdf = uncertain(brdf_of(coat(0.3), mirror((0.45, 0.2), azimuth=0.5), RETROS[1], symmetry="reciprocal"))
    brdf.save(tmp_path / "a.json")
    load_brdf(tmp_path / "a.json").save(tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    assert json.loads((tmp_path / "a.json").read_text())["version"] == 2


def test_keys_that_the_page_does_not_know_are_kept_wherever_they_stand(tmp_path):
    brdf = uncertain(brdf_of(coat(0.3)))
    brdf.save(tmp_path / "a.json")
    document = json.loads((tmp_path / "a.json").read_text())
    document["covariance"]["note"] = document["beyond"]["misfit"]["note"] = {"kept": [1, "two"]}
    document["beyond"]["note"] = "kept"
    (tmp_path / "a.json").write_text(json.dumps(document))
    load_brdf(tmp_path / "a.json").save(tmp_path / "b.json")
    assert json.loads((tmp_path / "b.json").read_text()) == document


GOOD = {"format": "surface-scattering-modes", "version": 2, "channels": ["Y"], "modes": [[0, 0, 0]],
        "coefficients": [[1.0]]}  # fmt: skip
MIRROR = {"model": "mirror", "roughness": 0.3, "f0": [0.04], "weight": [1.0]}
TABLE = {"theta_i": [45], "theta_r": [45], "dphi": [90], "relative": [[[0.1]]]}
WRONG = {
    "parameters": {"parameters": ["S 0 0 0", "lobe 0 roughness"]},
    "parameters ": {"lobes": [MIRROR], "parameters": ["S 0 0 0", "lobe 0 ground"]},
    "parameters  ": {"parameters": []},
    "standard_errors": {"parameters": ["S 0 0 0"], "standard_errors": [[0.1], [0.2]]},
    "covariance": {"parameters": ["S 0 0 0"], "covariance": [1.0]},
    "covariance.channels": {"parameters": ["S 0 0 0"], "covariance": {"channels": [[1.0, 2.0]]}},
    "parameters   ": {"parameters": ["S 2 0 0"]},
    "parameters    ": {"lobes": [MIRROR], "parameters": ["S 0 0 0", "lobe 0 f0", "lobe 0 f0"]},
    "standard_errors ": {"standard_errors": [[-1]], "parameters": ["S 0 0 0"]},
    "standard_errors  ": {"standard_errors": [[float("nan")]], "parameters": ["S 0 0 0"]},
    "standard_errors   ": {"standard_errors": [[float("inf")]], "parameters": ["S 0 0 0"]},
    "covariance ": {"covariance": {}},
    "covariance  ": {"covariance": {"channels": [[-1.0]]}},
    "covariance   ": {
        "lobes": [MIRROR],
        "parameters": ["S 0 0 0", "lobe 0 f0"],
        "covariance": {"channels": [[1.0, 3.0, 4.0]]},
    },
    "covariance.file": {"covariance": {"file": "../covariance.npz"}},
    "lobes[0].f0": {"lobes": [MIRROR | {"f0": [2.0]}]},
    "lobes[0].weight": {"lobes": [MIRROR | {"weight": [-0.1]}]},
    "lobes[0].ground": {"lobes": [MIRROR | {"model": "coat", "f0": 0.04, "ground": [-0.1]}]},
    "covariance    ": {
        "standard_errors": [[0.1]],
        "parameters": ["S 0 0 0"],
        "covariance": {"channels": [[1.0]]},
    },
    "covariance     ": {
        "lobes": [MIRROR],
        "parameters": ["S 0 0 0", "lobe 0 f0", "lobe 0 weight"],
        "covariance": {"channels": [[1.0, -0.9, 1.0, -0.9, -0.9, 1.0]]},
    },
    "standard_errors    ": {"standard_errors": [["0.1"]], "parameters": ["S 0 0 0"]},
    "standard_errors     ": {"standard_errors": [[True]], "parameters": ["S 0 0 0"]},
    "covariance.channels ": {"covariance": {"channels": [["1.0"]]}},
    "modes": {"modes": [[False, 0, 0]]},
    "beyond.misfit.theta_i ": {"beyond": {"misfit": TABLE | {"theta_i": [1000]}}},
    "beyond.misfit.relative ": {"beyond": {"misfit": TABLE | {"relative": [[["0.1"]]]}}},
    "beyond": {"beyond": 0.1},
    "beyond.scale": {"beyond": {"scale": -0.1}},
    "beyond.misfit.theta_i": {"beyond": {"misfit": TABLE | {"theta_i": [50, 40]}}},
    "beyond.misfit.relative": {"beyond": {"misfit": TABLE | {"relative": [[[float("nan")]]]}}},
    "beyond.unseen.relative": {"beyond": {"unseen": TABLE | {"relative": [0.1, 0.2]}}},
}


@pytest.mark.parametrize("key", WRONG)
def test_what_is_refused_names_the_key(tmp_path, key):
    path = tmp_path / "bad.json"
    assert refused(path, GOOD, WRONG[key]).startswith(f"{path}: {key.strip()}: ")
