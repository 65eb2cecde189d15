"""What a BRDF's covariance says of more than f: its albedo's error, and BRDFs drawn from it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.errors import Uncertain
from photogonio.reconstruct.brdf.parameters import (
    either_side,
    is_shared,
    lobe_parameter,
    named_number,
    number_of,
    with_number,
)
from photogonio.reconstruct.lobes.lobe import Lobe
from photogonio.reconstruct.modes.integrals import bihemispherical_albedo

NODES = 12  # midpoints in each angle, between which errors beyond the parameters are averaged
ROUNDING = 1e-12  # of a number at its bound
FARTHEST = 3.0  # times or part of itself that a roughness is drawn
LEAST = 1e-6  # of a drawn weight, reflectance or roughness


def albedo_error(brdf: Brdf) -> np.ndarray:
    """(c,) one standard error of the albedo under even light; NaN where it is not known.

    What is beyond the parameters is taken to be alike in all directions.
    """
    known = brdf.uncertainty
    if known is None:
        return np.full(len(brdf.channels), np.nan)
    change = albedo_slopes(brdf, known)
    own = np.einsum("pc,cpq,qc->c", change, known.spread(), change)
    beyond = np.sum(np.square(list(albedo_beyond(brdf, known).values())), axis=0)
    return np.sqrt(np.maximum(own, 0.0) + beyond * brdf.bihemispherical_albedo() ** 2)


def albedo_slopes(brdf: Brdf, known: Uncertain) -> np.ndarray:
    """(p, c) derivatives of the albedo under even light by the parameters; 0 of those that are held."""
    varies = np.abs(known.spread()).max(axis=(0, 2)) > 0.0
    change = np.zeros((len(known.parameters), len(brdf.channels)))
    modes = len(brdf.modes)
    unit = bihemispherical_albedo(brdf.symmetry, brdf.modes, np.eye(modes), brdf.quantity)
    change[:modes] = unit[:, None]
    for p, name in enumerate(known.parameters[modes:], start=modes):
        found = lobe_parameter(name, brdf.lobes)
        if found is None:
            raise InputError("parameters", f"there is no {name!r} in this file")
        if not varies[p]:
            continue
        less, more, between = either_side(brdf.lobes[found[0]], found[1])
        ends = [one.bihemispherical_albedo() for one in (less, more)]
        change[p] = (ends[1] - ends[0]) / between
    return change


def albedo_beyond(brdf: Brdf, known: Uncertain) -> dict[str, np.ndarray]:
    """(c,) relative errors that no parameter says, each by its name in the file: their means, weighed by the light
    that goes each way."""
    middle = (np.arange(NODES) + 0.5) / NODES
    theta_i, theta_r, dphi = (
        grid.ravel()
        for grid in np.meshgrid(0.5 * np.pi * middle, 0.5 * np.pi * middle, np.pi * middle, indexing="ij")
    )
    weight = (np.sin(2.0 * theta_i) * np.sin(2.0 * theta_r))[:, None]
    f = weight * np.abs(brdf.evaluate(theta_i, 0.0, theta_r, dphi))
    means = {"scale": np.full(f.shape[1], known.scale)}
    for name, table in (("misfit", known.misfit), ("unseen", known.unseen)):
        means[name] = np.zeros(f.shape[1])
        if table is not None:
            means[name] = table.at(theta_i, theta_r, dphi) @ f / f.sum(0)
    return means


def drawn(brdf: Brdf, count: int, seed: int) -> list[Brdf]:
    """``count`` BRDFs drawn from the covariance: what is beyond the parameters stays as it is.

    Numbers that channels share are drawn once. Raises InputError where no covariance is known, ``count`` is no number
    of draws, or ``seed`` no seed.
    """
    if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 0:
        raise InputError("sample", f"a whole number of 0 or more is needed, not {count!r:.60}")
    known = brdf.uncertainty
    if known is not None and known.missing is not None:
        raise InputError("sample", f"{known.missing.get('file')} is missing beside the file of coefficients")
    if known is None or not np.isfinite(known.spread()).all():
        raise InputError("sample", "the file does not say how sure its numbers are")
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise InputError("sample", f"its seed must be a whole number of 0 or more, not {seed!r:.60}")
    rng = np.random.default_rng(seed)
    modes, spread = len(brdf.modes), known.spread()
    shared = np.array(
        [k >= modes and is_shared(name, brdf.lobes) for k, name in enumerate(known.parameters)], bool
    )
    own, common = np.flatnonzero(~shared), np.flatnonzero(shared)
    # the same in all channels of a file of ours; of others the mean, since a shape has but one value
    mean = spread.mean(axis=0)[np.ix_(common, common)]
    together = rng.normal(size=(count, len(common))) @ _root(mean).T
    changes = np.zeros((count, len(known.parameters), len(brdf.channels)))
    changes[:, common] = together[:, :, None]
    for c, one in enumerate(spread):
        across = one[np.ix_(own, common)]
        gain = across @ np.linalg.pinv(one[np.ix_(common, common)], rcond=1e-12, hermitian=True)
        alone = one[np.ix_(own, own)] - gain @ across.T
        noise = rng.normal(size=(count, len(own))) @ _root(alone).T
        changes[:, own, c] = _kept_within(together @ gain.T, noise, alone, *_bounds(brdf, known, own, c))
    return [_moved(brdf, known, change) for change in changes]


def _bounds(brdf: Brdf, known: Uncertain, own: np.ndarray, c: int) -> tuple[np.ndarray, np.ndarray]:
    """How far the numbers ``own`` of a channel may move: weights and grounds to 0, base reflectances from 0 to 1."""
    low, high = np.full(len(own), -np.inf), np.full(len(own), np.inf)
    for k, p in enumerate(own):
        found = lobe_parameter(known.parameters[p], brdf.lobes) if p >= len(brdf.modes) else None
        if found is not None:
            value = number_of(brdf.lobes[found[0]], found[1])[c]
            low[k], high[k] = -value, 1.0 - value if found[1] == "f0" else np.inf
    return low, high


def _kept_within(
    centre: np.ndarray, noise: np.ndarray, covariance: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """(n, k) ``centre`` and ``noise`` of that ``covariance`` (k, k) together, within the bounds.

    A draw beyond them is mirrored, which is as likely, if that lies within. Else what is beyond stays at its bound, and
    all other numbers move as they do where it is there: what all but cancels, as a ground and a constant mode, still
    does, and f scatters as before.
    """

    def inside(change: np.ndarray) -> np.ndarray:
        return np.all((change >= low) & (change <= high), axis=1)

    turned = ~inside(centre + noise) & inside(centre - noise)
    change = centre + np.where(turned, -1.0, 1.0)[:, None] * noise
    bounded = np.flatnonzero(np.isfinite(low) | np.isfinite(high))
    held = np.zeros(change.shape, bool)
    for _ in range(len(bounded)):  # what is held may push another beyond its bound
        beyond = (change < low - ROUNDING) | (change > high + ROUNDING)
        for row in np.flatnonzero(beyond.any(axis=1)):
            held[row] |= beyond[row]
            at = np.flatnonzero(held[row])
            miss = np.clip(change[row, at], low[at], high[at]) - change[row, at]
            gain = np.linalg.lstsq(covariance[np.ix_(at, at)], miss, rcond=1e-6)[0]
            change[row] += covariance[:, at] @ gain
            change[row, at] = np.clip(change[row, at], low[at], high[at])
    return change


def _root(covariance: np.ndarray) -> np.ndarray:
    """A square root, (p, p)."""
    values, vectors = np.linalg.eigh(covariance)
    return vectors * np.sqrt(np.maximum(values, 0.0))


def _moved(brdf: Brdf, known: Uncertain, change: np.ndarray) -> Brdf:
    """With the parameters changed by ``change`` (p, c), and what cannot be kept within what can."""
    modes, lobes = len(brdf.modes), list(brdf.lobes)
    for p, name in enumerate(known.parameters[modes:], start=modes):
        place, what = named_number(name, brdf.lobes)
        value = number_of(lobes[place], what) + change[p]
        if what.startswith("roughness"):
            value = number_of(lobes[place], what)
            far = np.log(FARTHEST)  # never 0, where a peak would have no bound
            value = value * np.exp(np.clip(change[p] / value, -far, far))
            value = np.clip(value, LEAST**0.5, None if lobes[place].turning else 1.0)
        elif what == "f0":
            value = np.clip(value, LEAST, 1.0 - LEAST)
        elif what in ("weight", "ground"):
            value = np.maximum(value, 0.0)
        lobes[place] = with_number(lobes[place], what, value)
    for place, lobe in enumerate(brdf.lobes):
        at = {what: f"lobe {place} {what}" for what in ("f0", "weight")}
        if not lobe.peak and all(name in known.parameters for name in at.values()):
            own = {what: change[known.parameters.index(name)] for what, name in at.items()}
            lobes[place] = _of_product(lobe, lobes[place], own["f0"], own["weight"])
    return replace(
        brdf,
        coefficients=brdf.coefficients + change[:modes],
        lobes=tuple(lobes),
        uncertainty=None,
        standard_errors=np.full_like(brdf.coefficients, np.nan),
    )


def _of_product(lobe: Lobe, moved: Lobe, f0: np.ndarray, weight: np.ndarray) -> Lobe:
    """The lobe ``moved`` from ``lobe``, its base reflectance times its weight moved as far as changes (c,) of both tell
    to first order.

    f holds that product, which photos know ten times and more as well as either, so that two draws that all but cancel
    must not leave their own product in it. With Schlick's Fresnel f is linear in product and weight; the exact one's
    base reflectance is shared by channels, and the weight makes up for it.
    """
    product = np.maximum(lobe.weight * lobe.f0 + lobe.weight * f0 + lobe.f0 * weight, 0.0)
    base = moved.f0
    if lobe.fresnel == "schlick":
        there = moved.weight > 0.0
        base = np.where(there, product / np.where(there, moved.weight, 1.0), base)
        base = np.clip(base, LEAST, 1.0 - LEAST)
        if (base * moved.weight >= product - ROUNDING).all():
            return replace(moved, f0=base)
    return replace(moved, f0=base, weight=np.where(base > 0.0, product / base, moved.weight))
