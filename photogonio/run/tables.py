"""Tables to fit: read from CSV or from what ``process`` left, and cut to the channels asked for."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.options import Options
from photogonio.reconstruct.brdf.brdf import load_brdf
from photogonio.reconstruct.goniometer.told import Told
from photogonio.reconstruct.table.facet_table import LEFT_OUT, FacetTable
from photogonio.reconstruct.table.goniometer_csv import UNBINNED, samples_table
from photogonio.reconstruct.table.table_file import PHOTOS, load_with
from photogonio.system.progress import Reporter

if TYPE_CHECKING:
    from photogonio.run.circumstances import Circumstances

DEVELOPED = {"brdf-cos": "brdf_cos", "brdf-cos-incident": "brdf_cos", "brdf-cos-cos": "brdf_cos_cos"}


@dataclass(frozen=True, slots=True)
class TableRead:
    """A table to fit."""

    table: FacetTable
    scale: str  # "absolute" | "relative"
    known: Circumstances | None = None  # of photos


def read_table(path: Path, options: Options, told: Told, reporter: Reporter) -> TableRead:
    """The table to fit, and its scale. Says how it was read, and warns of what was left out.

    Raises:
        InputError: the file cannot be used, or not as ``told``.
    """
    if path.suffix == ".npz":
        if replace(told, quantity=None) != Told():
            raise InputError(path, "is a facet table; --columns, --where and the like are for CSV")
        table, beside = load_with(path)
        _refuse_level(options, table.level)
        known = _known_of(beside, table, path)
        return TableRead(table, _scale_of(path, beside) if known is None else known.setup.scale, known)
    _refuse_level(options, UNBINNED)
    # readers of other programs' files, of which photos need none
    from photogonio.reconstruct.goniometer.foreign import of_coefficients
    from photogonio.reconstruct.goniometer.merged import merged
    from photogonio.reconstruct.goniometer.read import read_samples

    samples = merged(read_samples(path, told))
    table = samples_table(samples)
    take_channels(table, options)  # what is asked for in vain is refused before anything is said
    for note in samples.notes:
        reporter.say(f"{path.name}: {note}")
    reporter.tell(*(replace(one, message=f"{path.name}: {one.message}") for one in samples.diagnoses))
    scale = load_brdf(path).scale if of_coefficients(path) else "absolute"
    return TableRead(table, scale)


def quantity_developed(path: Path, options: Options, told: Told) -> str:
    """What is developed in modes: f, or q, as ``told``, where that is asked for with nothing but least squares.

    Raises:
        InputError: a quantity is told of a facet table, which holds f, and not to be developed.
    """
    plain = options.prior == "none" and not options.robust
    if plain and told.values_are in DEVELOPED:
        return DEVELOPED[told.values_are]
    if path.suffix == ".npz" and told.values_are != "brdf":
        raise InputError(
            f"--quantity {told.quantity}",
            f"{path} is a facet table, which holds f; with --prior none --robust off, {', '.join(DEVELOPED)} "
            "say what is developed in modes",
        )
    return "brdf"


def _known_of(beside: Mapping[str, np.ndarray], table: FacetTable, path: Path) -> Circumstances | None:
    """Of a table of photos; None of others, which need nothing that photos do."""
    if PHOTOS not in beside:
        return None
    from photogonio.run.circumstances import unpacked

    return unpacked(beside, table, path)


def _scale_of(path: Path, beside: Mapping[str, np.ndarray]) -> str:
    """What a table without circumstances says of itself."""
    if "source" not in beside:
        return "absolute"
    try:
        source = json.loads(str(beside["source"])) if str(beside["source"]) else {}
        scale = source.get("scale", "absolute")
    except (ValueError, AttributeError, RecursionError):
        scale = None
    if scale not in ("absolute", "relative"):
        raise InputError(f"{path}: source", "expected a table's source, with its scale")
    return scale


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


def refuse_channels(asked: Sequence[str], there: Sequence[str]) -> None:
    """Raises InputError for one that is ``asked`` for and not ``there``."""
    unknown = [name for name in asked if name not in there]
    if unknown:
        raise InputError(f"--channels {unknown[0]}", f"expected some of {', '.join(there)}")


def take_channels(table: FacetTable, options: Options) -> FacetTable:
    """Only the channels asked for, in the table's order."""
    if options.channels is None:
        return table
    refuse_channels(options.channels, table.channels)
    keep = [k for k, name in enumerate(table.channels) if name in options.channels]
    return replace(
        table,
        channels=tuple(table.channels[k] for k in keep),
        value=table.value[:, keep],
        value2=table.value2[:, keep],
        variance=table.variance[:, keep],
    )
