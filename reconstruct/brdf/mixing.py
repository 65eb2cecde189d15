"""A BRDF of other channels, each a weighted sum of the old: exact, since modes and lobes are linear in the channels.

A lobe or ground may then reflect less than nothing, or more than all, in a channel that the surface's colour lies
beyond; the file says so under :data:`reconstruct.brdf.lobe_schema.MIXED`.

What is not known of the channels' errors is how they go together, but for what they share, the lobes' shapes; beyond
that they are taken to know nothing of one another.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.errors import Uncertain
from photogonio.reconstruct.brdf.lobe_schema import MIXED, is_bounded
from photogonio.reconstruct.brdf.parameters import named_number
from photogonio.reconstruct.lobes.lobe import Lobe

LEAST = 1e-12  # weight of a channel that has none


def mixed(brdf: Brdf, matrix: np.ndarray, channels: tuple[str, ...]) -> Brdf:
    """The channels ``matrix`` (d, c) times those of ``brdf``, by their new names."""
    lobes = tuple(_lobe(lobe, matrix) for lobe in brdf.lobes)
    errors = np.sqrt(np.square(brdf.standard_errors) @ np.square(matrix).T)
    known = brdf.uncertainty
    if known is not None:
        known = _uncertain(known, brdf, lobes, matrix)
        errors = known.standard_errors[: len(brdf.modes)]
    return replace(
        brdf,
        channels=channels,
        coefficients=brdf.coefficients @ matrix.T,
        standard_errors=errors,
        lobes=lobes,
        uncertainty=known,
        extra=brdf.extra if all(map(is_bounded, lobes)) else brdf.extra | {MIXED: True},
    )


def _lobe(lobe: Lobe, matrix: np.ndarray) -> Lobe:
    """Schlick's factor is f0 + (1 - f0) s: both weight and weight times f0 are mixed."""
    weight = matrix @ lobe.weight
    weight = np.where(np.abs(weight) < LEAST, LEAST, weight)
    if lobe.peak or lobe.fresnel == "dielectric":
        f0 = np.full(len(matrix), lobe.f0[0])
    else:
        f0 = matrix @ (lobe.weight * lobe.f0) / weight
    ground = None if lobe.ground is None else matrix @ lobe.ground
    return replace(lobe, weight=weight, f0=f0, ground=ground)


def _uncertain(known: Uncertain, brdf: Brdf, lobes: tuple[Lobe, ...], matrix: np.ndarray) -> Uncertain:
    names, modes = known.parameters, len(brdf.modes)
    spread = _in_products(known.spread(), names, modes, brdf.lobes, inverse=False)
    shared = np.array(
        [k >= modes and _is_shared(name, spread[:, k, k], brdf) for k, name in enumerate(names)]
    )
    own, all_share = np.flatnonzero(~shared), np.flatnonzero(shared)
    common = spread[0][np.ix_(all_share, all_share)]
    across = spread[:, own[:, None], all_share]
    gain = across @ np.linalg.pinv(common, hermitian=True) if len(all_share) else across
    alone = spread[:, own[:, None], own] - gain @ np.swapaxes(across, 1, 2)
    result = np.zeros((len(matrix), len(names), len(names)))
    together = np.einsum("dk,kas->das", matrix, across)
    result[:, own[:, None], own] = np.einsum("dk,kab->dab", matrix**2, alone)
    mixed_gain = np.einsum("dk,kas->das", matrix, gain)
    result[:, own[:, None], own] += mixed_gain @ common @ np.swapaxes(mixed_gain, 1, 2)
    result[:, own[:, None], all_share] = together
    result[:, all_share[:, None], own] = np.swapaxes(together, 1, 2)
    result[:, all_share[:, None], all_share] = common
    for k in all_share[
        [names[k].endswith("weight") for k in all_share]
    ]:  # a weight that channels share is summed
        result[:, k] *= matrix.sum(1)[:, None]
        result[:, :, k] *= matrix.sum(1)[:, None]
    result = _in_products(result, names, modes, lobes, inverse=True)
    errors = np.sqrt(np.maximum(np.diagonal(result, axis1=1, axis2=2), 0.0)).T
    kept = None if known.covariance is None else result
    return replace(known, standard_errors=errors, covariance=kept)


def _is_shared(name: str, variance: np.ndarray, brdf: Brdf) -> bool:
    """Whether all channels have the same of a lobe's number."""
    place, what = named_number(name, brdf.lobes)
    lobe = brdf.lobes[place]
    if what == "weight":
        return bool(np.ptp(lobe.weight) == 0.0 and np.ptp(variance) <= 1e-9 * variance.max())
    return what not in ("ground", "f0") or (what == "f0" and lobe.fresnel == "dielectric")


def _in_products(
    spread: np.ndarray, names: tuple[str, ...], modes: int, lobes: tuple[Lobe, ...], *, inverse: bool
) -> np.ndarray:
    """Covariances (c, p, p) with weight f0 in the place of Schlick's f0; ``inverse``: back again."""
    change = np.broadcast_to(np.eye(len(names)), spread.shape).copy()
    for k, name in enumerate(names[modes:], start=modes):
        place, what = named_number(name, lobes)
        lobe, weight = lobes[place], f"lobe {place} weight"
        if what != "f0" or lobe.fresnel == "dielectric":
            continue
        change[:, k, k] = 1.0 / lobe.weight if inverse else lobe.weight
        if weight in names:
            change[:, k, names.index(weight)] = -lobe.f0 / lobe.weight if inverse else lobe.f0
    return change @ spread @ np.swapaxes(change, 1, 2)
