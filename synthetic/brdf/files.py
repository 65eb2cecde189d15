"""BRDFs from files: coefficients, MERL cubes, grids and tables."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial import QhullError

from photogonio.capture.errors import InputError
from photogonio.capture.files.arrays import read_arrays
from photogonio.capture.files.documents import read_json, read_text
from photogonio.synthetic.brdf.expansion import COSINES, Expansion
from photogonio.synthetic.brdf.measured import MERL_SCALE, MERL_SHAPE, MerlCube, Tabulated
from photogonio.synthetic.brdf.reflectance import Reflectance

Foreign = Callable[[Path], Reflectance]
NEAR = 1e-6  # radians, of rounding
LARGEST = 1e12  # 1/sr
MOST_VALUES = 10**8
HIGHEST = 100  # order of modes
SYMMETRIES = ("isotropic", "reciprocal", "general")


def read_brdf(
    path: Path,
    *,
    columns: dict[str, str] | None = None,
    select: dict[str, float] | None = None,
    foreign: Foreign | None = None,
) -> Reflectance:
    """A BRDF from a file: .json coefficients, .binary MERL, .npz grid, .csv table of angles in degrees.

    ``columns`` maps theta_i, phi_i, theta_r, phi_r (or dphi) and value to a csv's headers; ``select`` keeps
    the rows with these values. ``foreign`` reads what else there may be: other suffixes, folders, and tables that have
    no column `value` where none is told. Raises InputError.
    """
    readers = {".json": read_expansion, ".binary": read_merl, ".npz": read_grid}
    if not path.exists() or (path.is_dir() and foreign is None):
        raise InputError(path, "no such file")
    plain = path.is_file() and path.suffix in (*readers, ".csv")
    if foreign is not None and not columns and not select and not (plain and _is_own(path)):
        return foreign(path)
    if path.suffix == ".csv":
        return read_csv(path, columns or {}, select or {})
    if path.suffix not in readers:
        raise InputError(
            path, "expected a file of coefficients (.json), MERL (.binary), a grid (.npz) or a table (.csv)"
        )
    return readers[path.suffix](path)


def _is_own(path: Path) -> bool:
    """Whether a file needs nobody else to be read: all but a table whose header has other columns."""
    if path.suffix != ".csv":
        return True
    with path.open("rb") as file:
        header = file.readline().decode("latin-1")
    return header.startswith("#") or "value" in [name.strip() for name in header.split(",")]


def read_expansion(path: Path) -> Expansion:
    data = read_json(path)
    try:
        found = Expansion(
            symmetry=data.get("symmetry", "isotropic"),
            quantity=data.get("quantity", "brdf"),
            modes=tuple(tuple(int(k) for k in mode) for mode in data["modes"]),
            coefficients=np.array(data["coefficients"], float).reshape(len(data["modes"]), -1),
            lobes=tuple(data.get("lobes", ())),
        )
        check_expansion(found)
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, ArithmeticError) as error:
        raise InputError(path, f"not a coefficient file: {error}") from error
    return found


def check_expansion(found: Expansion) -> None:
    """Raises ValueError unless all modes and lobes are ones that docs/modes.md knows, and all numbers are finite."""
    if found.symmetry not in SYMMETRIES or found.quantity not in COSINES:
        raise ValueError(f"unknown symmetry {found.symmetry!r:.60} or quantity {found.quantity!r:.60}")
    for mode in found.modes:
        pairs = (mode[:1] + mode[2:], mode[1:]) if found.symmetry == "isotropic" else (mode[:2], mode[2:])
        known = all(len(one) == 2 and abs(one[1]) <= one[0] and (sum(one) % 2 == 0) for one in pairs)
        if not known or max(mode) > HIGHEST or (found.symmetry == "isotropic" and mode[2] < 0):
            raise ValueError(f"there is no {found.symmetry} mode {mode!r:.60}, or none to order {HIGHEST}")
    slant = np.array([[0.6, 0.0, 0.8]])
    value = found(slant, np.array([[0.0, 0.6, 0.8]]))  # and so reads every key of every lobe
    if not (np.abs(found.coefficients) <= LARGEST).all() or not (np.abs(value) <= LARGEST).all():
        raise ValueError(f"every number must be finite, and at most {LARGEST:g}")
    if value.shape != (1, found.coefficients.shape[1]):
        raise ValueError("expected a number a channel")


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
    return _tabulated(path, *grid_arrays(path))


def grid_arrays(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """A truth grid: arrays `grid` (n, 3) of theta_i, theta_r, dphi in radians, and `brdf` (n, c) in 1/sr.

    Raises InputError.
    """
    arrays = read_arrays(path, "a grid of arrays `grid` and `brdf`")
    if not {"grid", "brdf"} <= set(arrays):
        raise InputError(path, "expected arrays `grid` and `brdf`")
    grid, value = arrays["grid"], arrays["brdf"]
    if grid.dtype.kind not in "fiu" or value.dtype.kind not in "fiu":
        raise InputError(path, f"expected numbers, found {grid.dtype} and {value.dtype}")
    if grid.ndim != 2 or grid.shape[1] != 3 or value.ndim not in (1, 2) or value.shape[0] != len(grid):
        raise InputError(path, f"expected grid (n, 3) and brdf (n, c), found {grid.shape} and {value.shape}")
    if not len(grid) or not value.size or value.size > MOST_VALUES:
        raise InputError(path, f"expected directions and values, found {grid.shape} and {value.shape}")
    grid, value = grid.astype(float), value.astype(float).reshape(len(grid), -1)
    check_values(path, grid, value)
    return grid, value


def check_values(path: Path, angles: np.ndarray, values: np.ndarray) -> None:
    """Raises InputError unless angles (n, 3), radians, are directions above the surface and values (n, c) numbers."""
    polar, turn = angles[:, :2], angles[:, 2]
    if (
        not ((polar >= 0.0) & (polar <= np.pi / 2 + NEAR)).all()
        or not (np.abs(turn) <= 2 * np.pi + NEAR).all()
    ):
        raise InputError(path, "expected theta_i and theta_r from 0 to 90 degrees, and dphi within a turn")
    if not (np.abs(values) <= LARGEST).all():
        raise InputError(path, f"expected finite values of at most {LARGEST:g} 1/sr")


def _tabulated(path: Path, angles: np.ndarray, values: np.ndarray) -> Tabulated:
    try:
        return Tabulated(angles, values)
    except (QhullError, ValueError) as error:
        line = str(error).strip().partition("\n")[0]
        raise InputError(path, f"its directions are no grid and span no volume ({line})") from error


def read_csv(path: Path, columns: dict[str, str], select: dict[str, float]) -> Tabulated:
    lines = read_text(path).splitlines()
    try:
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    except csv.Error as error:
        raise InputError(path, f"not a table: {error}") from error
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
    check_values(path, angles, values)
    return _tabulated(path, angles, values)


def table_column(rows: list[dict[str, str]], name: str) -> np.ndarray:
    return np.array([float(row[name]) for row in rows])


def azimuth_difference(rows: list[dict[str, str]], columns: dict[str, str]) -> np.ndarray:
    """dphi in degrees (n,), from its own column or from both azimuths."""
    if "dphi" in columns or "dphi" in rows[0]:
        return table_column(rows, columns.get("dphi", "dphi"))
    phi_i, phi_r = (table_column(rows, columns.get(k, k)) for k in ("phi_i", "phi_r"))
    return phi_r - phi_i
