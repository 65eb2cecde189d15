"""pab-opto's files of measured scattering: a folder with one file an incident direction.

The header's words are those that Radiance's ``pabopto2bsdf`` looks for: ``intheta`` and ``inphi`` are toward the light,
``format: theta phi BSDF`` names the columns, ``colorimetry`` the values.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.export.loss import PLACE, Evaluate
from photogonio.reconstruct.export.rgb import rgb_order
from photogonio.reconstruct.export.table_grid import TableValues, in_lines, scale_in_words, title
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.gridded import between

XYZ_OF_RGB = np.array(  # linear sRGB, white of D65 (IEC 61966-2-1)
    [[0.4123908, 0.3575843, 0.1804808], [0.2126390, 0.7151687, 0.0721923], [0.0193308, 0.1191948, 0.9505322]]
)
_EVEN = 5.0  # degrees


def write_pabopto(brdf: Brdf, folder: Path) -> None:
    """BSDF in 1/sr at polar angles and azimuths all the way round, light from azimuth 0 alone if isotropic: X, Y and Z
    where the channels are R, G and B, taken as linear sRGB; else Y, the channels' mean."""
    folder.mkdir(parents=True, exist_ok=True)
    table = TableValues.of(brdf)
    colour = "CIE-XYZ" if rgb_order(brdf.channels) else "CIE-Y"
    name = re.sub(r"[^\w .-]", "_", title(brdf), flags=re.ASCII)
    for i, theta_i in enumerate(table.nodes.theta_i):
        for p, phi_i in enumerate(table.nodes.phi_i if theta_i else table.nodes.phi_i[:1]):  # the normal once
            head = (
                f'#sample_name "{name}"\n#intheta {theta_i:g}\n#inphi {phi_i:g}\n#colorimetry: {colour}\n'
                f"#units: degrees, 1/sr, {scale_in_words(brdf)}, {table.remark()}\n#remark: {PLACE}\n"
                "#format: theta phi BSDF\n"
            )
            rows = _rows(brdf, table, i, p)
            form = " ".join(["%g", "%g", *["%.7g"] * (rows.shape[1] - 2)]) + "\n"
            with (folder / f"in_{theta_i:05.2f}_{phi_i:05.1f}.dat").open(
                "w", encoding="ascii", newline="\n"
            ) as file:
                file.write(head)
                file.writelines(in_lines(form, rows))


def _rows(brdf: Brdf, table: TableValues, i: int, p: int) -> np.ndarray:
    """(n, 2 + c) theta, phi and X, Y, Z of one incident direction, all the way round."""
    nodes, value = table.nodes, table.value[i, p]
    turn = nodes.dphi
    if brdf.turning and not nodes.theta_i[i]:  # whatever way it is turned, by even azimuths
        turn = np.arange(0.0, 360.0, _EVEN)
        angles = np.radians(np.meshgrid(nodes.theta_r, turn, indexing="ij"))
        value = table.factor[0].min() * brdf.evaluate(0.0, 0.0, *angles)
    elif not brdf.turning:
        turn, value = (
            np.append(turn, 360.0 - turn[-2:0:-1]),
            np.concatenate([value, value[:, -2:0:-1]], axis=1),
        )
    theta, phi = (one.ravel() for one in np.meshgrid(nodes.theta_r, turn, indexing="ij"))
    once = (theta > 0.0) | (phi == 0.0)  # at the normal all azimuths are one
    turned = np.mod(phi + nodes.phi_i[p], 360.0).round(3)
    f = np.maximum(value.reshape(-1, value.shape[-1]), 0.0)
    return np.column_stack([theta, turned, in_xyz(brdf, f)])[once]


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
