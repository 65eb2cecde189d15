"""BRDFs from files: coefficients, MERL cubes, grids and tables."""

from __future__ import annotations

import csv
import json
import zipfile
from pathlib import Path

import numpy as np
from photogonio.capture.errors import InputError
from photogonio.synthetic.brdf.expansion import COSINES, Expansion
from photogonio.synthetic.brdf.measured import MERL_SCALE, MERL_SHAPE, MerlCube, Tabulated
from photogonio.synthetic.brdf.reflectance import Reflectance

SYMMETRIES = ("isotropic", "reciprocal", "general")


def read_brdf(
    path: Path, *, columns: dict[str, str] | None = None, select: dict[str, float] | None = None
) -> Reflectance:
    """A BRDF from a file: .json coefficients, .binary MERL, .npz grid, .csv table of angles in degrees.

    ``columns`` maps theta_i, phi_i, theta_r, phi_r (or dphi) and value to a csv's headers; ``select`` keeps
    the rows with these values. Raises InputError.
    """
    readers = {".json": read_expansion, ".binary": read_merl, ".npz": read_grid}
    if not path.is_file():
        raise InputError(path, "no such file")
    if path.suffix == ".csv":
        return read_csv(path, columns or {}, select or {})
    if path.suffix not in readers:
        raise InputError(
            path, "expected a file of coefficients (.json), MERL (.binary), a grid (.npz) or a table (.csv)"
        )
    return readers[path.suffix](path)


def read_expansion(path: Path) -> Expansion:
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        found = Expansion(
            symmetry=data.get("symmetry", "isotropic"),
            quantity=data.get("quantity", "brdf"),
            modes=tuple(tuple(int(k) for k in mode) for mode in data["modes"]),
            coefficients=np.array(data["coefficients"], float).reshape(len(data["modes"]), -1),
            lobes=tuple(data.get("lobes", ())),
        )
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(path, f"not a coefficient file: {error}") from error
    if found.symmetry not in SYMMETRIES or found.quantity not in COSINES:
        raise InputError(path, f"unknown symmetry {found.symmetry!r} or quantity {found.quantity!r}")
    return found


def read_merl(path: Path) -> MerlCube:
    raw = path.read_bytes()
    count = int(np.prod(MERL_SHAPE))
    if len(raw) != 12 + 24 * count or tuple(np.frombuffer(raw, "<i4", 3)) != MERL_SHAPE:
        raise InputError(
            path, f"not a MERL file of {' x '.join(map(str, MERL_SHAPE))} cells and three channels"
        )
    cube = np.frombuffer(raw, "<f8", offset=12).reshape(3, *MERL_SHAPE)
    return MerlCube(cube * np.array(MERL_SCALE)[:, None, None, None])


def read_grid(path: Path) -> Tabulated:
    """A truth grid: arrays `grid` (n, 3) of theta_i, theta_r, dphi in radians, and `brdf` (n, c)."""
    try:
        # numpy leaves a file that it cannot read open
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as data:
            grid, value = np.asarray(data["grid"], float), np.asarray(data["brdf"], float)
    except (OSError, EOFError, ValueError, KeyError, TypeError, AttributeError, zipfile.BadZipFile):
        raise InputError(path, "expected arrays `grid` and `brdf`") from None
    if grid.ndim != 2 or grid.shape[1] != 3 or value.shape[:1] != grid.shape[:1]:
        raise InputError(path, f"expected grid (n, 3) and brdf (n, c), found {grid.shape} and {value.shape}")
    return Tabulated(grid, value.reshape(len(grid), -1))


def read_csv(path: Path, columns: dict[str, str], select: dict[str, float]) -> Tabulated:
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    if not rows:
        raise InputError(path, "expected a line of headers and rows of numbers")
    try:
        chosen = [row for row in rows if all(float(row[key]) == value for key, value in select.items())]
    except (KeyError, ValueError, TypeError) as error:
        raise InputError(path, f"rows cannot be chosen by {', '.join(select)}: {error}") from error
    if not chosen:
        raise InputError(path, "no row has the values that `where` asks for")
    return tabulated(chosen, columns, path)


def tabulated(rows: list[dict[str, str]], columns: dict[str, str], path: Path) -> Tabulated:
    try:
        angle = {k: table_column(rows, columns.get(k, k)) for k in ("theta_i", "theta_r")}
        turn = azimuth_difference(rows, columns)
        values = np.stack([table_column(rows, k) for k in columns.get("value", "value").split("+")], axis=-1)
    except (KeyError, ValueError, TypeError) as error:
        raise InputError(path, f"not a table of numbers with the named columns: {error}") from error
    turn = np.where((angle["theta_i"] < 0) != (angle["theta_r"] < 0), turn + 180.0, turn)
    dphi = np.arccos(np.cos(np.radians(turn)))
    angles = np.stack([*(np.radians(np.abs(angle[k])) for k in ("theta_i", "theta_r")), dphi], axis=-1)
    return Tabulated(angles, values)


def table_column(rows: list[dict[str, str]], name: str) -> np.ndarray:
    return np.array([float(row[name]) for row in rows])


def azimuth_difference(rows: list[dict[str, str]], columns: dict[str, str]) -> np.ndarray:
    """dphi in degrees (n,), from its own column or from both azimuths."""
    if "dphi" in columns or "dphi" in rows[0]:
        return table_column(rows, columns.get("dphi", "dphi"))
    phi_i, phi_r = (table_column(rows, columns.get(k, k)) for k in ("phi_i", "phi_r"))
    return phi_r - phi_i
