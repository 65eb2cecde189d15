"""Radiance and WINDOW's full Klems basis: means over 145 by 145 patches of the hemispheres.

Columns are patches of the negated incident direction's azimuth, rows of the exit direction; a patch is centred on
azimuth 0 in every ring (Klems 1994). Checked with Radiance's own library.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.radiance_matrix import KLEMS
from photogonio.reconstruct.export import radiance_xml as xml
from photogonio.reconstruct.export.loss import PLACE
from photogonio.reconstruct.export.table_grid import title

PATCHES = sum(count for _, _, count in KLEMS)
_POLAR, _AZIMUTHS = 5, 5  # samples of a patch
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
    """(145 exit, 145 incident) means of f over both patches by projected solid angle, 1/sr."""
    theta, phi = patch_samples()
    value = np.empty((PATCHES, PATCHES))
    for k in range(PATCHES):
        f = brdf.evaluate(theta[k][:, None, None], phi[k][:, None, None] + np.pi, theta[None], phi[None])
        value[:, k] = xml.gray(brdf, np.maximum(f, 0.0)).mean(axis=(0, 2))
    return value * _held(value, brdf)


def _held(value: np.ndarray, brdf: Brdf) -> np.ndarray:
    """(145,) factors at most 1 that hold each column to the albedo of the BRDF within its patch.

    A gloss much narrower than a patch falls between the samples or on one of them.
    """
    theta, phi = patch_samples()
    if brdf.turning:  # of those farthest from the normal alone, which takes a fifth of the time
        places = np.flatnonzero(theta[0] == theta[0].max())
        theta, phi = theta[:, places], phi[:, places]
    albedo = xml.gray(brdf, _albedo(brdf, theta, phi + np.pi)).max(axis=1)
    return np.minimum(1.0, albedo / np.maximum(_projected_solid_angles() @ value, 1e-300))


def _albedo(brdf: Brdf, theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """(..., c) directional albedo; of a surface that does not turn once for each polar angle."""
    if brdf.turning:
        return brdf.directional_albedo(theta, phi)
    once, place = np.unique(theta, return_inverse=True)
    return brdf.directional_albedo(once)[place.reshape(theta.shape)]


def _projected_solid_angles() -> np.ndarray:
    """(145,) sr, of the patches."""
    rings = [np.pi * np.diff(np.sin(np.radians([low, high])) ** 2)[0] / count for low, high, count in KLEMS]
    return np.repeat(rings, [count for _, _, count in KLEMS])


def patch_samples() -> tuple[np.ndarray, np.ndarray]:
    """(145, s) polar angles and azimuths, radians, each of the same projected solid angle within its patch."""
    theta, phi = [], []
    for low, high, count in KLEMS:
        edges = np.sin(np.radians([low, high])) ** 2
        polar = np.arcsin(np.sqrt(edges[0] + (edges[1] - edges[0]) * (np.arange(_POLAR) + 0.5) / _POLAR))
        offsets = ((np.arange(_AZIMUTHS) + 0.5) / _AZIMUTHS - 0.5) * 2 * np.pi / count
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
