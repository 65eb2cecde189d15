"""BRDFs of modes and lobes of every kind that the coefficient file knows, and errors of all their numbers."""

from __future__ import annotations

import json
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf, load_brdf
from photogonio.reconstruct.brdf.errors import RelativeTable, Uncertain
from photogonio.reconstruct.brdf.parameters import lobe_numbers, mode_names
from photogonio.reconstruct.lobes.lobe import DISTRIBUTIONS, MASKINGS, Lobe
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.modes.basis import general_modes, isotropic_modes, reciprocal_modes

LISTS = {"isotropic": isotropic_modes, "reciprocal": reciprocal_modes, "general": general_modes}


WEIGHT, F0 = np.array([1.0, 0.7, 0.4]), np.array([0.04, 0.5, 0.9])


def directions(count, seed=0, lowest=89.0):
    rng = np.random.default_rng(seed)
    theta = np.arccos(rng.uniform(np.cos(np.radians(lowest)), 1.0, (2, count)))
    phi = rng.uniform(-np.pi, np.pi, (2, count))
    return unit_vectors(theta[0], phi[0]), unit_vectors(theta[1], phi[1])


def brdf_of(*lobes, symmetry="isotropic", order=2, seed=1, quantity="brdf"):
    modes = LISTS[symmetry](order)
    values = np.random.default_rng(seed).normal(size=(len(modes), 3))
    errors = np.full_like(values, np.nan)
    channels = ("R", "G", "B")
    return Brdf(order, channels, modes, values, errors, quantity, symmetry, tuple(lobes))


def mirror(roughness, **kind):
    f0 = np.full(3, 0.05) if kind.get("fresnel") == "dielectric" else F0
    return Lobe(roughness, f0, WEIGHT, **kind)


def coat(roughness, **kind):
    ground = np.array([0.35, 0.2, 0.1])
    return Lobe(roughness, np.full(3, 0.043), WEIGHT, "coat", fresnel="dielectric", ground=ground, **kind)


MIRRORS = [
    mirror(rough, distribution=distribution, masking=masking, fresnel=fresnel, azimuth=0.5)
    for rough, distribution, masking, fresnel in product(
        (0.05, 0.4, (0.45, 0.15)), DISTRIBUTIONS, MASKINGS, ("schlick", "dielectric")
    )
]


RETROS = [
    Lobe(0.1, np.ones(3), WEIGHT, model, distribution=name)
    for model, name in product(("retro", "round"), DISTRIBUTIONS)
]
COATS = [
    coat(rough, distribution=distribution, masking=masking)
    for rough, distribution, masking in product((0.06, 0.3), DISTRIBUTIONS, MASKINGS)
]


def uncertain(brdf, seed=3):
    """Errors of every number, which know of one another, and both tables."""
    names = mode_names(brdf.symmetry, brdf.modes)
    names += [f"lobe {k} {what}" for k, lobe in enumerate(brdf.lobes) for what in lobe_numbers(lobe)]
    rng = np.random.default_rng(seed)
    root = 0.003 * rng.normal(size=(len(brdf.channels), len(names), len(names)))
    covariance = root @ np.swapaxes(root, 1, 2)
    errors = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).T
    table = RelativeTable(
        np.array([20.0, 60.0]),
        np.array([20.0, 60.0]),
        np.array([45.0, 135.0]),
        rng.uniform(0, 0.1, (2, 2, 2)),
    )
    one = RelativeTable(np.array([45.0]), np.array([45.0]), np.array([90.0]), np.full((1, 1, 1), 0.02))
    known = Uncertain(tuple(names), errors, covariance, 0.005, table, one)
    return Brdf(brdf.order, brdf.channels, brdf.modes, brdf.coefficients, errors[: len(brdf.modes)],
                symmetry=brdf.symmetry, lobes=brdf.lobes, uncertainty=known)  # fmt: skip


def refused(path: Path, good: dict, wrong: dict) -> str:
    """What is said of a coefficient file that is ``good`` but for what is ``wrong``: one line."""
    path.write_text(json.dumps(good))
    load_brdf(path)
    path.write_text(json.dumps(good | wrong))
    with pytest.raises(InputError) as error:
        load_brdf(path)
    assert "\n" not in str(error.value)
    return str(error.value)


def with_every_key(symmetry: str = "isotropic", **given) -> Brdf:
    """A BRDF whose file of version 1 has every key, and such as the page does not know."""
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
