"""Models as a fit finds them, without any data, and their BRDFs."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.lobes.families import Family, families, retro_lobe
from photogonio.reconstruct.represent.as_found import lobes_of

SHAPE = {"roughness": 0.3, "f0": 0.05, "stretch": 1.2, "skew": 1.1}


def kinds() -> list[Family]:
    """Every kind of lobe, on an absolute scale and on a relative one."""
    found: list[Family] = []
    for absolute in (True, False):
        own = [f for turning in (False, True) for f in families(absolute=absolute, turning=turning)]
        found += [*own, own[0].with_beckmann, retro_lobe(absolute=absolute)]
    return found


def model_of(*lobes: Family, symmetry: str = "isotropic", order: int = 2, seed: int = 0) -> Model:
    """Of two channels: modes, most of it Lambert's, and lobes."""
    rng = np.random.default_rng(seed)
    basis = Basis(symmetry, order)
    coefficients = 0.02 * rng.normal(size=(len(basis.modes), 2))
    coefficients[0] = 1.0, 0.5
    shapes = tuple(np.array([SHAPE[name] for name in family.shape_names]) for family in lobes)
    count = sum(len(family.coefficient_names) for family in lobes)
    return Model(basis, coefficients, LobeSet(lobes, shapes), rng.uniform(0.1, 0.4, (count, 2)))


def as_found(model: Model) -> Brdf:
    """The BRDF that a fit of ``model`` writes."""
    return Brdf(
        order=model.basis.order,
        channels=tuple("RG"[: model.coefficients.shape[1]]),
        modes=model.basis.modes,
        coefficients=model.coefficients,
        standard_errors=np.zeros_like(model.coefficients),
        symmetry=model.basis.symmetry,
        lobes=lobes_of(model),
    )
