"""One photo to its table, by itself: what a worker does, in this process or on another machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from photogonio.calib.setup import Setup, ViewSetup
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import Image
from photogonio.capture.linear.reader import RadianceReader
from photogonio.capture.photoset import View
from photogonio.capture.radiance import RadianceImage, exposure_fault
from photogonio.reconstruct.reduce.directions import ReduceOptions, region_of
from photogonio.reconstruct.reduce.reduce import reduce_view
from photogonio.reconstruct.table.facet_table import FacetTable
from photogonio.run.surroundings import PhotoAround

BORDER = 24  # pixels around the sample that are read too: finding spots and spills takes neighbours
SPARSE = 4  # every so many pixels tell whether a photo is black or full


@dataclass(frozen=True, slots=True)
class Work:
    """What the photos of a set share. It pickles if the reader does."""

    reader: RadianceReader
    setup: Setup
    level: int  # of the facets
    options: ReduceOptions
    around: PhotoAround | None = None  # reads on the way what a photo shows around the sample
    threads: int = 1


@dataclass(frozen=True, slots=True)
class PhotoTable:
    """What one photo gave."""

    table: FacetTable
    around: np.ndarray | None  # radiance around the sample, where it was asked for


def seen_in(work: Work, view: ViewSetup, photo: View, places: Mapping[str, Path] | None = None) -> PhotoTable:
    """The table of one view, whose ``photo`` is decoded once; ``places`` are of files that are not in the set's folder.

    Raises:
        InputError: the view cannot be used.
    """
    reader = _remembering(work.reader, places or {})
    around = None if work.around is None else work.around(reader, work.setup, view, photo)
    return PhotoTable(table_of(replace(work, reader=reader), view, photo), around)


def table_of(work: Work, view: ViewSetup, photo: View) -> FacetTable:
    """The table alone."""
    region = region_of(work.setup, view.pose)
    if region[0] == region[2]:
        raise InputError(view.name, "the sample is outside the picture")
    radiance = work.reader.read(photo, _with_border(region, work.setup.camera.size))
    fault = exposure_fault(_sparse(radiance))
    if fault:
        raise InputError(view.name, fault)
    table = reduce_view(work.setup, view, radiance, work.level, work.options, threads=work.threads)
    if len(table) == 0:
        raise InputError(view.name, "no pixel of the sample can be used")
    return table


def _remembering(reader: RadianceReader, places: Mapping[str, Path]) -> RadianceReader:
    """The same reader, that decodes each photo once and holds it: for one view."""
    held: dict[Path, Image] = {}
    elsewhere = {reader.photoset.folder / name: place for name, place in places.items()}

    def decode(path: Path, *, demosaic: str) -> Image:
        if path not in held:
            held[path] = reader.decode(elsewhere.get(path, path), demosaic=demosaic)
        return held[path]

    return replace(reader, decode=decode)


def _sparse(radiance: RadianceImage) -> RadianceImage:
    """Every SPARSE-th pixel of every SPARSE-th row."""
    names = ("value", "variance", "valid", "saturated")
    return RadianceImage(*(getattr(radiance, name)[::SPARSE, ::SPARSE] for name in names))


def _with_border(region: tuple[int, int, int, int], size: tuple[int, int]) -> tuple[int, int, int, int]:
    x0, y0, x1, y1 = region
    return max(x0 - BORDER, 0), max(y0 - BORDER, 0), min(x1 + BORDER, size[0]), min(y1 + BORDER, size[1])
