"""Matrices of a BSDF XML: a value for each patch of exit and of incident directions, in Klems' bases or the file's own.

Incident patches are numbered by where light travels on, so that a mirror's matrix is diagonal. The first patch of every
ring is centred on azimuth 0 (Klems, "A new method for predicting the solar heat gain of complex fenestration systems",
ASHRAE Transactions 100, 1994).
"""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from photogonio.reconstruct.modes.angles import spherical_angles

KLEMS = (  # rings of the full basis: lower and upper polar angle, degrees, and patches (Klems 1994)
    (0, 5, 1),
    (5, 15, 8),
    (15, 25, 16),
    (25, 35, 20),
    (35, 45, 24),
    (45, 55, 24),
    (55, 65, 24),
    (65, 75, 16),
    (75, 90, 12),
)
LATITUDES = {  # lower bound of each ring, degrees, and its patches
    "LBNL/Klems Full": tuple((low, count) for low, _, count in KLEMS),
    "LBNL/Klems Half": ((0, 1), (6.5, 8), (19.5, 12), (32.5, 16), (45.5, 20), (58.5, 12), (71.5, 8)),
    "LBNL/Klems Quarter": ((0, 1), (9, 8), (27, 12), (45, 12), (63, 8)),
}


@dataclass(frozen=True, slots=True)
class AngleBasis:
    """Patches of the hemisphere: rings of equal ones, the first in the middle of azimuth 0."""

    lower: np.ndarray  # (k,) radians
    patches: np.ndarray  # (k,)

    @classmethod
    def of(cls, rings: tuple[tuple[float, int], ...]) -> AngleBasis:
        lower, patches = zip(*rings, strict=True)
        return cls(np.radians(lower), np.array(patches))

    def __len__(self) -> int:
        return int(self.patches.sum())

    def areas(self) -> np.ndarray:
        """(patches,) projected solid angles."""
        rings = np.pi * np.diff(np.sin(np.append(self.lower, 0.5 * np.pi)) ** 2) / self.patches
        return np.repeat(rings, self.patches)

    def index(self, directions: np.ndarray) -> np.ndarray:
        """(n,) patch of each of the directions (n, 3)."""
        theta, phi = spherical_angles(directions)
        ring = np.searchsorted(self.lower, theta, side="right") - 1
        count = self.patches[ring]
        within = (np.mod(phi, 2.0 * np.pi) / (2.0 * np.pi) * count + 0.5).astype(int) % count
        return np.concatenate([[0], np.cumsum(self.patches)])[ring] + within


def text_of(element: ElementTree.Element, name: str) -> str:
    return (element.findtext(name) or "").strip()


def angle_bases(layer: ElementTree.Element | None) -> dict[str, AngleBasis]:
    """Angle bases by name in small letters: the usual ones, and those that the file defines."""
    found = {name.lower(): AngleBasis.of(rings) for name, rings in LATITUDES.items()}
    for basis in [] if layer is None else layer.iter("AngleBasis"):
        name, blocks = text_of(basis, "AngleBasisName").lower(), basis.findall("AngleBasisBlock")
        if name and blocks and name not in found:
            lower = [float(text_of(one, "ThetaBounds/LowerTheta") or 0.0) for one in blocks]
            found[name] = AngleBasis(
                np.radians(lower), np.array([int(text_of(one, "nPhis")) for one in blocks])
            )
    return found


@dataclass(frozen=True, slots=True)
class PatchMatrix:
    """f of patches."""

    value: np.ndarray  # (exit, incident) 1/sr
    exit: AngleBasis
    incident: AngleBasis

    def __call__(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        """f (n, 1), 1/sr, of unit vectors (n, 3): the patches', as in Radiance."""
        f = self.value[self.exit.index(exit), self.incident.index(incident * [-1.0, -1.0, 1.0])]
        return np.where((incident[:, 2] > 0) & (exit[:, 2] > 0), f, 0.0)[:, None]

    def albedo(self, incident: np.ndarray) -> np.ndarray:
        """(n, 1) directional albedo of light from unit vectors (n, 3)."""
        sent = self.exit.areas() @ self.value
        return sent[self.incident.index(incident * [-1.0, -1.0, 1.0])][:, None]


def matrix_of(block: ElementTree.Element, structure: str, bases: dict[str, AngleBasis]) -> PatchMatrix:
    """Of a block: one row an exit patch and one column an incident one, or with ``Rows`` the other way round.

    Raises:
        ValueError: an unknown basis, or another count of numbers.
    """
    names = [text_of(block, name) for name in ("ColumnAngleBasis", "RowAngleBasis")]
    unknown = [name for name in names if name.lower() not in bases]
    if unknown:
        raise ValueError(f"unknown angle basis {unknown[0]!r}")
    into, out = (bases[name.lower()] for name in names)
    values = np.array(text_of(block, "ScatteringData").replace(",", " ").split(), float)
    if len(values) != len(into) * len(out):
        raise ValueError(f"{len(values)} values for {len(out)} by {len(into)} patches")
    shape = (len(into), len(out)) if structure.lower() == "rows" else (len(out), len(into))
    matrix = values.reshape(shape)
    matrix = np.maximum(matrix.T if structure.lower() == "rows" else matrix, 0.0)
    if not np.isfinite(matrix).all():
        raise ValueError("numbers that are not finite")
    return PatchMatrix(matrix, out, into)
