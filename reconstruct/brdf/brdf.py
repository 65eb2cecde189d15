"""A measured BRDF: modes and lobes, how sure they are, and the coefficient file (docs/modes.md)."""

from __future__ import annotations

import json
import os
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf import schema as coefficients
from photogonio.reconstruct.lobes.schlick import RETRO, ggx, retro
from photogonio.reconstruct.modes import basis as modes
from photogonio.reconstruct.modes import integrals
from photogonio.reconstruct.modes.angles import spherical_angles
from photogonio.reconstruct.modes.quadrature import elevation_rule


@dataclass(frozen=True, slots=True)
class Lobe:
    """GGX: weight D G2 F / (4 cos_i cos_r), height-correlated Smith G2, Schlick F; or a retro-reflective peak."""

    roughness: float  # GGX alpha
    f0: np.ndarray  # (c,) base reflectance
    weight: np.ndarray  # (c,)
    model: str = (
        "ggx"  # one of photogonio.reconstruct.lobes.schlick.MODELS; a retro-reflective one has no use for f0
    )
    extra: dict[str, object] = field(default_factory=dict)  # unknown keys of the file, kept on a round trip

    def evaluate(self, theta_i: ArrayLike, theta_r: ArrayLike, dphi: ArrayLike) -> np.ndarray:
        """(..., c) BRDF, 1/sr; angles in radians that broadcast together."""
        if self.model.startswith(RETRO):
            peak = retro(theta_i, theta_r, dphi, self.roughness, self.model.removeprefix(RETRO))
            return np.asarray(self.weight, float) * peak[..., None]
        return np.asarray(self.weight, float) * ggx(theta_i, theta_r, dphi, self.roughness, self.f0)

    def directional_albedo(self, theta_i: ArrayLike) -> np.ndarray:
        """(..., c) fraction of the light from ``theta_i`` that the lobe sends out."""
        return integrals.albedo_by_quadrature(self.evaluate, theta_i, self.roughness)


@dataclass(frozen=True, slots=True)
class Brdf:
    """Sum of all modes (divided by the cosines that ``quantity`` names) and all lobes, 1/sr."""

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

    def evaluate(
        self, theta_i: ArrayLike, phi_i: ArrayLike, theta_r: ArrayLike, phi_r: ArrayLike
    ) -> np.ndarray:
        """f (..., c), 1/sr, for any symmetry; angles in radians that broadcast together.

        An isotropic BRDF depends on ``phi_r - phi_i`` alone: give 0 and dphi. Where ``quantity`` names a
        cosine, f at grazing angles is as unbounded as the division makes it.
        """
        angles = np.broadcast_arrays(*[np.asarray(a, float) for a in (theta_i, phi_i, theta_r, phi_r)])
        shape = angles[0].shape
        ti, pi, tr, pr = modes.flat(*angles)
        value = self._sum_of_modes(ti, pi, tr, pr)
        if self.quantity != "brdf":
            value /= modes.cosines(self.quantity, ti, tr)[:, None]
        for lobe in self.lobes:
            value += lobe.evaluate(ti, tr, pr - pi)
        return value.reshape(*shape, value.shape[1])

    def __call__(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        """f (..., c), 1/sr, at unit vectors (..., 3) of the tangent frame that broadcast together."""
        return self.evaluate(*spherical_angles(incident), *spherical_angles(exit))

    def directional_albedo(self, theta_i: ArrayLike, phi_i: ArrayLike = 0.0) -> np.ndarray:
        """(..., c) fraction of the light from (theta_i, phi_i) that is sent out; modes in closed form."""
        value = integrals.directional_albedo(
            self.symmetry, self.modes, self.coefficients, self.quantity, theta_i, phi_i
        )
        for lobe in self.lobes:
            value = value + np.broadcast_to(lobe.directional_albedo(theta_i), value.shape)
        return value

    def bihemispherical_albedo(self) -> np.ndarray:
        """(c,) fraction of even illumination that is sent out; modes in closed form."""
        value = integrals.bihemispherical_albedo(self.symmetry, self.modes, self.coefficients, self.quantity)
        theta, weight = elevation_rule(8, level=6)
        for lobe in self.lobes:
            value = value + 2 * (weight * np.cos(theta)) @ lobe.directional_albedo(theta)
        return value

    def save(self, path: Path | str) -> None:
        """Write the coefficient file (docs/modes.md), whole or not at all. Inverse of :func:`load_brdf`."""
        text = json.dumps(coefficients.document(self), indent=1, allow_nan=False) + "\n"
        path = Path(path)
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.name, suffix=".part")
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(text)
            os.chmod(temporary, 0o644)
            os.replace(temporary, path)
        finally:  # there only if the writing was cut short
            Path(temporary).unlink(missing_ok=True)

    def _sum_of_modes(self, theta_i, phi_i, theta_r, phi_r) -> np.ndarray:
        if self.symmetry == "isotropic":
            return modes.evaluate_isotropic(self.modes, self.coefficients, theta_i, theta_r, phi_r - phi_i)
        evaluate = modes.evaluate_general if self.symmetry == "general" else modes.evaluate_reciprocal
        return evaluate(self.modes, self.coefficients, theta_i, phi_i, theta_r, phi_r)


def load_brdf(path: Path | str) -> Brdf:
    """Read a coefficient file. Inverse of :meth:`Brdf.save`.

    Raises photogonio.capture.errors.InputError naming the file and the key that cannot be used.
    """
    try:
        document = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(path, error.strerror or "cannot be read") from error
    except ValueError as error:
        raise InputError(path, f"not a JSON file: {error}") from error
    known, lobes = coefficients.parse(path, document)
    return Brdf(**known, lobes=tuple(Lobe(**lobe) for lobe in lobes))
