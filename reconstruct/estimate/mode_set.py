"""Which modes a fit uses: one face over the isotropic, reciprocal and general bases."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.modes import basis as modes
from photogonio.reconstruct.table.cells import Cells


@dataclass(frozen=True, slots=True)
class Basis:
    """Surface scattering modes of one symmetry up to an order."""

    symmetry: str  # "isotropic" | "reciprocal" | "general"
    order: int
    quantity: str = "brdf"  # what is developed: "brdf" | "brdf_cos" | "brdf_cos_cos"

    @property
    def modes(self) -> np.ndarray:
        """Rows of mode indices, (m, 3) or (m, 4), a lower order's first."""
        return _LISTS[self.symmetry](self.order)

    def design(self, cells: Cells) -> np.ndarray:
        """(n, m) what the modes add to f at the cells' mean directions, 1/sr: their values, over the cosines that the
        quantity names."""
        if self.symmetry == "isotropic":
            angles = cells.theta_i, cells.theta_r, cells.dphi
            return modes.isotropic_design(self.order, *angles, self.quantity)
        around = cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r
        return modes.pair_design(self.symmetry, self.order, around, self.quantity)

    def evaluate(self, cells: Cells, coefficients: np.ndarray) -> np.ndarray:
        """(n, c) sum of the modes with ``coefficients`` (m, c), without a design matrix."""
        if self.symmetry == "isotropic":
            angles = cells.theta_i, cells.theta_r, cells.dphi
            total = modes.evaluate_isotropic(self.modes, coefficients, *angles)
        else:
            around = cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r
            total = modes.evaluate_pairs(self.symmetry, self.modes, coefficients, around)
        if self.quantity == "brdf":
            return total
        return total / modes.cosines(self.quantity, cells.theta_i, cells.theta_r)[:, None]

    def degree(self) -> np.ndarray:
        """(m,) how fine each mode is: the mean of n (n + 2) / 8 over its two factors, twice.

        n (n + 2) is the eigenvalue (over 4) of the operator whose eigenfunctions Zernike's polynomials are, so this
        is a squared spatial frequency, 0 for the Lambertian mode and 1 for S_20^0.
        """
        rows = self.modes
        n, m = (rows[:, 0], rows[:, 1]) if self.symmetry == "isotropic" else (rows[:, 0], rows[:, 2])
        return (n * (n + 2) + m * (m + 2)) / 8.0


_LISTS = {
    "isotropic": modes.isotropic_modes,
    "reciprocal": modes.reciprocal_modes,
    "general": modes.general_modes,
}
