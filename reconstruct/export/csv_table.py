"""A plain table of angles and values: what ``photogonio fit`` and any spreadsheet reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.export.loss import PLACE, Evaluate
from photogonio.reconstruct.export.table_grid import TableValues, in_lines, scale_in_words
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.gridded import between


def write_csv(brdf: Brdf, path: Path) -> None:
    """theta_i, phi_i, theta_r, phi_r in degrees and f, 1/sr, one column a channel; where it is known one standard error
    of f, in a column ``sigma`` a channel. Remarks, which say the units, are below the line of headers.

    Isotropic: phi_i is 0 and phi_r goes half a turn, since the other half is its mirror image. Else phi_r - phi_i goes
    over the same angles whatever phi_i is. Rows are denser about narrow peaks and toward grazing.
    """
    table = TableValues.of(brdf)
    angles, count = table.nodes.angles(), len(brdf.channels)
    columns, names = [table.value.reshape(-1, count)], list(brdf.channels)
    errors = _errors(brdf, angles)
    if errors is not None:
        columns.append(errors)
        names += [f"sigma_{name}" for name in brdf.channels] if len(names) > 1 else ["sigma"]
    remarks = [f"# {line}" for line in _remarks(brdf, table, names[count:])]
    form = ",".join(["%g"] * 4 + ["%.9g"] * count + ["%.4g"] * (len(names) - count)) + "\n"
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write("\n".join([",".join(["theta_i", "phi_i", "theta_r", "phi_r", *names]), *remarks]) + "\n")
        for line in in_lines(form, np.column_stack([*angles, *columns])):
            file.write(line)


def read_csv(path: Path) -> Evaluate:
    """f between the rows of a file that :func:`write_csv` wrote.

    Raises:
        InputError: it is another file.
    """
    with path.open(encoding="utf-8") as file:
        names = file.readline().split(",")
        rows = np.loadtxt(file, delimiter=",", ndmin=2)
    theta_i, phi_i, theta_r, phi_r = np.radians(rows[:, :4]).T
    value = rows[:, 4 : len(names) - sum(name.startswith("sigma") for name in names)]
    found = between(unit_vectors(theta_i, phi_i), unit_vectors(theta_r, phi_r), value)
    if found is None:
        raise InputError(path, "its rows are no whole grid of angles")
    return found


def _errors(brdf: Brdf, grids: list[np.ndarray]) -> np.ndarray | None:
    """(n, c) one standard error of f; None where it is not known at each node, or is none at all."""
    if getattr(brdf, "uncertainty", None) is None:
        return None
    errors = brdf.standard_error(*np.radians(grids))
    return errors if (errors > 0.0).all() else None


def _remarks(brdf: Brdf, table: TableValues, sigmas: list[str]) -> list[str]:
    """What the columns are, and in what units."""
    lines = [
        "theta_i, phi_i: toward the light; theta_r, phi_r: toward the viewer; degrees; phi_r - phi_i is 0 on the lamp's"
        " side",
        f"{', '.join(brdf.channels)}: BRDF in 1/sr, {scale_in_words(brdf)}; {table.remark()}",
    ]
    if sigmas:
        told = f"{', '.join(sigmas)}: one standard error of it in 1/sr, which neighbouring rows share"
        lines.append(told)
    return [*lines, PLACE]
