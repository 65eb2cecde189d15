"""Radiance and WINDOW's full Klems basis: means over 145 by 145 patches of the hemispheres.

Columns are patches of the negated incident direction's azimuth, rows of the exit direction; a patch is centred on
azimuth 0 in every ring (Klems 1994). Checked with Radiance's own library.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.radiance_matrix import KLEMS, AngleBasis
from photogonio.reconstruct.export import radiance_xml as xml
from photogonio.reconstruct.export.loss import ANGLES, PLACE
from photogonio.reconstruct.export.table_grid import title

PATCHES = sum(count for _, _, count in KLEMS)
_INTO, _OUT = (
    5,
    4,
)  # samples along each side of an incident patch and of an exit one: no mirror pairs among them
_ACROSS, _AROUND = 3, 24  # albedos across a ring, and around where the sample's turn counts
_ROUNDS, _MOST = 40, 4.0  # of weighing; greatest weight of a patch
_BASIS = (
    "\t\t\t<ColumnAngleBasis>LBNL/Klems Full</ColumnAngleBasis>\n"
    "\t\t\t<RowAngleBasis>LBNL/Klems Full</RowAngleBasis>"
)


def write_radiance_klems(brdf: Brdf, path: Path) -> None:
    """The full Klems matrix, gray, as :func:`.radiance_xml.gray` has it."""
    definition = f"\t\t<IncidentDataStructure>Columns</IncidentDataStructure>\n{_definition()}"
    path.write_text(
        xml.document(
            name=title(brdf),
            remark=PLACE,
            definition=definition,
            basis=_BASIS,
            data=_rows(matrix(brdf)),
        ),
        encoding="utf-8",
    )


def matrix(brdf: Brdf) -> np.ndarray:
    """(145 exit, 145 incident) means of f over both patches by projected solid angle, 1/sr, held to its albedo.

    A patch is lit from wherever in it with one column. Its sum is made the least albedo that the BRDF has from there,
    so that from no direction does the matrix send out more than the BRDF; what must go (or was missed between the
    samples) is the peaks', and the same of a pair and its reciprocal.
    """
    mean, least = _samples(brdf)
    albedo = _least_albedo(brdf)
    return _at_most(_weighed(mean, least, albedo), albedo)


def _samples(brdf: Brdf) -> tuple[np.ndarray, np.ndarray]:
    """(145, 145) mean of f over each pair of patches, and the least of it there; gray."""
    into, out = patch_samples(), patch_samples(_OUT)
    mean, least = np.empty((2, PATCHES, PATCHES))
    for k in range(PATCHES):
        theta, phi = (angle[k][:, None, None] for angle in into)
        f = xml.gray(brdf, np.maximum(brdf.evaluate(theta, phi + np.pi, *(a[None] for a in out)), 0.0))
        mean[:, k], least[:, k] = f.mean(axis=(0, 2)), f.min(axis=(0, 2))
    if brdf.symmetry == "general":
        return mean, least
    return 0.5 * (mean + _reciprocal(mean)), np.minimum(least, _reciprocal(least))


def _weighed(mean: np.ndarray, least: np.ndarray, albedo: np.ndarray) -> np.ndarray:
    """``least`` and so much of what is above it that columns sum to the albedos (145,), as far as that goes.

    Factors of incident and exit patch, as Sinkhorn scales a matrix, keep it reciprocal.
    """
    area, above = _projected_solid_angles(), mean - least
    wanted = np.maximum(albedo - area @ least, 0.0)
    factor = np.ones(PATCHES)
    for _ in range(_ROUNDS):
        found = area @ (above * factor * factor[_OPPOSITE][:, None])
        step = wanted / np.maximum(found, 1e-9 * albedo + 1e-300)
        factor = np.clip(factor * np.sqrt(step), 0.0, _MOST)
    return least + above * factor * factor[_OPPOSITE][:, None]


def _at_most(value: np.ndarray, albedo: np.ndarray) -> np.ndarray:
    """The matrix with no column's sum above its albedo: of two reciprocal factors, the smaller one."""
    area = _projected_solid_angles()
    factor = np.minimum(1.0, albedo / np.maximum(area @ value, 1e-300))
    return value * np.minimum(factor, factor[_OPPOSITE][:, None])


def _reciprocal(value: np.ndarray) -> np.ndarray:
    """The same (145, 145) with incident and exit direction exchanged: columns are of negated incident azimuths."""
    return value[np.ix_(_OPPOSITE, _OPPOSITE)].T


def _opposite() -> np.ndarray:
    """(145,) the patch half a turn round."""
    rings = [(np.arange(count) + count // 2) % count for _, _, count in KLEMS]
    first = np.cumsum([0, *(count for _, _, count in KLEMS[:-1])])
    return np.concatenate([ring + place for ring, place in zip(rings, first, strict=True)])


def _least_albedo(brdf: Brdf) -> np.ndarray:
    """(145,) the least directional albedo, gray, from within each patch (of the negated incident direction), up to
    where albedos are compared."""
    polar = np.unique([np.linspace(low, min(high, ANGLES[-1]), _ACROSS) for low, high, _ in KLEMS])
    turns = 2 * np.pi * np.arange(_AROUND if brdf.turning else 1) / _AROUND
    albedo = xml.gray(brdf, brdf.directional_albedo(np.radians(polar)[:, None], turns))
    found = []
    for low, high, count in KLEMS:
        ring = albedo[(polar >= low) & (polar <= high)].min(axis=0)
        for k in range(count):
            apart = np.abs(np.angle(np.exp(1j * (turns - np.pi - 2 * np.pi * k / count))))
            near = apart <= np.pi / count + np.pi / _AROUND
            found.append(ring[near].min() if brdf.turning else ring[0])
    return np.array(found)


def _projected_solid_angles() -> np.ndarray:
    """(145,) sr, of the patches."""
    return AngleBasis.of(tuple((low, count) for low, _, count in KLEMS)).areas()


def patch_samples(side: int = _INTO) -> tuple[np.ndarray, np.ndarray]:
    """(145, side^2) polar angles and azimuths, radians, each of the same projected solid angle within its patch."""
    theta, phi = [], []
    for low, high, count in KLEMS:
        edges = np.sin(np.radians([low, high])) ** 2
        polar = np.arcsin(np.sqrt(edges[0] + (edges[1] - edges[0]) * (np.arange(side) + 0.5) / side))
        offsets = ((np.arange(side) + 0.5) / side - 0.5) * 2 * np.pi / count
        t, p = (grid.ravel() for grid in np.meshgrid(polar, offsets))
        for k in range(count):
            theta.append(t)
            phi.append(p + 2 * np.pi * k / count)
    return np.array(theta), np.array(phi)


def _rows(value: np.ndarray) -> str:
    return "\n".join("\t".join(f"{x:.6g}" for x in row) for row in value)


def _definition() -> str:
    rings = "\n".join(
        "\t\t\t<AngleBasisBlock>\n"
        f"\t\t\t\t<Theta>{0.5 * (low + high) if low else 0:g}</Theta>\n"
        f"\t\t\t\t<nPhis>{count}</nPhis>\n"
        f"\t\t\t\t<ThetaBounds><LowerTheta>{low}</LowerTheta><UpperTheta>{high}</UpperTheta></ThetaBounds>\n"
        "\t\t\t</AngleBasisBlock>"
        for low, high, count in KLEMS
    )
    return f"\t\t<AngleBasis>\n\t\t\t<AngleBasisName>LBNL/Klems Full</AngleBasisName>\n{rings}\n\t\t</AngleBasis>"


_OPPOSITE = _opposite()
