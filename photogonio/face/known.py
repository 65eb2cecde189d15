"""A BRDF in Python that is no file of coefficients: a table of MERL's or a renderer's, a truth, or measured rows."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from photogonio.capture.errors import InputError
from photogonio.compare.known import Known
from photogonio.face.directions import checked_angles
from photogonio.face.measured import Albedo, four_angles
from photogonio.face.presented import Presented
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.modes.integrals import albedo_of
from photogonio.reconstruct.modes.quadrature import elevation_rule

FINEST = 0.1  # radians: what a quadrature of a table resolves
_COEFFICIENTS = ("modes", "scatmech")  # formats that need them


class KnownBrdf(Presented):
    """f known everywhere, or at single pairs of directions (``at``, ``value``); without errors."""

    __slots__ = ("known",)

    def __init__(self, known: Known):
        self.known = known

    name = property(lambda self: self.known.name)
    channels = property(lambda self: self.known.channels)
    turning = property(lambda self: not self.known.isotropic)
    symmetry = property(lambda self: "isotropic" if self.known.isotropic else "general")
    scale = "absolute"
    valid: ClassVar[dict[str, float]] = {}
    fit: ClassVar[dict[str, object]] = {}
    source: ClassVar[dict[str, object]] = {}
    uncertainty = None

    def __call__(self, incident: ArrayLike, exit: ArrayLike) -> np.ndarray:
        """f (..., c), 1/sr, at vectors (..., 3) of any length that broadcast together; 0 below the surface, NaN where
        one is no direction.

        Raises InputError where they are no such vectors, or f is known at single pairs only.
        """
        return self._f(incident, exit)

    def evaluate(
        self, theta_i: ArrayLike, phi_i: ArrayLike, theta_r: ArrayLike, phi_r: ArrayLike
    ) -> np.ndarray:
        """f (..., c), 1/sr, at angles in radians that broadcast together."""
        given = checked_angles(theta_i=theta_i, phi_i=phi_i, theta_r=theta_r, phi_r=phi_r)
        return self._f(unit_vectors(*given[:2]), unit_vectors(*given[2:]))

    def angles(
        self, theta_i: ArrayLike, theta_r: ArrayLike, dphi: ArrayLike, phi_i: ArrayLike = 0.0
    ) -> np.ndarray:
        """f (..., c), 1/sr; dphi = phi_r - phi_i, pi is forward."""
        given = checked_angles(theta_i=theta_i, theta_r=theta_r, dphi=dphi, phi_i=phi_i)
        theta_i, theta_r, dphi, phi_i = given
        return self.evaluate(theta_i, phi_i, theta_r, phi_i + dphi)

    def standard_error(self, *where: ArrayLike) -> np.ndarray:
        """NaN (..., c): the file says nothing of it. ``where`` as of a measured BRDF."""
        theta_i, phi_i, theta_r, phi_r = four_angles(where)
        return np.full_like(self.evaluate(theta_i, phi_i, theta_r, phi_r), np.nan)

    def prediction_interval(self, *where: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """The same of both ends."""
        nothing = self.standard_error(*where)
        return nothing, nothing.copy()

    def sample(self, n: int, seed: int = 0) -> list[KnownBrdf]:
        """Raises InputError: the file does not say how sure it is."""
        raise InputError(self.name, "does not say how sure it is, so nothing can be drawn; fit it first")

    def save(self, path: str | Path) -> None:
        """Raises InputError: it has no coefficients to be saved."""
        raise InputError(self.name, "holds no coefficients to be saved; export it, or fit it first")

    def directional_albedo(self, theta_i: ArrayLike, phi_i: ArrayLike = 0.0) -> np.ndarray:
        """(..., c) fraction of the light from (theta_i, phi_i) that is sent out, by quadrature."""
        theta, phi = np.broadcast_arrays(*checked_angles(theta_i=theta_i, phi_i=phi_i))
        theta, phi = np.abs(theta), np.where(theta < 0.0, phi + np.pi, phi)
        sent = [albedo_of(self._safe, t, p, finest=FINEST) for t, p in zip(theta.flat, phi.flat, strict=True)]
        value = np.reshape(sent, (*theta.shape, len(self.channels)))
        value[~np.isfinite(theta + phi)] = np.nan
        return value

    def _safe(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        """f, 0 where it was not measured."""
        return np.nan_to_num(self._f(incident, exit))

    def albedo(self) -> Albedo:
        """Under even light from the whole hemisphere, by quadrature; its error is not known."""
        theta, weight = elevation_rule(6, level=3)
        turns = (0.0,) if self.known.isotropic else tuple(np.pi * np.arange(8) / 8)
        sent = np.mean([albedo_of(self._safe, theta, turn, finest=FINEST) for turn in turns], axis=0)
        value = 2.0 * (weight * np.cos(theta)) @ sent
        return Albedo(value, np.full_like(value, np.nan))

    def bihemispherical_albedo(self) -> np.ndarray:
        """(c,) the value of :meth:`albedo`."""
        return self.albedo().value

    def export(
        self, format: str, path: str | Path, *, channel: str | None = None, order: int | None = None
    ) -> str:
        """Write it for another program (docs/cli.md); what is lost by that, in words.

        Raises InputError where the format cannot hold it, or needs coefficients.
        """
        self.require(format)
        source = self if channel is None else self.only(channel)
        return self._export(source.filled(), format, Path(path), order)

    def require(self, format: str) -> None:
        """Raises InputError where the ``format`` cannot be written of it."""
        if format in _COEFFICIENTS:
            raise InputError(self.name, f"holds no coefficients, which {format} needs; fit it first")
        if self.known.evaluate is None:
            raise InputError(self.name, "is known at single pairs of directions only; fit it first")

    def only(self, channel: str) -> KnownBrdf:
        """Of one channel."""
        place, whole = self._only_place(channel, self.channels), self.known.evaluate
        if whole is None:
            raise InputError(self.name, "is known at single pairs of directions only; fit it first")
        return KnownBrdf(
            Known(self.name, (channel,), self.known.isotropic, lambda i, r: whole(i, r)[..., [place]])
        )

    def filled(self) -> KnownBrdf:
        """The same with 0 where it was not measured, as other programs take it."""
        return KnownBrdf(Known(self.name, self.channels, self.known.isotropic, self._safe))

    def __repr__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> list[str]:
        pairs = (
            "everywhere" if self.known.value is None else f"at {len(self.known.value)} pairs of directions"
        )
        pairs += (
            ", and between them" if self.known.value is not None and self.known.evaluate is not None else ""
        )
        return [
            f"{self.name}: no coefficients, f known {pairs}",
            f"{self._turns()}, channels {', '.join(self.channels)}",
            "albedo not known" if self.known.evaluate is None else "albedo: ask for it, by quadrature",
            "standard errors not known",
            "from a file of its own kind",
        ]

    def _turns(self) -> str:
        if not self.turning:
            return "isotropic"
        return "turning" if self.known.value is None else "turning or isotropic"

    def _known(self) -> Known:
        return self.known
