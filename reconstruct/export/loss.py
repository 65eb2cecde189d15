"""What an exported file loses: read back as its consumer reads it, against the BRDF that it was made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.modes.mirror_quadrature import around

Evaluate = Callable[[np.ndarray, np.ndarray], np.ndarray]  # incident, exit (n, 3) -> (n, c), 1/sr
ANGLES = (0.0, 30.0, 60.0, 75.0, 85.0, 88.0)  # degrees of incidence at which albedos are compared
TURNS = (0.0, 70.0)  # incident azimuths, of a surface that changes as it turns
MASKS = (60.0, 80.0)  # degrees
_PAIRS, _PAIRS_TURNING = 60_000, 36_000  # sums of a surface that turns are dear
_SHARED = 40  # pairs of an incident direction, of a surface that turns
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))  # turn between points of an even spiral
_SEED = 1996
_ADDED = 1.004  # light that lines between a table's rows may add
_NEAR = 5e-4  # more than that
_WATCHED, _WATCHED_TURNING, _WATCHED_TURNS = 30, 10, 16  # incidences and turns at which that is looked at
_FEWER = 24, 64  # nodes of an albedo's quadrature, where there are many
PLACE = "loss not measured"  # in a file that has room to state its loss, where it goes


@dataclass(frozen=True, slots=True)
class Loss:
    """Of the worst channel. Relative rms is sqrt(sum (f - f0)^2 / sum f0^2), by projected solid angle."""

    rms: tuple[float, ...]  # with both angles below each of MASKS
    albedo: tuple[
        float, ...
    ]  # exported albedo over the source's, at each of ANGLES, where it departs most from 1
    brightest: float  # the greatest exported directional albedo

    def to_dict(self) -> dict[str, object]:
        return {
            **{f"rms_{mask:g}": value for mask, value in zip(MASKS, self.rms, strict=True)},
            "albedo_ratio": {f"{angle:g}": r for angle, r in zip(ANGLES, self.albedo, strict=True)},
            "albedo_max": self.brightest,
        }

    def __str__(self) -> str:
        rms = " and ".join(f"{100 * r:.2g} % below {mask:g}" for r, mask in zip(self.rms, MASKS, strict=True))
        worst = int(np.argmax(np.abs(np.array(self.albedo) - 1)))
        change = 100 * (self.albedo[worst] - 1)
        return f"loses {rms} degrees (rms); albedo at most {change:+.2g} % off, at {ANGLES[worst]:g} degrees"


def loss_of(
    brdf: Brdf,
    exported: Evaluate,
    convert: Callable[[np.ndarray], np.ndarray] | None = None,
    *,
    gathered: bool = False,
) -> Loss:
    """Compare ``exported`` with the BRDF; ``convert`` takes the source's channels (n, c) to the file's.

    With ``gathered`` albedos are of even light that is sent toward a viewer at each angle, what a renderer that starts
    at the camera adds up; of a reciprocal BRDF that is the same. Cells' edges are no work for a quadrature: of an
    ``exported`` that has an ``albedo`` of its own, of incident unit vectors (n, 3), it is asked.
    """

    def source(incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        f = np.maximum(brdf(incident, exit), 0.0)
        return f if convert is None else convert(f)

    rng = np.random.default_rng(_SEED)
    isotropic = not brdf.turning
    rms = tuple(_rms(source, exported, np.radians(mask), rng, isotropic=isotropic) for mask in MASKS)
    ratios, brightest = [], 0.0
    for angle in np.radians(ANGLES):
        there, here = (
            np.array([_albedo(_exchanged(f) if gathered else f, angle, turn) for turn in _turns(isotropic)])
            for f in (exported, source)
        )
        ratio = (there / np.maximum(here, 1e-12)).ravel()
        ratios.append(float(ratio[np.argmax(np.abs(ratio - 1))]))
        brightest = max(brightest, float(there.max()))
    return Loss(rms, tuple(ratios), brightest)


def _turns(isotropic: bool) -> np.ndarray:
    """Incident azimuths, radians, at which albedos are compared."""
    return np.zeros(1) if isotropic else np.radians(TURNS)


def _exchanged(f: Evaluate) -> Evaluate:
    return lambda incident, exit: f(exit, incident)


def _rms(source: Evaluate, exported: Evaluate, mask: float, rng, *, isotropic: bool) -> float:
    count = _PAIRS if isotropic else _PAIRS_TURNING
    incident, exit, weight = pairs(mask, rng, isotropic=isotropic, count=count)
    f0, f = source(incident, exit), exported(incident, exit)
    keep = np.isfinite(f).all(axis=1)
    error = weight[keep] @ (f - f0)[keep] ** 2 / np.maximum(weight[keep] @ f0[keep] ** 2, 1e-300)
    return float(np.sqrt(error.max()))


def pairs(
    mask: float, rng: np.random.Generator, *, isotropic: bool, count: int = _PAIRS
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Incident and exit directions (n, 3) within ``mask`` (radians), and weights that undo how densely they lie.

    Half of them are spread evenly by projected solid angle, half lie about the mirror direction, where gloss is. Of a
    surface that turns the incident directions are fewer, evenly spread, and each of many pairs: sums of its modes are
    then made once for each.
    """
    reach, spread = np.sin(mask), 0.12
    radius, turn = reach * np.sqrt(rng.uniform(size=count)), rng.uniform(0, 2 * np.pi, count)
    if not isotropic:
        place = np.arange(count) // _SHARED + 0.5
        radius, turn = reach * np.sqrt(place / (place[-1] + 0.5)), _GOLDEN * place
    first = np.column_stack([radius * np.cos(turn), radius * np.sin(turn)])
    if isotropic:
        first = np.column_stack([radius, 0 * radius])
    radius, turn = reach * np.sqrt(rng.uniform(size=count)), rng.uniform(0, 2 * np.pi, count)
    second = np.column_stack([radius * np.cos(turn), radius * np.sin(turn)])
    near = np.arange(count) % 2 == 1
    second[near] = -first[near] + spread * rng.normal(size=(near.sum(), 2))
    apart = ((second + first) ** 2).sum(1)
    density = 0.5 / (np.pi * reach**2) + 0.5 * np.exp(-0.5 * apart / spread**2) / (2 * np.pi * spread**2)
    keep = (second**2).sum(1) < reach**2
    return _lifted(first[keep]), _lifted(second[keep]), 1 / density[keep]


