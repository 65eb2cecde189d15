"""Beliefs to begin with: kinds of material before any photo, and a result with the errors that it states."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.errors import Uncertain
from photogonio.reconstruct.design.belief import Belief
from photogonio.reconstruct.design.pairs import SeenPairs
from photogonio.reconstruct.lobes.lobe import Lobe

# by kind: albedo of the ground, base reflectance, weight and roughness of its gloss (None: no gloss), and how unlike
# such a model a surface of the kind may be, relative to f
MATERIALS: dict[str, tuple[float, float, float, float | None, float]] = {
    "matte": (0.5, 0.04, 0.0, None, 0.25),
    "satin": (0.4, 0.04, 1.0, 0.4, 0.2),
    "plastic": (0.4, 0.04, 1.0, 0.25, 0.15),
    "gloss": (0.4, 0.04, 1.0, 0.1, 0.15),
    "metal": (0.02, 0.7, 1.0, 0.25, 0.2),
}
USUAL = "satin"
UNSURE_ALBEDO = 0.5  # standard deviations before any photo, relative
UNSURE_WEIGHT = 0.7
UNSURE_ROUGHNESS = 0.4
UNSURE_FRESNEL = 0.3
TOWARD_GRAZING = 1.0  # by how much more, at 90 degrees, a surface may be unlike its model


def material(name: str) -> Brdf:
    """A kind's BRDF, of one channel, with how unsure its numbers are. Raises KeyError for an unknown kind."""
    albedo, f0, weight, roughness, _ = MATERIALS[name]
    lobes: tuple[Lobe, ...] = ()
    names, errors = ["S 0 0 0"], [UNSURE_ALBEDO * 2.0 * albedo]
    if roughness is not None:
        lobes = (Lobe(roughness, np.array([f0]), np.array([weight])),)
        names += ["lobe 0 roughness", "lobe 0 f0", "lobe 0 weight"]
        errors += [UNSURE_ROUGHNESS * roughness, UNSURE_FRESNEL * f0, UNSURE_WEIGHT * weight]
    uncertain = Uncertain(tuple(names), np.array(errors)[:, None])
    coefficients = np.array([[2.0 * albedo]])  # S 0 0 0 is 1 / (2 pi)
    mode = np.zeros((1, 3), int)
    return Brdf(0, ("Y",), mode, coefficients, np.array([[errors[0]]]), lobes=lobes, uncertainty=uncertain)


def of_material(name: str, *, turning: bool = False, limit: float = 80.0) -> Belief:
    """What is believed of a kind of material before any photo."""
    unlike = MATERIALS[name][4]

    def amplitude(pairs: SeenPairs) -> np.ndarray:
        steep = np.maximum(np.abs(pairs.theta_i), np.abs(pairs.theta_r)) / (0.5 * np.pi)
        return unlike * (1.0 + TOWARD_GRAZING * steep**3)

    return Belief.of(material(name), amplitude, turning=turning, limit=limit)


def of_result(brdf: Brdf, *, turning: bool, limit: float = 80.0) -> Belief:
    """What a result leaves open, of the channel that is known worst. Raises ValueError if it knows no errors."""
    known = brdf.uncertainty
    if known is not None and known.missing is not None:
        raise ValueError(f"{known.missing.get('file')} is missing beside it: how sure f is cannot be told")
    if known is None or not np.isfinite(known.spread()).all():
        raise ValueError("says no standard errors")
    one = brdf.only([worst_channel(brdf)])
    tables = one.uncertainty
    assert tables is not None

    def table(which: str, pairs: SeenPairs) -> np.ndarray:
        found = getattr(tables, which)
        if found is None:
            return np.zeros(len(pairs))
        return np.asarray(found.at(pairs.theta_i, pairs.theta_r, pairs.dphi), float)

    def amplitude(pairs: SeenPairs) -> np.ndarray:
        return table("unseen", pairs)

    def floor(pairs: SeenPairs) -> np.ndarray:
        return np.hypot(table("misfit", pairs), tables.scale)

    return Belief.of(one, amplitude, turning=turning, limit=limit, floor=floor)


def worst_channel(brdf: Brdf) -> int:
    """The place of the channel whose albedo's modes have the largest relative errors."""
    theta = np.radians([10.0, 30.0, 50.0, 65.0])
    zero = np.zeros_like(theta)
    f, error = (
        brdf.evaluate(theta, zero, theta, zero + 2.0),
        brdf.standard_error(theta, zero, theta, zero + 2.0),
    )
    return int(np.argmax(np.mean(error / np.maximum(np.abs(f), 1e-9), axis=0)))
