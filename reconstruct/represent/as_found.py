"""A fitted model in the coefficient file's terms: its own modes, and its lobes as they were found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from photogonio.reconstruct.brdf.parameters import lobe_numbers, number_of
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.lobes.families import TYPICAL_F0, Family, turned_roughness
from photogonio.reconstruct.lobes.lobe import Lobe

STEP = 1e-4  # of a coefficient or of a shape's logarithm, in finite differences
LEAST = 1e-3  # size of a coefficient of which the step is taken


def lobes_of(model: Model) -> tuple[Lobe, ...]:
    """The model's lobes."""
    lobes = [lobe_of(*part) for part in _parts(model.lobes, model.lobe_coefficients)]
    # the search ends at 1, but for rounding
    return tuple(one if one.turning else replace(one, roughness=min(one.axes[0], 1.0)) for one in lobes)


def lobe_of(family: Family, shape: np.ndarray, own: np.ndarray, cover: float = 1.0) -> Lobe:
    """One lobe; ``own`` (q, c) its coefficients, ``cover`` the part of the surface that a lobe of weight 1 covers."""
    roughness: float | tuple[float, float] = float(shape[0])
    azimuth = 0.0
    if family.turning:
        along, across, azimuth = turned_roughness(shape)
        roughness = (float(along), float(across))
    one = np.ones_like(own[0])
    kind: dict[str, Any] = {"distribution": family.distribution, "azimuth": azimuth}
    if family.peak:
        model = {"light": "retro", "mirror": "round", "normal": "blinn-phong"}[family.about]
        return Lobe(roughness, one, own[0].copy(), model, **kind)
    kind |= {"masking": family.masking, "fresnel": family.fresnel}
    if family.has_ground:
        f0, weight = (float(shape[1]), cover * one) if family.absolute else (TYPICAL_F0, own[0].copy())
        return Lobe(roughness, f0 * one, weight, "coat", ground=own[-1].copy(), **kind)
    if family.bare:
        return Lobe(roughness, TYPICAL_F0 * one, own[0].copy(), **kind)
    if family.absolute:
        return Lobe(roughness, own[0].copy(), cover * one, **kind)
    weight = own.sum(0)
    f0 = np.divide(own[0], weight, out=np.full_like(weight, TYPICAL_F0), where=weight > 0.0)
    return Lobe(roughness, f0, weight, **kind)


def lobe_parameters(model: Model) -> list[str]:
    """Names of the lobes' numbers, but for a base reflectance that was assumed."""
    return [
        f"lobe {k} {what}"
        for k, (family, lobe) in enumerate(zip(model.lobes.families, lobes_of(model), strict=True))
        for what in _free(family, lobe)
    ]


def lobe_jacobian(model: Model, covers: Sequence[float]) -> np.ndarray:
    """(c, p, q) derivatives of the numbers that :func:`lobe_parameters` names by a fit's: the lobes' coefficients, the
    logarithms of their shapes, and of the weights of those whose weight is taken to be 1, in units of ``covers``."""
    own, logs = model.lobe_coefficients, model.lobes.flat()
    start = np.concatenate([own, np.repeat(logs[:, None], own.shape[1], 1)])
    start = np.concatenate([start, np.zeros((len(covers), own.shape[1]))])
    columns = []
    for q in range(len(start)):
        step = np.zeros_like(start)
        step[q] = STEP * np.maximum(np.abs(start[q]), LEAST) if q < len(own) else STEP
        more, less = (_numbers(model, start + side * step, covers) for side in (1.0, -1.0))
        change = more - less
        azimuth = _is_azimuth(model)
        change[azimuth] = (change[azimuth] + 90.0) % 180.0 - 90.0  # half a turn is none
        columns.append(change / (2.0 * step[q]))
    count = len(_is_azimuth(model))
    return np.moveaxis(np.array(columns).reshape(len(start), count, own.shape[1]), (0, 1, 2), (2, 1, 0))


def _numbers(model: Model, values: np.ndarray, covers: Sequence[float]) -> np.ndarray:
    """(p, c) the lobes' numbers from those of the fit, (q, c)."""
    own = len(model.lobe_coefficients)
    shapes = own + len(model.lobes.flat())
    moved = model.lobes.with_flat(values[own:shapes, 0])
    factors = iter(np.exp(np.asarray(covers) * values[shapes:, 0]))
    said = []
    for family, shape, part in _parts(moved, values[:own]):
        lobe = lobe_of(family, shape, part, float(next(factors)) if family.absolute else 1.0)
        said += [number_of(lobe, what) for what in _free(family, lobe)]
    return np.array(said).reshape(-1, values.shape[1])


def _is_azimuth(model: Model) -> np.ndarray:
    return np.array([name.endswith("azimuth") for name in lobe_parameters(model)], bool)


def _free(family: Family, lobe: Lobe) -> list[str]:
    assumed = family.fresnel == "dielectric" and not family.absolute
    return [what for what in lobe_numbers(lobe) if not (assumed and what == "f0")]


def _parts(lobes: LobeSet, coefficients: np.ndarray):
    """Family, shape and coefficients of each lobe."""
    first = 0
    for family, shape in zip(lobes.families, lobes.shapes, strict=True):
        count = len(family.coefficient_names)
        yield family, shape, coefficients[first : first + count]
        first += count
