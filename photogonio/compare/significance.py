"""Whether two BRDFs differ by more than their errors: a p-value, and where.

At K pairs of directions z is the difference over its standard error, from both files' covariances and what lies beyond
them. Two statistics tell of a difference: the mean of z^2 by projected solid angle, and the greatest abs(z). Errors at
neighbouring directions are one and the same error, so that neither follows a tabled law: both are compared with what
differences drawn from the stated errors give.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from photogonio.compare.known import Known
from photogonio.compare.metrics import Directions, quadrature
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.errors import RelativeTable
from photogonio.reconstruct.brdf.parameters import slopes
from photogonio.reconstruct.modes.angles import spherical_angles

DRAWS = 2000  # p-values below 1 / DRAWS are not told apart
POLAR, SHARE = 8, 1  # nodes of the pairs, as of a quadrature
MOST_PAIRS = 1500
NORMAL_95 = 1.959964
SEED = 1996


@dataclass(frozen=True, slots=True)
class Significance:
    """What the stated errors say of a difference. ``p`` is nan where they say nothing."""

    p: float  # of a difference at least so great, were there none; of the worst channel, times their number
    by_channel: np.ndarray  # (c,)
    beyond: np.ndarray  # (c,) share of the pairs, by projected solid angle, beyond 1.96 standard errors
    channel: str  # where the difference is greatest, in standard errors
    angles: tuple[float, float, float]  # theta_i, theta_r, dphi there, radians
    values: tuple[float, float]  # f of both there, 1/sr; of a with ``scale`` as it is brought to b's
    sigmas: float  # a less b there, in standard errors
    exact: tuple[str, ...]  # BRDFs that do not say how sure they are, and are taken as exact

    def to_dict(self) -> dict[str, object]:
        theta_i, theta_r, dphi = (float(np.degrees(angle)) for angle in self.angles)
        return {
            "p": self.p,
            "p_by_channel": self.by_channel,
            "share_beyond_95": self.beyond,
            "where": {
                "channel": self.channel,
                "theta_i": theta_i,
                "theta_r": theta_r,
                "dphi": dphi,
                "a": self.values[0],
                "b": self.values[1],
                "standard_errors": self.sigmas,
            },
            "taken_as_exact": self.exact,
        }

    def __str__(self) -> str:
        least = 2.0 * len(self.by_channel) / DRAWS
        p = f"p < {least:.2g}" if self.p <= least else f"p = {self.p:.2g}"
        differ = "differ by more than" if self.p < 0.05 else "do not differ by more than"
        i, r, d = (np.degrees(angle) for angle in self.angles)
        text = (
            f"they {differ} their stated errors ({p}); most at theta_i {i:.0f}, theta_r {r:.0f}, dphi {d:.0f} degrees "
            f"in {self.channel}: {self.values[0]:.4g} against {self.values[1]:.4g} 1/sr, {self.sigmas:+.1f} standard "
            "errors"
        )
        if self.exact:
            text += f"; {' and '.join(self.exact)} does not say how sure it is, and is taken as exact"
        return text


@dataclass(frozen=True, slots=True)
class Side:
    """One of two BRDFs at K pairs of directions."""

    name: str
    value: np.ndarray  # (K, c) 1/sr
    brdf: Brdf | None  # of the same channels, if it says how sure it is

    @classmethod
    def of(cls, known: Known, channels: list[int], value: np.ndarray) -> Side:
        """``known`` in these of its channels, with their values (K, c)."""
        brdf = known.evaluate
        if not isinstance(brdf, Brdf):
            return cls(known.name, value, None)
        brdf = brdf.only(channels)
        errors = brdf.standard_errors if brdf.uncertainty is None else brdf.uncertainty.spread()
        told = errors.size and np.isfinite(errors).all() and np.any(errors)
        return cls(known.name, value, brdf if told else None)


def pairs_below(mask: float, *, isotropic: bool) -> Directions:
    """The pairs that are looked at where both are known everywhere."""
    return quadrature(mask, isotropic=isotropic, polar=POLAR, share=SHARE if isotropic else 2 * SHARE)


def significance(
    a: Side, b: Side, at: Directions, channels: tuple[str, ...], *, scale: bool = False
) -> Significance | None:
    """Of ``a`` less ``b`` at the pairs ``at``. With ``scale`` a is brought to b's scale first, in the draws too. None
    where neither says how sure it is."""
    exact = tuple(side.name for side in (a, b) if side.brdf is None)
    if len(exact) == 2:
        return None
    few = _some(len(at.weight))
    at = Directions(at.incident[few], at.exit[few], at.weight[few])
    values = [a.value[few], b.value[few]]
    rng = np.random.default_rng(SEED)
    weight = at.weight * at.cos_i * at.cos_r
    found = []
    for c in range(len(channels)):
        noise = [_errors(None if side.brdf is None else side.brdf.only([c]), at, rng) for side in (a, b)]
        found.append(_judged((values[0][:, c], values[1][:, c]), noise, weight, scale=scale))
    if scale:
        values[0] = values[0] * _factor(values[0], values[1], weight)
    return _worst(found, (values[0], values[1]), at, channels, exact)


def _some(count: int) -> np.ndarray:
    """Which of so many pairs are asked, evenly by chance."""
    if count <= MOST_PAIRS:
        return np.arange(count)
    return np.sort(np.random.default_rng(SEED).choice(count, MOST_PAIRS, replace=False))


def _errors(brdf: Brdf | None, at: Directions, rng: np.random.Generator) -> np.ndarray:
    """(K, draws) errors of f of one channel, drawn from what the file says of them."""
    if brdf is None:
        return np.zeros((len(at.weight), 1))
    where = (*spherical_angles(at.incident), *spherical_angles(at.exit))
    known, f = brdf.uncertainty, brdf.evaluate(*where)[:, 0]
    names = tuple(map(str, range(len(brdf.modes)))) if known is None else known.parameters
    spread = np.diag(brdf.standard_errors[:, 0] ** 2) if known is None else known.spread()[0]
    values, vectors = np.linalg.eigh(spread)
    change = slopes(brdf, where, names)[..., 0] @ (vectors * np.sqrt(np.maximum(values, 0.0)))
    drawn = change @ rng.normal(size=(change.shape[1], DRAWS))
    if known is not None:
        drawn += f[:, None] * known.scale * rng.normal(size=DRAWS)
        for table in filter(None, (known.misfit, known.unseen)):
            drawn += f[:, None] * _field(table, where, rng)
    return drawn


def _field(table: RelativeTable, where: tuple[np.ndarray, ...], rng: np.random.Generator) -> np.ndarray:
    """(K, draws) relative errors: their own at each node of the table, between them as it is read."""
    theta_i, phi_i, theta_r, phi_r = where
    unit = np.eye(table.relative.size).reshape(-1, *table.relative.shape)
    part = np.stack(
        [replace(table, relative=one).at(theta_i, theta_r, phi_r - phi_i) for one in unit], axis=1
    )
    size = table.at(theta_i, theta_r, phi_r - phi_i) / np.maximum(np.sqrt((part**2).sum(1)), 1e-12)
    drawn = size[:, None] * (part @ rng.normal(size=(part.shape[1], DRAWS)))
    return drawn


def _judged(
    value: tuple[np.ndarray, np.ndarray], noise: list[np.ndarray], weight: np.ndarray, *, scale: bool
) -> tuple[float, np.ndarray, float]:
    """p of one channel, z (K,), and the share beyond 95 %."""
    a, b = value
    factor = _factor(a, b, weight) if scale else 1.0
    drawn = _differences(b[:, None] + factor * noise[0], b[:, None] + noise[1], weight, scale=scale)
    sigma = np.sqrt(np.mean(drawn**2, axis=1))
    told = sigma > 1e-9 * max(float(np.abs(b).max()), 1e-300)
    z = np.where(told, (factor * a - b) / np.where(told, sigma, 1.0), 0.0)
    null = np.where(told[:, None], drawn / np.where(told, sigma, 1.0)[:, None], 0.0)
    part = weight / weight.sum()
    chances = [
        (1 + np.count_nonzero(some >= of)) / (1 + null.shape[1])
        for some, of in (
            (part @ null**2, part @ z**2),
            (np.abs(null).max(axis=0), np.abs(z).max()),
        )
    ]
    return min(1.0, 2.0 * min(chances)), z, float(part @ (np.abs(z) > NORMAL_95))


def _differences(a: np.ndarray, b: np.ndarray, weight: np.ndarray, *, scale: bool) -> np.ndarray:
    """(K, draws) of a less b; with ``scale`` each draw of a at its own factor."""
    return (_factor(a, b, weight) if scale else 1.0) * a - b


def _factor(a: np.ndarray, b: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """By which a (K, ...) is nearest to b, least squares by ``weight`` (K,)."""
    return np.tensordot(weight, a * b, 1) / np.tensordot(weight, a * a, 1)


def _worst(
    found: list[tuple[float, np.ndarray, float]],
    values: tuple[np.ndarray, np.ndarray],
    at: Directions,
    names: tuple[str, ...],
    exact: tuple[str, ...],
) -> Significance:
    by_channel = np.array([p for p, _, _ in found])
    z = np.stack([one for _, one, _ in found], axis=1)
    k, c = np.unravel_index(np.argmax(np.abs(z)), z.shape)
    (theta_i, phi_i), (theta_r, phi_r) = (spherical_angles(one[k]) for one in (at.incident, at.exit))
    dphi = float(np.arccos(np.cos(phi_r - phi_i)))
    return Significance(
        p=float(min(1.0, len(names) * by_channel.min())),
        by_channel=by_channel,
        beyond=np.array([share for _, _, share in found]),
        channel=names[c],
        angles=(float(theta_i), float(theta_r), dphi),
        values=(float(values[0][k, c]), float(values[1][k, c])),
        sigmas=float(z[k, c]),
        exact=exact,
    )
