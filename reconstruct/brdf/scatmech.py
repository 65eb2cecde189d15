"""Coefficient files of SCATMECH's ZernikeExpansion_BRDF_Model: rows ``i, j, n, m, k, l, p, a``.

i and j name an element of the Mueller matrix; rows with i = j = 1 are the BRDF itself on this very basis, n, m radial
orders and k = l the azimuthal order. The coefficient is multiplied by wavelength^p (micrometres). SCATMECH's
normaliser is that of docs/modes.md but for n = 0 < m, where its c^2 is 4 instead of 2. Rows of other elements are kept
as they are. Source: T. A. Germer, Applied Optics 2017, and SCATMECH's zernikeexpansion.cpp (public domain).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.schema import HIGHEST, LARGEST
from photogonio.reconstruct.modes.basis import isotropic_modes


@dataclass(frozen=True, slots=True)
class ScatmechTable:
    """All rows of one file, in its order."""

    rows: np.ndarray  # (r, 7) i, j, n, m, k, l, p
    values: np.ndarray  # (r,)

    @property
    def unpolarised(self) -> np.ndarray:
        """(r,) bool: rows of the BRDF itself."""
        return (self.rows[:, 0] == 1) & (self.rows[:, 1] == 1)


def read_scatmech(path: Path | str) -> ScatmechTable:
    """Read a coefficient file: numbers between commas or blanks, comments after ``;`` or ``#``.

    Raises InputError naming the line. Inverse of :func:`write_scatmech`.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(path, f"cannot be read: {error}") from error
    rows, values = [], []
    for number, line in enumerate(text.splitlines(), 1):
        words = re.split(r"[,\s]+", re.split("[;#]", line)[0].strip())
        if words == [""]:
            continue
        try:
            row, value = [int(word) for word in words[:-1]], float(words[-1])
        except ValueError:
            raise InputError(
                f"{path}: line {number}", f"seven whole numbers and one number are needed: {line!r}"
            ) from None
        _check_row(f"{path}: line {number}", row, value)
        rows.append(row)
        values.append(value)
    if not rows:
        raise InputError(path, "no coefficients in this file")
    return ScatmechTable(np.array(rows), np.array(values))


def _check_row(where: str, row: list[int], value: float) -> None:
    if len(row) != 7 or not np.isfinite(value):
        raise InputError(where, "seven whole numbers and one finite number are needed")
    i, j, n, m, k, l, p = row
    if not 1 <= i <= j <= 4:
        raise InputError(where, f"i <= j from 1 to 4 is needed, not {i}, {j}")
    if p < 0 or min(n, m) < 0 or abs(k) > n or abs(l) > m or (n - k) % 2 or (m - l) % 2:
        raise InputError(where, f"there is no mode n, m, k, l, p = {n}, {m}, {k}, {l}, {p}"[:200])
    if max(n, m, p) > HIGHEST or abs(value) > LARGEST:
        raise InputError(where, f"orders to {HIGHEST} and coefficients to {LARGEST:g} are understood")
    if i == j == 1 and (k != l or k < 0 or l > n):
        raise InputError(where, f"an isotropic mode has k = l >= 0, not {k}, {l}")


def is_scatmech(path: Path | str) -> bool:
    """Whether the first row of a file is one of these, and not a table's headers."""
    try:
        with Path(path).open(encoding="utf-8") as file:
            lines = (re.split("[;#]", line)[0].strip() for line in file)
            words = re.split(r"[,\s]+", next((line for line in lines if line), ""))
            return len(words) == 8 and all(float(word) == int(float(word)) for word in words[:-1])
    except (OSError, ValueError, OverflowError):
        return False


def write_scatmech(path: Path | str, table: ScatmechTable) -> None:
    """Write a coefficient file, every number at full precision. Inverse of :func:`read_scatmech`."""
    lines = [
        ", ".join([*map(str, row), repr(float(value))])
        for row, value in zip(table.rows.tolist(), table.values, strict=True)
    ]
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def scatmech_brdf(table: ScatmechTable, wavelength: float | None = None) -> Brdf:
    """The BRDF that a table describes, one channel, isotropic; ``wavelength`` in micrometres where p > 0 occurs.

    Rows of one mode add up, whichever of n and m comes first. Inverse of :func:`scatmech_table`.
    """
    rows, values = table.rows[table.unpolarised], table.values[table.unpolarised]
    power = rows[:, 6]
    if wavelength is None and power.any():
        raise InputError("wavelength", "the coefficients depend on it (p > 0): give it, in micrometres")
    values = values * (1.0 if wavelength is None else wavelength) ** power * _to_orthonormal(rows)
    keys = np.column_stack([rows[:, 2:4].max(1), rows[:, 2:4].min(1), rows[:, 4]])
    modes = isotropic_modes(int(keys[:, 0].max(initial=0)))
    coefficients = np.array([values[(keys == mode).all(1)].sum() for mode in modes])
    given = np.array([(keys == mode).all(1).any() for mode in modes], bool)
    return Brdf(
        order=int(modes[given][:, 0].max(initial=0)),
        channels=("BRDF",),
        modes=modes[given],
        coefficients=coefficients[given, None],
        standard_errors=np.full((given.sum(), 1), np.nan),
    )


def scatmech_table(brdf: Brdf, channel: int = 0) -> ScatmechTable:
    """One channel of an isotropic expansion of f as SCATMECH's rows, n >= m. Inverse of :func:`scatmech_brdf`."""
    if brdf.symmetry != "isotropic" or brdf.quantity != "brdf" or brdf.lobes:
        raise InputError(
            "scatmech", "only an isotropic expansion of f, without lobes, can be written in this form"
        )
    n, m, l = np.asarray(brdf.modes, int).T
    one, zero = np.ones_like(n), np.zeros_like(n)
    return ScatmechTable(np.column_stack([one, one, n, m, l, l, zero]), brdf.coefficients[:, channel].copy())


def _to_orthonormal(rows: np.ndarray) -> np.ndarray:
    """(r,) SCATMECH's 1 / c over ours."""
    return np.where((rows[:, 2] == 0) & (rows[:, 3] > 0), np.sqrt(0.5), 1.0)
