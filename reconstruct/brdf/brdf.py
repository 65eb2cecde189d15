"""A measured BRDF: modes and lobes, how sure they are, and the coefficient file (docs/modes.md)."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from photogonio.capture.files.documents import read_json
from photogonio.reconstruct.brdf import schema as coefficients
from photogonio.reconstruct.brdf.covariance_file import is_beside, name_beside, write_beside, write_whole
from photogonio.reconstruct.brdf.errors import Uncertain
from photogonio.reconstruct.brdf.fresh import fresh_deviation, fresh_only
from photogonio.reconstruct.brdf.parameters import slopes
from photogonio.reconstruct.lobes.lobe import Lobe
from photogonio.reconstruct.lobes.lobe_sums import above_horizon, add_lobe
from photogonio.reconstruct.modes import basis as modes
from photogonio.reconstruct.modes import integrals
from photogonio.reconstruct.modes.angles import spherical_angles
from photogonio.reconstruct.modes.parallel import over_rows

HALF_OF_95 = 1.959964  # standard deviations on either side hold 95 %


@dataclass(frozen=True, slots=True)
class Brdf:
    """Sum of all modes (divided by the cosines that ``quantity`` names) and all lobes, 1/sr; 0 below the surface."""

    order: int
    channels: tuple[str, ...]
    modes: np.ndarray  # (m, 3) n, m, l if isotropic; (m, 4) n, l, n', l' otherwise
    coefficients: np.ndarray  # (m, c)
    standard_errors: np.ndarray  # (m, c)
    quantity: str = "brdf"  # "brdf" | "brdf_cos" | "brdf_cos_cos"
    symmetry: str = "isotropic"  # "isotropic" | "reciprocal" | "general"
    lobes: tuple[Lobe, ...] = ()
    scale: str = "absolute"  # "absolute" | "relative"
    valid: dict[str, float] = field(default_factory=dict)  # theta_i_max, theta_r_max, degrees
    fit: dict[str, object] = field(default_factory=dict)
    source: dict[str, object] = field(default_factory=dict)
    extra: dict[str, object] = field(default_factory=dict)  # unknown keys of the file, kept on a round trip
    uncertainty: Uncertain | None = None  # of all parameters and of what is beyond them
    version: int = 2  # of the file; 1 is kept while it says all

    def evaluate(
        self, theta_i: ArrayLike, phi_i: ArrayLike, theta_r: ArrayLike, phi_r: ArrayLike
    ) -> np.ndarray:
        """f (..., c), 1/sr, for any symmetry; angles in radians that broadcast together.

        An isotropic BRDF depends on ``phi_r - phi_i`` alone: give 0 and dphi. Where ``quantity`` names a
        cosine, f at grazing angles is as unbounded as the division makes it. Below the horizon f is 0.
        """
        given = [np.asarray(a, float) for a in (theta_i, phi_i, theta_r, phi_r)]
        shape = np.broadcast_shapes(*(a.shape for a in given))
        # those of the whole shape as they are: compiled code takes no broadcast views, and each would be copied
        flat = [(a if a.shape == shape else np.broadcast_to(a, shape)).reshape(-1) for a in given]
        terms = [lobe.terms() for lobe in self.lobes]
        base = self._constant()
        if base is None:
            value = self._sum_of_modes(*flat)
        else:
            value = np.empty((len(flat[0]), len(self.channels)))

        def finish(start: int, stop: int) -> None:
            part, rows = [angle[start:stop] for angle in flat], value[start:stop]
            if self.quantity != "brdf":
                rows /= modes.cosines(self.quantity, part[0], part[2])[:, None]
            if base is not None and not terms:
                rows[:] = base
            for k, one in enumerate(terms):
                add_lobe(one, part, rows, base if k == 0 else None)
            if not above_horizon(part[0], part[2]):
                rows[np.maximum(np.abs(part[0]), np.abs(part[2])) > 0.5 * np.pi] = 0.0
                rows[~np.isfinite(sum(part))] = np.nan

        over_rows(finish, len(value))
        return value.reshape(*shape, value.shape[1])

    def __call__(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        """f (..., c), 1/sr, at unit vectors (..., 3) of the tangent frame that broadcast together; 0 below
        the horizon."""
        return self.evaluate(*spherical_angles(incident), *spherical_angles(exit))

    def standard_error(
        self, theta_i: ArrayLike, phi_i: ArrayLike, theta_r: ArrayLike, phi_r: ArrayLike
    ) -> np.ndarray:
        """One standard error of f (..., c), 1/sr, from the covariance and what is beyond it; 0 below the
        horizon, NaN where it is not known.

        Angles as for :meth:`evaluate`.
        """
        angles = np.broadcast_arrays(*[np.asarray(a, float) for a in (theta_i, phi_i, theta_r, phi_r)])
        flat = modes.flat(*angles)
        known, channels = self.uncertainty, len(self.channels)
        told = np.isfinite(np.stack(flat)).all(axis=0)
        above = np.maximum(np.abs(flat[0]), np.abs(flat[2])) <= 0.5 * np.pi
        variance = np.repeat(
            np.where(told, 0.0, np.nan)[:, None], channels, axis=1
        )  # f is 0 below the horizon
        rows = np.flatnonzero(told & above)
        if known is None and np.isnan(self.standard_errors).all():
            variance[rows] = np.nan
            return np.sqrt(variance).reshape(*angles[0].shape, channels)
        if known is None:
            names: tuple[str, ...] = ()
            spread = np.stack([np.diag(one**2) for one in np.asarray(self.standard_errors, float).T])
        else:
            names, spread = known.parameters, known.spread()
        names = names or tuple(map(str, range(len(self.modes))))

        def task(start: int, stop: int) -> None:
            part = [angle[rows[start:stop]] for angle in flat]
            change = slopes(self, part, names)
            taken = np.einsum("npc,cpq,nqc->nc", change, spread, change, optimize=True)
            if known is not None:
                beyond = known.relative(part[0], part[2], part[3] - part[1])
                taken = np.maximum(taken, 0.0) + (beyond[:, None] * self.evaluate(*part)) ** 2
            variance[rows[start:stop]] = taken

        over_rows(task, len(rows), threads=1)
        return np.sqrt(variance).reshape(*angles[0].shape, channels)

    def prediction_interval(
        self, theta_i: ArrayLike, phi_i: ArrayLike, theta_r: ArrayLike, phi_r: ArrayLike
    ) -> tuple[np.ndarray, np.ndarray]:
        """Between what and what, (..., c) each, 1/sr, 95 % of fresh readings lie: of how sure f is, and of the noise
        of the rows that it was fitted to. NaN where it came from no such rows. Angles as for :meth:`evaluate`."""
        where = theta_i, phi_i, theta_r, phi_r
        said, error = self.evaluate(*where), self.standard_error(*where)
        half = HALF_OF_95 * fresh_deviation(self.fit, said, error, theta_i, theta_r)
        return said - half, said + half

    def directional_albedo(self, theta_i: ArrayLike, phi_i: ArrayLike = 0.0) -> np.ndarray:
        """(..., c) fraction of the light from (theta_i, phi_i) that is sent out; modes in closed form. 0
        below the horizon; a negative theta_i is on the other side of the normal."""
        theta_i, phi_i = _on_one_side(theta_i, phi_i)
        value = integrals.directional_albedo(
            self.symmetry, self.modes, self.coefficients, self.quantity, theta_i, phi_i
        )
        for lobe in self.lobes:
            if lobe.turning:
                value = value + _albedo_of_turning(lobe, theta_i, phi_i, value.shape)
            else:
                value = value + np.broadcast_to(lobe.directional_albedo(theta_i), value.shape)
        return np.where((np.broadcast_arrays(theta_i, phi_i)[0] > 0.5 * np.pi)[..., None], 0.0, value)

    def bihemispherical_albedo(self) -> np.ndarray:
        """(c,) fraction of even illumination that is sent out; modes in closed form."""
        value = integrals.bihemispherical_albedo(self.symmetry, self.modes, self.coefficients, self.quantity)
        for lobe in self.lobes:
            value = value + lobe.bihemispherical_albedo()
        return value

    @property
    def turning(self) -> bool:
        """Whether f changes when the sample is turned about its normal."""
        return self.symmetry != "isotropic" or any(lobe.turning for lobe in self.lobes)

    def only(self, channels: list[int]) -> Brdf:
        """Of some channels alone, by their places."""
        return replace(
            self,
            channels=tuple(self.channels[k] for k in channels),
            coefficients=self.coefficients[:, channels],
            standard_errors=self.standard_errors[:, channels],
            lobes=tuple(lobe.only(channels) for lobe in self.lobes),
            uncertainty=None if self.uncertainty is None else self.uncertainty.only(channels),
            fit=self.fit | fresh_only(self.fit, channels),
        )

    def save(self, path: Path | str) -> None:
        """Write the coefficient file (docs/modes.md), whole or not at all. Inverse of :func:`load_brdf`.

        The covariance of more than 150 parameters goes to ``covariance.npz`` beside it, or, where that is another
        file's, to one with this file's name before it. Raises photogonio.capture.errors.InputError where it cannot
        be written.
        """
        path = Path(path)
        beside = name_beside(path)
        text = _text(coefficients.document(self, beside)).encode()
        if self.uncertainty is not None and is_beside(self.uncertainty):
            write_beside(self.uncertainty, path.with_name(beside))
        write_whole(path, lambda file: file.write(text))

    def _constant(self) -> np.ndarray | None:
        """(c,) the sum of the modes where it is the same everywhere, else None."""
        if np.any(self.modes) or self.quantity != "brdf":
            return None
        return np.sum(self.coefficients, axis=0) / (2.0 * np.pi)

    def _sum_of_modes(self, theta_i, phi_i, theta_r, phi_r) -> np.ndarray:
        if self.symmetry == "isotropic":
            return modes.evaluate_isotropic(self.modes, self.coefficients, theta_i, theta_r, phi_r - phi_i)
        angles = theta_i, phi_i, theta_r, phi_r
        return modes.evaluate_pairs(self.symmetry, self.modes, self.coefficients, angles)


def _on_one_side(theta: ArrayLike, phi: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """The same direction with a polar angle of 0 or more."""
    theta, phi = np.asarray(theta, float), np.asarray(phi, float)
    return np.abs(theta), np.where(theta < 0.0, phi + np.pi, phi)


def load_brdf(path: Path | str) -> Brdf:
    """Read a coefficient file. Inverse of :meth:`Brdf.save`.

    Raises photogonio.capture.errors.InputError naming the file and the key that cannot be used.
    """
    return Brdf(**coefficients.parse(path, read_json(Path(path))))


def _text(document: dict[str, object]) -> str:
    """JSON, a key a line; of version 1 with every number on a line of its own, as it always was."""
    if document["version"] == 1:
        return "{\n" + ",\n".join(_indented(*one) for one in document.items()) + "\n}\n"
    lines = [
        f"{json.dumps(key)}: {json.dumps(value, allow_nan=False, separators=(',', ':'))}"
        for key, value in document.items()
    ]
    return "{" + ",\n ".join(lines) + "}\n"


def _indented(key: str, value: object) -> str:
    """A key as ``json.dumps(document, indent=1)`` has it, which takes seconds for rows of many modes."""
    if isinstance(value, list) and value and all(isinstance(row, list) and row for row in value):
        rows = json.dumps(value, allow_nan=False, separators=(",", ":"))[2:-2]
        if not set(rows.replace("],[", ",")) & set('[]{"'):  # numbers alone
            rows = rows.replace(",", ",\n   ").replace("],\n   [", "\n  ],\n  [\n   ")
            return f" {json.dumps(key)}: [\n  [\n   {rows}\n  ]\n ]"
    text = json.dumps(value, indent=1, allow_nan=False).replace("\n", "\n ")
    return f" {json.dumps(key)}: {text}"


def _albedo_of_turning(
    lobe: Lobe, theta_i: ArrayLike, phi_i: ArrayLike, shape: tuple[int, ...]
) -> np.ndarray:
    """(..., c) directional albedo of a lobe of two roughnesses, an azimuth at a time."""
    theta, phi = np.broadcast_arrays(np.asarray(theta_i, float), np.asarray(phi_i, float))
    value = np.empty(shape)
    turns, place = np.unique(phi, return_inverse=True)
    place = place.reshape(phi.shape)
    for k, turn in enumerate(turns):
        value[place == k] = lobe.directional_albedo(theta[place == k], turn)
    return value
