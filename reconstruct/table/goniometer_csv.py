"""Tabulated measurements of a goniometer, one row a pair of directions, as a table to fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.capture.diagnosis import Diagnosis
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.facet_table import FacetTable

UNBINNED = -1  # a table's level when every sample is a cell of its own


@dataclass(frozen=True, slots=True)
class GoniometerSamples:
    """Measured values of a BRDF, one row a pair of directions."""

    theta_i: np.ndarray  # (n,) radians, 0 to pi/2
    phi_i: np.ndarray  # (n,) radians
    theta_r: np.ndarray  # (n,) radians, 0 to pi/2
    phi_r: np.ndarray  # (n,) radians
    value: np.ndarray  # (n, c) 1/sr
    sigma: np.ndarray | None  # (n, c) standard error; None: not given
    channels: tuple[str, ...]
    left_out: int = 0  # rows that are no measurements
    diagnoses: tuple[Diagnosis, ...] = ()  # what was left out, and what is doubtful
    notes: tuple[str, ...] = ()  # how the table was read
    line: np.ndarray | None = (
        None  # (n, 1) or (n, c) lines of the file, of all channels or of each; None: no lines
    )

    @property
    def lines(self) -> np.ndarray:
        """Lines of the file. Raises TypeError where there was none."""
        if self.line is None:
            raise TypeError("these samples are from no file")
        return self.line

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was left out and what is doubtful, in words."""
        return tuple(one.message for one in self.diagnoses)

    @property
    def incident(self) -> np.ndarray:
        """Unit vectors (n, 3) toward the light, tangent frame."""
        return unit_vectors(self.theta_i, self.phi_i)

    @property
    def exit(self) -> np.ndarray:
        """Unit vectors (n, 3) toward the viewer, tangent frame."""
        return unit_vectors(self.theta_r, self.phi_r)


def samples_table(samples: GoniometerSamples) -> FacetTable:
    """The samples as a table with one cell a row: level :data:`UNBINNED`, both facets the row's number.

    ``variance`` is sigma squared where sigma is given, else 0: a fit finds the noise, since it cannot be told from the
    readings alone (:mod:`reconstruct.rows.row_noise`).
    """
    n = len(samples.value)
    rows = np.arange(n, dtype=np.int32)
    return FacetTable(
        level=UNBINNED,
        channels=samples.channels,
        groups=("table",),
        isotropic=False,
        group=np.zeros(n, np.int32),
        facet_i=rows,
        facet_r=rows.copy(),
        count=np.ones(n),
        weight=np.ones(n),
        value=samples.value,
        value2=samples.value**2,
        variance=np.zeros_like(samples.value) if samples.sigma is None else samples.sigma**2,
        incident=samples.incident,
        exit=samples.exit,
        place=np.zeros((n, 3)),
    )
