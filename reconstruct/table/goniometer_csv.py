"""Tabulated measurements of a goniometer: CSV, one row a pair of directions."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from photogonio.capture.errors import InputError
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.facet_table import FacetTable

UNBINNED = -1  # a table's level when every sample is a cell of its own
# of a value, its standard error where none is given: only against noise that shows in values below zero. Goniometers
# state 0.5 to 2 %
_RELATIVE = 0.01
_LEAST_BELOW, _SHARE_BELOW = 5, 0.01  # rows below zero, and their share, that tell the noise
_ANGLES = ("theta_i", "phi_i", "theta_r", "phi_r")
_NAMES = (*_ANGLES, "value", "sigma")
_FLOOR = 1e-3  # of the median value: equal relative errors stop here, so that a zero has no infinite weight


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
    left_out: int = 0  # rows without a number, or with a direction below the surface

    @property
    def incident(self) -> np.ndarray:
        """Unit vectors (n, 3) toward the light, tangent frame."""
        return unit_vectors(self.theta_i, self.phi_i)

    @property
    def exit(self) -> np.ndarray:
        """Unit vectors (n, 3) toward the viewer, tangent frame."""
        return unit_vectors(self.theta_r, self.phi_r)


def read_samples(
    path: Path,
    *,
    columns: Mapping[str, str] | None = None,
    where: Sequence[tuple[str, str]] = (),
) -> GoniometerSamples:
    """Read a table of measurements: a header line, then angles in degrees and one column a channel.

    ``columns`` maps theta_i, phi_i, theta_r, phi_r, value and sigma to the file's headers; several values or
    sigmas are joined by ``+``. Without ``value`` every other column is a channel. ``where`` keeps rows whose
    column has a value. A negative theta is the other side: phi turned by 180 degrees. No phi_i: it is zero.

    Raises:
        InputError: the file cannot be read, a column is missing, a cell is no number, or no row is left.
    """
    header, rows = _read_rows(path)
    names = _match_columns(path, header, columns or {}, where)
    rows = _select(path, header, rows, where)
    angle = {name: _numbers(path, header, rows, names[name]) for name in _ANGLES if name in names}
    theta_i, phi_i = _fold(angle["theta_i"], angle.get("phi_i", np.zeros(len(rows))))
    theta_r, phi_r = _fold(angle["theta_r"], angle["phi_r"])
    channels = tuple(names["value"].split("+"))
    value = np.column_stack([_numbers(path, header, rows, name) for name in channels])
    sigma = _sigma(path, header, rows, names.get("sigma"), value)
    parts = [theta_i, phi_i, theta_r, phi_r, value.sum(1)] + ([] if sigma is None else [sigma.sum(1)])
    keep = np.all(np.isfinite(parts), axis=0) & (theta_i <= math.pi / 2) & (theta_r <= math.pi / 2)
    if not keep.any():
        raise InputError(path, "no row has a value and both directions above the surface")
    if sigma is not None and (sigma[keep] <= 0).any():
        raise InputError(f"{path}: {names['sigma']}", "standard errors must be above zero")
    return GoniometerSamples(
        theta_i=theta_i[keep],
        phi_i=phi_i[keep],
        theta_r=theta_r[keep],
        phi_r=phi_r[keep],
        value=value[keep],
        sigma=None if sigma is None else sigma[keep],
        channels=_channel_names(channels),
        left_out=int(len(keep) - keep.sum()),
    )


def samples_table(samples: GoniometerSamples) -> FacetTable:
    """The samples as a table with one cell a row: level :data:`UNBINNED`, both facets the row's number.

    ``variance`` is sigma squared where sigma is given, else value squared (floored) and, where values
    fall below zero, the noise that they show: equal relative errors of unknown size, so that only the ratios of the
    variances mean something.
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
        variance=_relative_variance(samples.value) if samples.sigma is None else samples.sigma**2,
        incident=samples.incident,
        exit=samples.exit,
        place=np.zeros((n, 3)),
    )


def _relative_variance(value: np.ndarray) -> np.ndarray:
    """(n, c) up to a factor: equal relative errors, and beside them the noise that values below zero show."""
    size = np.abs(value)
    middle, least = np.median(size, axis=0), np.min(size, axis=0, where=size > 0.0, initial=np.inf)
    # a table of zeros for the most part, as beside a narrow peak, knows them no better than its least reading
    floor = np.where(middle > 0.0, _FLOOR * middle, np.where(np.isfinite(least), least, 0.0))
    noise = [_noise_below_zero(channel) / _RELATIVE for channel in value.T]
    return np.maximum(value**2 + np.square(noise), np.maximum(floor**2, np.finfo(float).tiny))


