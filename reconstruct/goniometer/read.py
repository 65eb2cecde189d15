"""A file of measured values: read, brought to the project's terms, freed of what is no measurement."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.errors import InputError
from photogonio.reconstruct.goniometer.columns import (
    Matched,
    channel_names,
    is_elevation,
    match_columns,
    quantity_said,
    unit_below,
    unused_note,
)
from photogonio.reconstruct.goniometer.convention import directions, per_brdf
from photogonio.reconstruct.goniometer.doubts import doubts_of, much_lost
from photogonio.reconstruct.goniometer.foreign import read_foreign
from photogonio.reconstruct.goniometer.repeats import channels_of, pair_numbers, refuse_mixed, refuse_repeated
from photogonio.reconstruct.goniometer.spoilt import SpoiltRows, find_spoilt, without
from photogonio.reconstruct.goniometer.text import TextTable, passed_over, read_text
from photogonio.reconstruct.goniometer.told import UNTOLD, Told
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples

NO_ANGLE, FEW = 0.3, 7  # of the rows, and how many, of which angles are missing or beyond any
LARGEST, LEAST = 1e30, 1e-30  # 1/sr: what the middle value of a table may be
MOST_TURN = 4.0 * math.pi + 0.1  # of an azimuth: beyond, a mark of a missing one
SURE = 1e-9  # standard errors, of the middle value: below it refused
UNSURE = 1e3  # of a row's value and of the middle one: above it no measurement
MOST_ERROR = (
    10.0  # middle standard error, of the middle value: honest values scatter by it, so are hardly less
)


def read_samples(
    path: Path,
    told: Told = UNTOLD,
    *,
    columns: Mapping[str, str] | None = None,
    where: Sequence[tuple[str, str]] = (),
) -> GoniometerSamples:
    """Read a table of measurements: a header line, then angles and one column a channel; or MERL's binary, pab-opto's
    files (one, or a folder of them), the reflection of Radiance's BSDF XML.

    ``columns`` and ``where`` stand for those of ``told``. Rows without a number, below the surface, and such as
    cannot be measurements are left out, and told.

    Raises:
        InputError: the file cannot be read, a column is missing, a cell is no number, what the numbers are is not
            told and cannot be taken for granted, or no row is left.
    """
    if columns or where:
        told = replace(told, columns=columns or {}, where=where)
    foreign = read_foreign(path)
    if foreign is None:
        return read_columns(read_text(path), told)
    if told != UNTOLD:
        raise InputError(
            path, "says itself what it holds; --columns, --where, --quantity and the like are for text tables"
        )
    foreign = believed(_of_known_errors(path, foreign))
    return replace(foreign, diagnoses=foreign.diagnoses + doubts_of(foreign, "brdf", side_told=True))


def read_columns(table: TextTable, told: Told) -> GoniometerSamples:
    """GoniometerSamples of a table whose cells have been read."""
    matched = match_columns(table, told)
    table = _select(table, told.where)
    value = np.column_stack([table.number(name) for name in matched.values])
    angles = directions(table, matched.angles, value[:, 0], told)
    sigma = None
    if matched.sigmas:
        sigma = np.column_stack([table.number(name) for name in matched.sigmas])
        sigma = np.broadcast_to(sigma, value.shape)
    notes = (unused_note(matched), _elevated(matched), passed_over(table.passed), _on_trust(told))
    samples = GoniometerSamples(
        *angles,
        value=value,
        sigma=sigma,
        channels=channel_names(matched.values),
        notes=tuple(filter(None, notes)),
        line=table.line[:, None],
    )
    samples = _side_by_side(table, samples, matched, told)
    samples = _of_known_errors(table.path, _measured(table.path, samples))
    pair = pair_numbers((samples.theta_i, samples.phi_i, samples.theta_r, samples.phi_r))
    refuse_repeated(table.path, pair, samples.value.mean(1))
    samples = believed(samples)
    samples = _in_units(table.path, samples, told.values_are)
    doubts = doubts_of(
        samples,
        told.values_are,
        side_told=told.azimuth is not None,
        quantity_told=told.quantity is not None,
    )
    return replace(samples, diagnoses=(*samples.diagnoses, *_said_otherwise(table, matched, told), *doubts))


def _on_trust(told: Told) -> str:
    """What is said of what no table tells."""
    taken = "f in 1/sr" if told.values_are == "brdf" else told.values_are
    return (
        f"values are taken on trust as {taken}: a wrong factor, or a constant added to all, shows only where an albedo "
        "comes out above 1"
    )


def _elevated(matched: Matched) -> str | None:
    """What is said of polar angles that count from the surface."""
    named = [header for header in matched.angles.values() if is_elevation(header)]
    return f"elevations above the surface, taken from 90 degrees: {', '.join(named)}" if named else None


def _said_otherwise(table: TextTable, matched: Matched, told: Told) -> tuple[Diagnosis, ...]:
    """Whether a header says that the values are another quantity than they are taken for."""
    units = [unit_below(table, name) for name in matched.values]
    said = quantity_said(table.path, matched.values, units)
    if said is None or told.quantity is not None:
        return ()
    header, quantity = said
    message = (
        f"column {header!r} seems to hold another quantity than f, as which it is read: say --quantity {quantity}, or "
        "brdf if it is f"
    )
    return (Diagnosis("table-quantity", message),)


def _side_by_side(
    table: TextTable, samples: GoniometerSamples, matched: Matched, told: Told
) -> GoniometerSamples:
    """With the values of one column as channels, where that is asked for; refused where it had to be."""
    if told.channel_by is None and not matched.unused:
        return samples
    pair = pair_numbers((samples.theta_i, samples.phi_i, samples.theta_r, samples.phi_r))
    if told.channel_by is None:
        refuse_mixed(table, matched.unused, pair, samples.value.mean(1))
        return samples
    first, rows, names = channels_of(table, told.channel_by, pair, samples.value, samples.channels)
    taken = take(samples, first)
    wide = (len(rows), -1)
    return replace(
        taken,
        value=samples.value[rows].reshape(wide),
        sigma=None if samples.sigma is None else samples.sigma[rows].reshape(wide),
        channels=names,
        line=np.repeat(samples.lines[rows, 0], samples.value.shape[1], axis=1),
        diagnoses=_unpaired(rows.size, samples, told.channel_by),
    )


def _unpaired(used: int, samples: GoniometerSamples, header: str) -> tuple[Diagnosis, ...]:
    lost = int(np.isfinite(samples.value).all(1).sum()) - used
    message = f"{lost} rows left out: their directions were not measured at each {header} as often"
    return (Diagnosis("rows-left-out", message, amount=lost),) if lost else ()


def _measured(path: Path, samples: GoniometerSamples) -> GoniometerSamples:
    """The rows that have numbers, and directions above the surface."""
    parts = [samples.theta_i, samples.phi_i, samples.theta_r, samples.phi_r, *samples.value.T]
    parts += [] if samples.sigma is None else [*samples.sigma.T]
    keep = np.all(np.isfinite(parts), axis=0)
    keep &= (samples.theta_i <= math.pi / 2) & (samples.theta_r <= math.pi / 2)
    keep &= (np.abs(samples.phi_i) <= MOST_TURN) & (np.abs(samples.phi_r) <= MOST_TURN)
    _refuse_angles(path, samples)
    if not keep.any():
        raise InputError(path, "no row has a value and both directions above the surface")
    why = "without a number, with a direction below the surface, or an azimuth of more than two turns"
    return _left(samples, keep, why)


def _refuse_angles(path: Path, samples: GoniometerSamples) -> None:
    """Raises InputError where angles of many rows that have a value are none: in another unit, or written once for
    several rows."""
    said = np.isfinite(samples.value).all(1)
    angles = np.array([samples.theta_i, samples.phi_i, samples.theta_r, samples.phi_r])[:, said]
    none = ~np.isfinite(angles).all(0)
    far = (np.abs(angles[::2]) > math.pi + 0.1).any(0) | (np.abs(angles[1::2]) > MOST_TURN).any(0)
    for wrong, why in (
        (none, "no angle; where one stands for the rows below it too, fill these"),
        (
            far,
            "a polar angle above 180 or an azimuth beyond 720 degrees: in another unit? --angles says which",
        ),
    ):
        if wrong.sum() > max(NO_ANGLE * said.sum(), FEW):
            raise InputError(path, f"{wrong.sum()} of {said.sum()} rows with a value have {why}")


def _in_units(path: Path, samples: GoniometerSamples, quantity: str) -> GoniometerSamples:
    """In 1/sr; without the rows at grazing where a cosine leaves nothing."""
    factor = per_brdf(quantity, samples.theta_i, samples.theta_r)[:, None]
    if np.isnan(factor).all():
        raise InputError(
            path, f"no row says anything of f: all are {quantity} within half a degree of the horizon"
        )
    sigma = None if samples.sigma is None else samples.sigma / factor
    samples = replace(samples, value=samples.value / factor, sigma=sigma)
    return _left(
        samples, np.isfinite(factor[:, 0]), f"within half a degree of the horizon, where {quantity} is 0"
    )


def _of_known_errors(path: Path, samples: GoniometerSamples) -> GoniometerSamples:
    """Raises InputError for values that are no BRDF whatever the unit, and for standard errors that cannot be."""
    middle = float(np.median(np.abs(samples.value[samples.value != 0.0]))) if samples.value.any() else 1.0
    if not LEAST < middle < LARGEST:
        raise InputError(path, f"values are about {middle:.3g}: no BRDF, nor a multiple of one")
    if samples.sigma is None:
        return samples
    if (samples.sigma <= 0).any():
        raise InputError(path, "standard errors (sigma) must be above zero")
    typical = float(np.median(samples.sigma))
    if typical > MOST_ERROR * middle:
        raise InputError(
            path,
            f"standard errors (sigma) are about {typical:.3g}, of values of about {middle:.3g}, which would scatter "
            "by as much: in another unit? --columns sigma=HEADER says which they are, sigma=none that no column is",
        )
    small = samples.sigma.min(1) < SURE * middle
    if small.any():
        row = int(np.argmax(small))
        raise InputError(
            f"{path}: line {samples.lines[row, 0]}",
            f"a standard error of {samples.sigma[row].min():.3g}, of values of {middle:.3g}, cannot be",
        )
    keep = (samples.sigma <= UNSURE * np.maximum(np.abs(samples.value), middle)).all(1)
    return _left(samples, keep, f"of a standard error (sigma) more than {UNSURE:g} times the values'")


def believed(samples: GoniometerSamples) -> GoniometerSamples:
    """Without the rows that hold a number and are no measurements, which are told."""
    spoilt = find_spoilt(samples)
    if not spoilt:
        return samples
    keep = without(samples, spoilt)
    said = tuple(Diagnosis("rows-left-out", _said(samples, one), amount=len(one.rows)) for one in spoilt)
    out, rest = samples.left_out + int((~keep).sum()), take(samples, keep)
    return replace(rest, diagnoses=samples.diagnoses + said + much_lost(samples, rest), left_out=out)


def _said(samples: GoniometerSamples, one: SpoiltRows) -> str:
    """What is told of rows that are left out."""
    count = len(one.rows)
    text = f"{count} row{'s' if count > 1 else ''} left out"
    if len(samples.channels) > 1:
        text += f" for {samples.channels[one.channel]}"
    text += f": {one.mark:.10g} where the rows around them say about {one.instead:.3g}"
    if one.lamp is not None:
        text += f", within {math.degrees(one.lamp):.0f} degrees of the lamp's direction: the detector hid the lamp"
    elif one.mark:
        text += f": {one.why}"
    if samples.line is None:
        return text
    line = samples.line[one.rows, min(one.channel, samples.line.shape[1] - 1)]
    return f"{text} ({lines_of(line)})"


def take(samples: GoniometerSamples, keep: np.ndarray) -> GoniometerSamples:
    """The rows that a mask or an index array names."""
    names = ("theta_i", "phi_i", "theta_r", "phi_r", "value", "sigma", "line")
    given = {name: row[keep] for name in names if (row := getattr(samples, name)) is not None}
    return replace(samples, **given)


def _left(samples: GoniometerSamples, keep: np.ndarray, why: str) -> GoniometerSamples:
    """The rows of a mask, and what is told of the others."""
    if keep.all():
        return samples
    count = int((~keep).sum())
    lines = "" if samples.line is None else f" ({lines_of(samples.line[~keep, 0])})"
    message = f"{count} row{'s' if count > 1 else ''} left out, {why}{lines}"
    said = Diagnosis("rows-left-out", message, amount=count)
    rest = take(samples, keep)
    return replace(rest, diagnoses=(*samples.diagnoses, said), left_out=samples.left_out + count)


def lines_of(line: np.ndarray, most: int = 12) -> str:
    """Line numbers in words, neighbouring ones joined."""
    line = np.unique(line)
    starts = np.flatnonzero(np.diff(line, prepend=line[0] - 2) > 1)
    ends = np.r_[starts[1:] - 1, len(line) - 1]
    runs = [(int(line[a]), int(line[b])) for a, b in zip(starts, ends, strict=True)]
    words = [f"{a}" if a == b else f"{a} to {b}" for a, b in runs[:most]]
    more = sum(b - a + 1 for a, b in runs[most:])
    return f"line{'s' if len(line) > 1 else ''} " + ", ".join(words) + (f" and {more} more" if more else "")


def _select(table: TextTable, where: Sequence[tuple[str, str]]) -> TextTable:
    for name, text in where:
        words, label = table.labels(name)
        wanted = [k for k, word in enumerate(words) if _same(word, text)]
        keep = np.isin(label, wanted)
        if not keep.any():
            listed = ", ".join(words[:8]) + (", ..." if len(words) > 8 else "")
            raise InputError(table.path, f"no row has {name} = {text}; found {listed}")
        table = table.take(keep)
    return table


def _same(cell: str, text: str) -> bool:
    try:
        return math.isclose(float(cell), float(text), rel_tol=1e-9)
    except ValueError:
        return cell == text
