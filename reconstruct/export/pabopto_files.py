"""pab-opto's files of measured scattering: a folder with one file an incident direction.

The header's words are those that Radiance's ``pabopto2bsdf`` looks for: ``intheta`` and ``inphi`` are toward the light,
``format: theta phi BSDF`` names the columns, ``colorimetry`` the values.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.export.loss import PLACE, Evaluate
from photogonio.reconstruct.export.rgb import rgb_order
from photogonio.reconstruct.export.table_grid import TURN, Steps, scale_in_words, title, turns
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.gridded import between

XYZ_OF_RGB = np.array(  # linear sRGB, white of D65 (IEC 61966-2-1)
    [[0.4123908, 0.3575843, 0.1804808], [0.2126390, 0.7151687, 0.0721923], [0.0193308, 0.1191948, 0.9505322]]
)
FINE_TURN = 10.0  # degrees between azimuths of an isotropic surface


def write_pabopto(brdf: Brdf, folder: Path) -> None:
    """BSDF in 1/sr at polar angles and azimuths all the way round, light from azimuth 0 alone if isotropic: X, Y and Z
    where the channels are R, G and B, taken as linear sRGB; else Y, the channels' mean."""
    folder.mkdir(parents=True, exist_ok=True)
    steps = Steps.of(brdf, _azimuths)
    azimuth = turns(TURN) if brdf.turning else _azimuths(steps)
    theta, phi = (grid.ravel() for grid in np.meshgrid(steps.polar_nodes(), azimuth, indexing="ij"))
    once = (theta > 0.0) | (phi == 0.0)  # at the normal all azimuths are one
    theta, phi = theta[once], phi[once]
    colour = "CIE-XYZ" if rgb_order(brdf.channels) else "CIE-Y"
    name = re.sub(r"[^\w .-]", "_", title(brdf), flags=re.ASCII)
    for theta_i, phi_i in _incident(brdf, steps):
        f = brdf.evaluate(*np.radians([theta_i, phi_i]), *np.radians([theta, phi]))
        head = (
            f'#sample_name "{name}"\n#intheta {theta_i:g}\n#inphi {phi_i:g}\n#colorimetry: {colour}\n'
            f"#units: degrees, 1/sr, {scale_in_words(brdf)}\n#remark: {PLACE}\n#format: theta phi BSDF\n"
        )
        rows = np.column_stack([theta, phi, in_xyz(brdf, np.maximum(f, 0.0))])
        with (folder / f"in_{theta_i:05.2f}_{phi_i:05.1f}.dat").open("w", encoding="ascii") as file:
            file.write(head)
            np.savetxt(file, rows, fmt=["%g", "%g", *["%.7g"] * (rows.shape[1] - 2)])


def read_pabopto_files(folder: Path) -> Evaluate:
    """f between the directions of a folder that :func:`write_pabopto` wrote.

    Raises:
        InputError: it is another's.
    """
    incident, exit, value = [], [], []
    for file in sorted(folder.iterdir()):
        said = dict(line[1:].split(maxsplit=1) for line in file.read_text().splitlines() if line[0] == "#")
        rows = np.loadtxt(file, ndmin=2)
        exit.append(unit_vectors(*np.radians(rows[:, :2]).T))
        toward = unit_vectors(*np.radians([float(said["intheta"]), float(said["inphi"])]))
        incident.append(np.broadcast_to(toward, (len(rows), 3)))
        value.append(rows[:, 2:])
    found = between(np.vstack(incident), np.vstack(exit), np.vstack(value))
    if found is None:
        raise InputError(folder, "its directions are no whole grid of angles")
    return found


def in_xyz(brdf: Brdf, value: np.ndarray) -> np.ndarray:
    """(n, 3) X, Y, Z of values (n, c) in R, G and B; else (n, 1) their mean."""
    order = rgb_order(brdf.channels)
    return value.mean(axis=1, keepdims=True) if order is None else value[:, order] @ XYZ_OF_RGB.T


def _azimuths(steps: Steps) -> np.ndarray:
    """Of an isotropic surface, degrees."""
    narrow = steps != Steps()
    return steps.whole_turn() if narrow else turns(FINE_TURN)


def _incident(brdf: Brdf, steps: Steps) -> Iterator[tuple[float, float]]:
    """theta_i, phi_i in degrees; the normal once."""
    for theta in steps.polar_nodes():
        for phi in turns() if brdf.turning and theta > 0.0 else (0.0,):
            yield float(theta), float(phi)
