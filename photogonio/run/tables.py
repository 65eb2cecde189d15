"""Tables to fit: read from CSV or from what ``process`` left, and cut to the channels asked for."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.options import Options
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.goniometer.told import Told
from photogonio.reconstruct.table.facet_table import LEFT_OUT, FacetTable, load_table
from photogonio.reconstruct.table.goniometer_csv import UNBINNED, samples_table
from photogonio.system.progress import Reporter


def read_table(path: Path, options: Options, told: Told, reporter: Reporter) -> tuple[FacetTable, str]:
    """The table to fit, and its scale. Says how it was read, and warns of what was left out.

    Raises:
        InputError: the file cannot be used, or not as ``told``.
    """
    if path.suffix == ".npz":
        if told != Told():
            raise InputError(
                path, "is a facet table; --columns, --where, --quantity and the like are for CSV"
            )
        table = load_table(path)
        _refuse_level(options, table.level)
        return table, _source_of(path).get("scale", "absolute")
    _refuse_level(options, UNBINNED)
    samples = read_samples(path, told)
    for note in samples.notes:
        reporter.say(f"{path.name}: {note}")
    for warning in samples.warnings:
        reporter.warn(f"{path.name}: {warning}")
    return samples_table(samples), "absolute"


def _source_of(path: Path) -> dict[str, str]:
    """What a facet table says of itself."""
    with np.load(path, allow_pickle=False) as file:
        return json.loads(str(file["source"])) if "source" in file.files else {}


def _refuse_level(options: Options, level: int) -> None:
    if options.level is not None and options.level != level:
        found = (
            "tabulated measurements are not binned" if level == UNBINNED else f"the table's level is {level}"
        )
        raise InputError(f"--level {options.level}", found)


WHY_UNUSED = {  # reasons of photogonio.reconstruct.table.facet_table, to somebody who took the photos
    "outline": "too near to its outline",
    "covered": "behind a mirror ball or a white patch",
    "unlit": "turned away from the lamp",
    "grazing": "lit or seen at more than 85 degrees from the normal",
    "shadowed": "in the shadow of a mirror ball",
    "saturated": "saturated",
    "invalid": "damaged or beside saturated ones",
    "stray": "spoilt by light of the surroundings",
}


def refuse_empty(table: FacetTable) -> None:
    """Raises InputError for a table that not one pixel went into, with what most of them suffer from."""
    if len(table):
        return
    counts = table.left_out.sum(0)
    if not counts.sum():
        raise InputError("sample", "no pixel shows it in any photo")
    worst = int(np.argmax(counts))
    share = 100.0 * counts[worst] / counts.sum()
    raise InputError("sample", f"no pixel can be used: {share:.0f} % are {WHY_UNUSED[LEFT_OUT[worst]]}")


def take_channels(table: FacetTable, options: Options) -> FacetTable:
    """Only the channels asked for, in the table's order."""
    if options.channels is None:
        return table
    unknown = [name for name in options.channels if name not in table.channels]
    if unknown:
        raise InputError(f"--channels {unknown[0]}", f"expected some of {', '.join(table.channels)}")
    keep = [k for k, name in enumerate(table.channels) if name in options.channels]
    return replace(
        table,
        channels=tuple(table.channels[k] for k in keep),
        value=table.value[:, keep],
        value2=table.value2[:, keep],
        variance=table.variance[:, keep],
    )
