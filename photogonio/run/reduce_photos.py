"""Photos to facet tables, several at a time: while one is reduced, others are read and decoded.

Each worker takes one photo from its file to its table, so that memory holds one frame a worker and the tables,
however many photos there are. Decoders, numpy and the compiled kernel all release the interpreter. Tables are
added in the order of the views, whichever is done first, so that any number of workers gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from photogonio.cache.kept import code_key, key_of
from photogonio.cache.store import Store
from photogonio.calib.remarks import LeftOut
from photogonio.calib.setup import Setup, ViewSetup
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import Image
from photogonio.capture.linear.reader import RadianceReader
from photogonio.capture.radiance import RadianceImage, exposure_fault
from photogonio.reconstruct.reduce.directions import ReduceOptions, region_of
from photogonio.reconstruct.reduce.reduce import reduce_view
from photogonio.reconstruct.table.facet_table import FacetTable, add_tables
from photogonio.run.surroundings import PhotoAround
from photogonio.system.provenance import hash_file

BORDER = 24  # pixels around the sample that are read too: finding spots and spills takes neighbours
SPARSE = 4  # every so many pixels tell whether a photo is black or full


@dataclass(frozen=True, slots=True)
class Reduced:
    """The table of all views that could be used, those that could not, and how many were at hand."""

    table: FacetTable
    left_out: tuple[LeftOut, ...]
    at_hand: int
    hashes: Mapping[str, str]  # SHA-256 of the photos' files, by file; none where no store asked for them
    around: tuple[np.ndarray | None, ...]  # radiance around the sample in each of the table's groups


@dataclass(frozen=True, slots=True)
class Plan:
    """How a set's photos are reduced."""

    level: int  # of the facets
    options: ReduceOptions
    workers: int = 1
    store: Store | None = None  # where finished photos are kept, and taken from
    hashes: Mapping[str, str] = field(default_factory=dict)  # of files, that are known
    around: PhotoAround | None = None  # reads on the way what a photo shows around the sample


