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
    coefficients = len(model.lobe_coefficients)
    cover_at = coefficients + len(model.lobes.flat())
    shape_at, own_at, number_at, absolute = coefficients, 0, 0, 0
    count = len(lobe_parameters(model))
    result = np.zeros((model.lobe_coefficients.shape[1], count, cover_at + len(covers)))
    for family, shape, part in _parts(
        model.lobes, model.lobe_coefficients
    ):  # each lobe's numbers are its own
        own, shapes = np.arange(own_at, own_at + len(part)), np.arange(shape_at, shape_at + len(shape))
        weights = [cover_at + absolute] if family.absolute else []
        cover = float(covers[absolute]) if family.absolute else 0.0
        block = _slopes_of(family, shape, part, cover)
        place = np.concatenate([own, shapes, np.array(weights, int)])
        result[:, number_at : number_at + block.shape[1], place] = block
        own_at, shape_at = own_at + len(own), shape_at + len(shapes)
        number_at, absolute = number_at + block.shape[1], absolute + len(weights)
    return result


def _slopes_of(family: Family, shape: np.ndarray, own: np.ndarray, cover: float) -> np.ndarray:
    """(c, p, q) derivatives of a lobe's numbers by its coefficients, the logarithms of its shape, and of its weight."""
    logs, channels = np.log(shape), own.shape[1]
    further = np.zeros((int(family.absolute), channels))
    start = np.concatenate([own, np.repeat(logs[:, None], channels, 1), further])

    def numbers(values: np.ndarray) -> np.ndarray:
        moved = np.exp(values[len(own) : len(own) + len(logs), 0])
        weight = float(np.exp(cover * values[-1, 0])) if family.absolute else 1.0
        lobe = lobe_of(family, moved, values[: len(own)], weight)
        return np.array([number_of(lobe, what) for what in _free(family, lobe)])  # (p, c)

    azimuth = np.array([what == "azimuth" for what in _free(family, lobe_of(family, shape, own))], bool)
    columns = []
    for q in range(len(start)):
        step = np.zeros_like(start)
        step[q] = STEP * np.maximum(np.abs(start[q]), LEAST) if q < len(own) else STEP
        change = numbers(start + step) - numbers(start - step)
        change[azimuth] = (change[azimuth] + 90.0) % 180.0 - 90.0  # half a turn is none
        columns.append(change / (2.0 * step[q]))
    return np.moveaxis(np.array(columns), (0, 1, 2), (2, 1, 0))


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