def _noise_below_zero(value: np.ndarray) -> float:
    """Standard deviation of the noise of ``value`` (n,), of which no true one is negative; 0 where few are, which may
    be gross errors. Half of the normal law lies within 0.6745 of it."""
    below = -value[value < 0.0]
    return (
        float(np.median(below)) / 0.6745
        if len(below) >= max(_LEAST_BELOW, _SHARE_BELOW * len(value))
        else 0.0
    )


def _fold(theta: np.ndarray, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Degrees to radians; a negative theta becomes positive on the other side."""
    phi = np.where(theta < 0, phi + 180.0, phi)
    return np.radians(np.abs(theta)), np.radians(phi)


def _read_rows(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """The header, and each row with its line number; blank lines and comments (#) are passed over."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except FileNotFoundError:
        raise InputError(path, "no such file") from None
    except (IsADirectoryError, PermissionError):
        raise InputError(path, "cannot be read; expected a table of measurements (CSV)") from None
    except UnicodeDecodeError:
        raise InputError(path, "is not text; expected a table of measurements (CSV)") from None
    numbered = [(k, line) for k, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    if len(numbered) < 2:
        raise InputError(path, "is empty; expected a header line and rows of measurements")
    comma = next((mark for mark in ",;\t" if mark in numbered[0][1]), None)
    texts = [line for _, line in numbered]
    cells = list(csv.reader(texts, delimiter=comma)) if comma else [text.split() for text in texts]
    rows = [[cell.strip() for cell in row] for row in cells]
    for (number, _), row in zip(numbered, rows, strict=True):
        if len(row) != len(rows[0]):
            raise InputError(f"{path}: line {number}", f"expected {len(rows[0])} columns, found {len(row)}")
    return rows[0], [(number, row) for (number, _), row in zip(numbered[1:], rows[1:], strict=True)]


def _match_columns(
    path: Path, header: list[str], columns: Mapping[str, str], where: Sequence[tuple[str, str]]
) -> dict[str, str]:
    """Header of each of the names the reader knows; ``value`` and ``sigma`` still joined by +."""
    for name in columns:
        if name not in _NAMES:
            raise InputError(f"--columns {name}", f"expected one of {', '.join(_NAMES)}")
    names = {name: columns.get(name, name) for name in _ANGLES}
    if "phi_i" not in columns and "phi_i" not in header:
        del names["phi_i"]
    if "sigma" in columns or "sigma" in header:
        names["sigma"] = columns.get("sigma", "sigma")
    taken = {part for text in names.values() for part in text.split("+")} | {name for name, _ in where}
    others = [name for name in header if name not in taken]
    names["value"] = columns.get("value", "+".join(others))
    wanted = [part for text in names.values() for part in text.split("+")] + [name for name, _ in where]
    for name in wanted:
        if header.count(name) != 1:
            found = "more than once" if name in header else f"not among {', '.join(header)}"
            raise InputError(path, f"column {name!r} is {found}; map headers with --columns")
    return names


def _select(path, header, rows, where):
    for name, text in where:
        column = header.index(name)
        kept = [row for row in rows if _same(row[1][column], text)]
        if not kept:
            found = sorted({row[1][column] for row in rows})
            listed = ", ".join(found[:8]) + (", ..." if len(found) > 8 else "")
            raise InputError(path, f"no row has {name} = {text}; found {listed}")
        rows = kept
    return rows


def _same(cell: str, text: str) -> bool:
    try:
        return math.isclose(float(cell), float(text), rel_tol=1e-9)
    except ValueError:
        return cell == text


def _numbers(path: Path, header: list[str], rows: list[tuple[int, list[str]]], name: str) -> np.ndarray:
    column = header.index(name)
    numbers = np.full(len(rows), np.nan)
    for k, (line, row) in enumerate(rows):
        if row[column]:
            try:
                numbers[k] = float(row[column])
            except ValueError:
                raise InputError(
                    f"{path}: line {line}", f"{name} is {row[column]!r}; expected a number"
                ) from None
    return numbers


def _sigma(path, header, rows, names: str | None, value: np.ndarray) -> np.ndarray | None:
    if names is None:
        return None
    parts = names.split("+")
    if len(parts) not in (1, value.shape[1]):
        raise InputError(
            f"--columns sigma={names}", f"expected one, or one for each of {value.shape[1]} values"
        )
    sigma = np.column_stack([_numbers(path, header, rows, name) for name in parts])
    return np.broadcast_to(sigma, value.shape)


def _channel_names(headers: tuple[str, ...]) -> tuple[str, ...]:
    """``value_R`` and the like lose their prefix."""
    return tuple(name.removeprefix("value_") or name for name in headers)