def reduce_photos(
    reader: RadianceReader,
    setup: Setup,
    plan: Plan,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Reduced:
    """Reduce every view of a setup.

    Raises:
        InputError: no view can be used.
    """
    with nullcontext(plan.store.folder) if plan.store else TemporaryDirectory() as folder:
        job = _Job(reader, setup, plan, plan.store or Store(Path(folder)))
        results = _run_all(job, plan.workers, progress)
        done = [result for result in results if isinstance(result, _Done)]
        failed = tuple(result for result in results if isinstance(result, LeftOut))
        if not done:
            where = failed[0].name if failed else reader.photoset.folder
            why = failed[0].reason if failed else "none is left"
            raise InputError(where, f"no sample photo can be used: {why}")
        table = add_tables([job.table(one) for one in done])
    if plan.store is not None:
        plan.store.prune()
    at_hand = sum(one.at_hand for one in done)
    return Reduced(table, failed, at_hand, job.hashes, tuple(one.around for one in done))


@dataclass(frozen=True, slots=True)
class _Done:
    """A view whose table is in the store, or, where that failed, here."""

    view: ViewSetup
    key: str
    table: FacetTable | None
    around: np.ndarray | None  # (m, c) radiance around the sample, where it was asked for
    at_hand: bool


def _run_all(job: _Job, workers: int, progress: Callable[[int, int], None]) -> list[_Done | LeftOut]:
    """Every view's result, in the order of the views."""
    views = job.setup.views
    pool = ThreadPoolExecutor(max(1, min(workers, len(views))))
    try:
        futures = [pool.submit(job.run, view) for view in views]
        for done, future in enumerate(as_completed(futures), 1):
            _raise_unless_input(future)
            progress(done, len(futures))
    finally:
        pool.shutdown(cancel_futures=True)  # after Ctrl-C: only the photos that are being decoded
    return [_result(view, future) for view, future in zip(views, futures, strict=True)]


def _raise_unless_input(future: Future) -> None:
    error = future.exception()
    if error is not None and not isinstance(error, InputError):
        raise error


def _result(view: ViewSetup, future: Future) -> _Done | LeftOut:
    error = future.exception()
    return LeftOut(view.name, getattr(error, "what", str(error))) if error else future.result()


class _Job:
    """What all views share. Finished tables wait in the store, not in memory, until they are added."""

    def __init__(self, reader: RadianceReader, setup: Setup, plan: Plan, store: Store):
        self.reader, self.setup, self.plan, self.store = reader, setup, plan, store
        self.threads = max(1, plan.workers // max(1, len(setup.views)))
        self.views = {view.name: view for view in reader.photoset.views("sample")}
        self.hashes = dict(plan.hashes)
        # without a store to keep them in, results need no more than a number
        self.shared = None if plan.store is None else _shared_key(reader, setup, plan)

    def run(self, view: ViewSetup) -> _Done:
        """Sees to it that one view's table is in the store. Raises InputError if the view cannot be used."""
        key = key_of(view.name) if self.shared is None else key_of(self.shared, view, self._photo_key(view))
        if self.shared is not None:
            around = self.store.get_array(key)
            if (around is not None or self.plan.around is None) and self.store.get(key) is not None:
                return _Done(view, key, None, None if self.plan.around is None else around, True)
        reader = _remembering(self.reader)
        photo = self.views[view.name]
        around = None if self.plan.around is None else self.plan.around(reader, self.setup, view, photo)
        table = self._reduce(reader, view)
        if around is not None and self.shared is not None:
            self.store.put_array(key, around)
        return _Done(view, key, None if self.store.put(key, table) else table, around, False)

    def table(self, done: _Done) -> FacetTable:
        """The table of a finished view."""
        found = self.store.get(done.key) if done.table is None else done.table
        return (
            self._reduce(self.reader, done.view) if found is None else found
        )  # another run may have cleared the store

    def _reduce(self, reader: RadianceReader, view: ViewSetup) -> FacetTable:
        region = region_of(self.setup, view.pose)
        if region[0] == region[2]:
            raise InputError(view.name, "the sample is outside the picture")
        radiance = reader.read(self.views[view.name], _with_border(region, self.setup.camera.size))
        fault = exposure_fault(_sparse(radiance))
        if fault:
            raise InputError(view.name, fault)
        table = reduce_view(
            self.setup, view, radiance, self.plan.level, self.plan.options, threads=self.threads
        )
        if len(table) == 0:
            raise InputError(view.name, "no pixel of the sample can be used")
        return table

    def _photo_key(self, view: ViewSetup) -> str:
        """Of the bytes of a view's files, and of what the reader knows of them and their light."""
        photos, light = self.views[view.name].photos, self.views[view.name].light
        for photo in photos:
            if photo.file in self.hashes:
                continue
            try:
                self.hashes[photo.file] = hash_file(self.reader.photoset.folder / photo.file)
            except OSError as error:
                raise InputError(photo.file, f"cannot be read: {error.strerror}") from error
        hashes = [self.hashes[photo.file] for photo in photos]
        exposures = [self.reader.exposures.get(photo.file) for photo in photos]
        return key_of(hashes, exposures, light, [photo.turned for photo in photos])


def _remembering(reader: RadianceReader) -> RadianceReader:
    """The same reader, that decodes each photo once and holds it: for one view."""
    held: dict[Path, Image] = {}

    def decode(path: Path, *, demosaic: str) -> Image:
        if path not in held:
            held[path] = reader.decode(path, demosaic=demosaic)
        return held[path]

    return replace(reader, decode=decode)


def _sparse(radiance: RadianceImage) -> RadianceImage:
    """Every SPARSE-th pixel of every SPARSE-th row."""
    names = ("value", "variance", "valid", "saturated")
    return RadianceImage(*(getattr(radiance, name)[::SPARSE, ::SPARSE] for name in names))


def _shared_key(reader: RadianceReader, setup: Setup, plan: Plan) -> str:
    """Of all that bears on any view's table."""
    # exposures and veils, which views hold, bear on single ones; folder, notes and diagnoses on none
    frames = (reader.dark, reader.gain, reader.ambient)
    sensor = (reader.channels, reader.size, reader.sensor, reader.fields, reader.photoset.radiometry)
    place = (setup.camera, setup.sample, setup.channels)
    around = getattr(plan.around, "__name__", None)
    return key_of(code_key(), sensor, frames, place, plan.level, plan.options, around)


def _with_border(region: tuple[int, int, int, int], size: tuple[int, int]) -> tuple[int, int, int, int]:
    x0, y0, x1, y1 = region
    return max(x0 - BORDER, 0), max(y0 - BORDER, 0), min(x1 + BORDER, size[0]), min(y1 + BORDER, size[1])
