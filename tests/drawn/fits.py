"""Models as a fit finds them, without any data, and their BRDFs."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.estimate.lobe_search import search_lobes
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.pilot import PILOT_PRIOR, Cleaned
from photogonio.reconstruct.estimate.weights import ViewScales, error_model
from photogonio.reconstruct.lobes.families import Family, blinn_phong_lobe, families, retro_lobe, round_lobe
from photogonio.reconstruct.represent.as_found import lobes_of
from photogonio.reconstruct.table.cells import Cells

SHAPE = {"roughness": 0.3, "f0": 0.05, "stretch": 1.2, "skew": 1.1}


def kinds() -> list[Family]:
    """Every kind of lobe, on an absolute scale and on a relative one."""
    found: list[Family] = []
    for absolute in (True, False):
        own = [f for turning in (False, True) for f in families(absolute=absolute, turning=turning)]
        peaks = [one(absolute=absolute) for one in (retro_lobe, round_lobe, blinn_phong_lobe)]
        found += [*own, own[0].with_beckmann, *peaks]
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


def cleaned(given: Cells, *lobes: LobeSet, order: int = 2) -> Cleaned:
    """Rows that nothing was removed from, with a pilot of each set of ``lobes``, whose shapes stay."""
    deviation = error_model(given)
    basis, errors = Basis("isotropic", order), np.zeros(len(given.groups))
    pilots = tuple(
        search_lobes(given, deviation, basis, PILOT_PRIOR, one, free=0, refine=False)
        for one in lobes or (LobeSet(),)
    )
    return Cleaned(given, deviation, np.zeros_like(given.value), ViewScales.none(errors), pilots)
