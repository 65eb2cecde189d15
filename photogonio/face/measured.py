"""A measured BRDF in Python: what :func:`photogonio.load` and the jobs give."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from photogonio.compare.known import Known
from photogonio.face.directions import checked_angles, checked_directions
from photogonio.face.presented import Presented
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.spread import albedo_error, drawn
from photogonio.reconstruct.brdf.words import described
from photogonio.reconstruct.modes.angles import spherical_angles
from photogonio.report.plots import overview_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Albedo(NamedTuple):
    """Fraction of the light that is sent out, and one standard error of it."""

    value: np.ndarray  # (c,)
    error: np.ndarray  # (c,) NaN where it is not known


class MeasuredBrdf(Presented, Brdf):
    """A BRDF with its errors: ``b(wi, wr)`` at unit vectors, 1/sr; 0 below the surface."""

    __slots__ = ()

    @classmethod
    def of(cls, brdf: Brdf) -> MeasuredBrdf:
        """The same, with the methods of this class."""
        return cls(**{field.name: getattr(brdf, field.name) for field in fields(Brdf)})

    @property
    def name(self) -> str:
        """Of the set or file that it came from."""
        return str(self.source.get("name", "BRDF"))

    def __call__(self, incident: ArrayLike, exit: ArrayLike) -> np.ndarray:
        """f (..., c), 1/sr, at vectors (..., 3) of any length that broadcast together; 0 below the surface, NaN where
        one is no direction. Raises InputError where they are no such vectors."""
        return super().__call__(*checked_directions(incident, exit))

    def angles(
        self, theta_i: ArrayLike, theta_r: ArrayLike, dphi: ArrayLike, phi_i: ArrayLike = 0.0
    ) -> np.ndarray:
        """f (..., c), 1/sr, at angles in radians that broadcast together; dphi = phi_r - phi_i, pi is forward.

        ``phi_i`` matters only where the surface changes as it turns.
        """
        given = checked_angles(theta_i=theta_i, theta_r=theta_r, dphi=dphi, phi_i=phi_i)
        theta_i, theta_r, dphi, phi_i = given
        return self.evaluate(theta_i, phi_i, theta_r, phi_i + dphi)

    def standard_error(self, *where: ArrayLike) -> np.ndarray:
        """One standard error of f (..., c), 1/sr; 1.96 of them are a 95 % interval.

        ``where`` is incident and exit unit vectors (..., 3); or theta_i, theta_r, dphi; or theta_i, phi_i, theta_r,
        phi_r, in radians. NaN where the file does not say.
        """
        return super().standard_error(*four_angles(where))

    def prediction_interval(self, *where: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Between what and what, (..., c) each, 1/sr, 95 % of fresh readings lie; ``where`` as for
        :meth:`standard_error`. NaN where it came from no measured rows."""
        return super().prediction_interval(*four_angles(where))

    def albedo(self) -> Albedo:
        """Under even light from the whole hemisphere, with its error."""
        return Albedo(self.bihemispherical_albedo(), albedo_error(self))

    def sample(self, n: int, seed: int = 0) -> list[MeasuredBrdf]:
        """``n`` BRDFs drawn from the covariance of the parameters: a rendering of each is a draw of the rendering.

        Raises InputError where the file does not say how sure it is.
        """
        return [MeasuredBrdf.of(one) for one in drawn(self, n, seed)]

    def plot(self) -> Figure:
        """Lobes, cuts and balls under three lights, as a figure of matplotlib; dashed beyond what was seen."""
        valid = np.radians(self.valid.get("theta_r_max", 90.0))
        symmetry = "turning" if self.turning else "isotropic"
        return overview_figure(
            self, self.channels, f"{self.name}: {symmetry}, {described(self)}", valid=valid
        )

    def export(
        self, format: str, path: str | Path, *, channel: str | None = None, order: int | None = None
    ) -> str:
        """Write it for another program (docs/cli.md); what is lost by that, in words, or nothing.

        Raises InputError where the format cannot hold it.
        """
        brdf = self if channel is None else self.only([self._place(channel)])
        return self._export(brdf, format, Path(path), order)

    def __repr__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> list[str]:
        """Five lines: what it is, its channels, how bright, how far it may be trusted, and from what."""
        albedo = " · ".join(f"{value:.3f}" for value in self.bihemispherical_albedo())
        symmetry = "turning" if self.turning else "isotropic"
        top = self.valid.get("theta_i_max")
        known = self._how_sure()
        valid = "" if top is None else f", valid below {top:.0f} degrees"
        return [
            f"{self.name}: {described(self)}",
            f"{symmetry}, {self.scale} scale, channels {', '.join(self.channels)}",
            f"albedo under even light {albedo}",
            f"standard errors {known}{valid}",
            f"from {self.source.get('command', 'no command that is told')}",
        ]

    def _how_sure(self) -> str:
        known = self.uncertainty
        if known is not None and known.missing is not None:
            return f"said for every parameter, but {known.missing.get('file')} is missing beside the file"
        if known is not None and known.covariance is not None:
            return "said for every parameter"
        errors = self.standard_errors if known is None else known.standard_errors
        if np.isnan(errors).all():
            return "not known"
        if known is None:
            return "of no parameter but modes"
        return "of some parameters not known" if np.isnan(errors).any() else "said for every parameter"

    def _known(self) -> Known:
        return Known(self.name, self.channels, isotropic=not self.turning, evaluate=self)

    def _place(self, channel: str) -> int:
        return self._only_place(channel, self.channels)


def four_angles(where: tuple[ArrayLike, ...]) -> tuple[ArrayLike, ...]:
    """theta_i, phi_i, theta_r, phi_r of two directions, or of three or four angles."""
    if len(where) == 2:
        incident, exit = checked_directions(*where)
        return (*spherical_angles(incident), *spherical_angles(exit))
    if len(where) == 3:
        theta_i, theta_r, dphi = checked_angles(theta_i=where[0], theta_r=where[1], dphi=where[2])
        return (theta_i, 0.0, theta_r, dphi)
    if len(where) != 4:
        raise TypeError("expected two directions, or three or four angles")
    names = ("theta_i", "phi_i", "theta_r", "phi_r")
    return tuple(checked_angles(**dict(zip(names, where, strict=True))))
