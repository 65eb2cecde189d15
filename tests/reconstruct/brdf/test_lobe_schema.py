"""Lobes in the coefficient file: defaults, and what is refused."""

from __future__ import annotations

import json

import pytest

from photogonio.reconstruct.brdf.brdf import load_brdf
from tests.drawn.brdfs import refused

GOOD = {"format": "surface-scattering-modes", "version": 2, "channels": ["Y"], "modes": [[0, 0, 0]],
        "coefficients": [[1.0]]}  # fmt: skip
MIRROR = {"model": "mirror", "roughness": 0.3, "f0": [0.04], "weight": [1.0]}
COAT = {"model": "coat", "roughness": 0.3, "f0": 0.04, "weight": [1.0], "ground": [0.3]}
WRONG = {
    "lobes[0].model": {"lobes": [MIRROR | {"model": "phong"}]},
    "lobes[0].distribution": {"lobes": [MIRROR | {"distribution": "gauss"}]},
    "lobes[0].masking": {"lobes": [MIRROR | {"masking": "none"}]},
    "lobes[0].fresnel": {"lobes": [COAT | {"fresnel": "schlick"}]},
    "lobes[0].roughness": {"lobes": [MIRROR | {"roughness": [0.3, 0.0]}]},
    "lobes[0].azimuth": {"lobes": [MIRROR | {"roughness": [0.3, 0.2], "azimuth": "north"}]},
    "lobes[0].f0": {"lobes": [COAT | {"f0": [0.04]}]},
    "lobes[0].ground": {"lobes": [{key: value for key, value in COAT.items() if key != "ground"}]},
}


@pytest.mark.parametrize("key", WRONG)
def test_what_is_refused_names_the_key(tmp_path, key):
    path = tmp_path / "bad.json"
    assert refused(path, GOOD | {"lobes": [MIRROR, COAT]}, WRONG[key]).startswith(f"{path}: {key.strip()}: ")


def test_defaults_are_the_pages(tmp_path):
    lobes = [{"model": "ggx"} | {key: MIRROR[key] for key in ("roughness", "f0", "weight")}, MIRROR, COAT]
    (tmp_path / "b.json").write_text(json.dumps(GOOD | {"lobes": lobes}))
    first, second, third = load_brdf(tmp_path / "b.json").lobes
    assert (first.model, first.distribution, first.masking, first.fresnel) == (
        "mirror", "ggx", "correlated", "schlick",
    )  # fmt: skip
    assert first.evaluate(0.3, 0.4, 2.0) == pytest.approx(second.evaluate(0.3, 0.4, 2.0), rel=1e-15)
    assert third.fresnel == "dielectric"