def _lifted(disk: np.ndarray) -> np.ndarray:
    return np.column_stack([disk, np.sqrt(np.maximum(1 - (disk**2).sum(1), 0.0))])


def _albedo(f: Evaluate, theta_i: float, phi_i: float, *nodes: int) -> np.ndarray:
    """(c,) directional albedo."""
    toward = unit_vectors(theta_i, phi_i)[None]
    known = getattr(f, "albedo", None)
    if known is not None:
        return known(toward)[0]
    exit, weight = around(theta_i, *nodes, retro=True)
    cos, sin = np.cos(phi_i), np.sin(phi_i)
    exit = exit @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return np.atleast_1d(weight @ np.nan_to_num(f(np.broadcast_to(toward, exit.shape), exit)))


def held(brdf: Brdf, value: np.ndarray, axes: list[np.ndarray]) -> np.ndarray:
    """(theta_i, phi_i) factors, at most 1, with which lines between a table's rows add no light to speak of.

    ``value`` (theta_i, phi_i, theta_r, dphi, c) of f at nodes, radians; dphi of one phi_i alone goes half a turn. What
    lines between them send out is a sum with weights that are known, and between two incidences the mean of both.
    """
    theta_i, phi_i, theta_r, dphi = axes
    sent = np.einsum("iprdc,r,d->ipc", value, _hats(theta_r), _turned(dphi, whole=len(phi_i) > 1))
    watched = _WATCHED if len(phi_i) == 1 else _WATCHED_TURNING
    looks = np.unique(np.linspace(1, len(theta_i) - 1, watched).astype(int))
    more = np.stack(
        [
            np.maximum(_added(brdf, axes, sent, (at, at)), _added(brdf, axes, sent, (at - 1, at)))
            for at in looks
        ]
    )
    steps = np.arange(len(theta_i))
    over = np.stack([np.interp(steps, looks, one / _ADDED) for one in more.T], axis=1)
    return np.where(over > 1.0 + _NEAR, 1.0 / np.maximum(over, 1.0), 1.0)


def _added(brdf: Brdf, axes: list[np.ndarray], sent: np.ndarray, nodes: tuple[int, int]) -> np.ndarray:
    """(phi_i,) what a table sends out over what the BRDF does, the most of a step to either side, halfway between two
    nodes of incidence; ``sent`` (theta_i, phi_i, c) at its nodes."""
    theta, there, phi_i = axes[0][list(nodes)].mean(), sent[list(nodes)].mean(axis=0), axes[1]

    def source(incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        return np.maximum(brdf(incident, exit), 0.0)

    if len(phi_i) == 1:
        return (there / np.maximum(_albedo(source, theta, 0.0), 1e-12)).max(axis=1)
    turns = np.arange(_WATCHED_TURNS) * (2.0 * np.pi / _WATCHED_TURNS)
    waves = np.fft.rfft([_albedo(source, theta, turn, *_FEWER) for turn in turns], axis=0, norm="forward")
    here = np.fft.irfft(waves, 2 * len(phi_i), axis=0, norm="forward")
    halfway = np.stack([there, 0.5 * (there + np.roll(there, -1, axis=0))], axis=1).reshape(here.shape)
    over = (halfway / np.maximum(here, 1e-12)).max(axis=1)
    return np.maximum(over, np.maximum(np.roll(over, 1), np.roll(over, -1)))[::2]


def _hats(theta: np.ndarray) -> np.ndarray:
    """(n,) integral by projected solid angle, a unit of azimuth, of what is 1 at each node and linear down to 0 at its
    neighbours; beyond the last as on it."""
    node, size = np.polynomial.legendre.leggauss(6)
    part, wide = 0.5 * (node + 1.0), np.diff(theta)[:, None]
    at = theta[:-1, None] + wide * part
    weight = 0.5 * wide * size * np.sin(at) * np.cos(at)
    found = np.zeros(len(theta))
    found[:-1] += (weight * (1.0 - part)).sum(axis=1)
    found[1:] += (weight * part).sum(axis=1)
    found[-1] += 0.5 * np.cos(theta[-1]) ** 2
    return found


def _turned(azimuth: np.ndarray, *, whole: bool) -> np.ndarray:
    """(n,) the same of azimuths all the way round, or of half a turn that stands for both."""
    if whole:
        apart = np.diff(np.append(azimuth, azimuth[0] + 2.0 * np.pi))
        return 0.5 * (apart + np.roll(apart, 1))
    apart = np.diff(azimuth)
    return np.append(apart, 0.0) + np.append(0.0, apart)
