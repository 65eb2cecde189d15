"""Photos to facet tables, several at a time: while one is reduced, others are read and decoded.

Each worker takes one photo from its file to its table, so that memory holds one frame a worker and the tables,
however many photos there are. Decoders, numpy and the compiled kernel all release the interpreter, so that workers are
threads here, or whatever a cluster has. Tables are added in the order of the views, whichever is done first, so that
any workers give the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock

import numpy as np

from photogonio.cache.kept import code_key, key_of
from photogonio.cache.store import Store
from photogonio.calib.remarks import LeftOut
from photogonio.calib.setup import Setup, ViewSetup
from photogonio.capture.errors import InputError
from photogonio.capture.linear.reader import RadianceReader
from photogonio.reconstruct.reduce.directions import ReduceOptions
from photogonio.reconstruct.table.facet_table import FacetTable, add_tables
from photogonio.run.cluster import Ask, Cluster, FileMark
from photogonio.run.one_photo import PhotoTable, Work, seen_in, table_of
from photogonio.run.surroundings import PhotoAround
from photogonio.system.provenance import hash_file

HELD = (
    64 << 20
)  # bytes of tables that wait in memory: those of some 500 small photos, nothing beside a frame or two


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
    cluster: Cluster | None = None  # does it instead of workers here


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
        results = _run_all(job, plan, progress)
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
    """A view whose table is here, or in the store."""

    view: ViewSetup
    key: str
    table: FacetTable | None  # None: in the store
    around: np.ndarray | None  # (m, c) radiance around the sample, where it was asked for
    at_hand: bool


def _run_all(job: _Job, plan: Plan, progress: Callable[[int, int], None]) -> list[_Done | LeftOut]:
    """Every view's result, in the order of the views."""
    if plan.cluster is not None:
        return _run_there(job, plan.cluster, progress)
    views = job.setup.views
    pool = ThreadPoolExecutor(max(1, min(plan.workers, len(views))))
    try:
        futures = [pool.submit(job.run, view) for view in views]
        for done, future in enumerate(as_completed(futures), 1):
            _raise_unless_input(future)
            progress(done, len(futures))
    finally:
        pool.shutdown(cancel_futures=True)  # after Ctrl-C: only the photos that are being decoded
    return [_result(view, future) for view, future in zip(views, futures, strict=True)]


def _run_there(job: _Job, cluster: Cluster, progress: Callable[[int, int], None]) -> list[_Done | LeftOut]:
    """Likewise, by a cluster; what is at hand is not asked of it."""
    views, results = job.setup.views, dict[int, _Done | LeftOut]()
    asks, keys = list[Ask](), dict[int, str]()
    for number, view in enumerate(views):
        try:
            key = job.key(view)
            files = job.files_of(view)
        except InputError as error:
            results[number] = LeftOut(view.name, error.what)
            continue
        found = job.at_hand(view, key)
        if found is not None:
            results[number] = found
        else:
            keys[number] = key
            asks.append(Ask(replace(view, marks=None), job.views[view.name], files))
    numbers = list(keys)
    progress(len(results), len(views))
    for k, found_there in cluster.answers(job.work, asks, lambda ask: _here(job, ask)):
        number = numbers[k]
        if isinstance(found_there, LeftOut):
            results[number] = found_there
        else:
            results[number] = job.kept(views[number], keys[number], found_there)
        progress(len(results), len(views))
    return [results[number] for number in range(len(views))]


def _here(job: _Job, ask: Ask) -> PhotoTable | LeftOut:
    try:
        return seen_in(job.work, ask.view, ask.photo)
    except InputError as error:
        return LeftOut(ask.view.name, error.what)


def _raise_unless_input(future: Future) -> None:
    error = future.exception()
    if error is not None and not isinstance(error, InputError):
        raise error


def _result(view: ViewSetup, future: Future) -> _Done | LeftOut:
    error = future.exception()
    return LeftOut(view.name, getattr(error, "what", str(error))) if error else future.result()


class _Job:
    """What all views share. Finished tables wait until they are added, in the store but for the first :data:`HELD`."""

    def __init__(self, reader: RadianceReader, setup: Setup, plan: Plan, store: Store):
        self.setup, self.plan, self.store = setup, plan, store
        threads = max(1, plan.workers // max(1, len(setup.views)))
        self.work = Work(reader, setup, plan.level, plan.options, plan.around, threads)
        self.views = {view.name: view for view in reader.photoset.views("sample")}
        self.hashes = dict(plan.hashes)
        # without a store to keep them in, results need no more than a number
        self.shared = None if plan.store is None else _shared_key(reader, setup, plan)
        self.held, self.lock = 0, Lock()  # bytes of tables in memory

    def run(self, view: ViewSetup) -> _Done:
        """Sees to it that one view's table is in the store. Raises InputError if the view cannot be used."""
        key = self.key(view)
        found = self.at_hand(view, key)
        return found or self.kept(view, key, seen_in(self.work, view, self.views[view.name]))

    def key(self, view: ViewSetup) -> str:
        """What a view's table is kept under. Raises InputError if a file cannot be read."""
        return key_of(view.name) if self.shared is None else key_of(self.shared, view, self._photo_key(view))

    def at_hand(self, view: ViewSetup, key: str) -> _Done | None:
        """A view that an earlier run left in the store."""
        if self.shared is None:
            return None
        around = self.store.get_array(key)
        if around is None and self.plan.around is not None:
            return None
        table = self.store.get(key)
        if table is None:
            return None
        around = None if self.plan.around is None else around
        return _Done(view, key, table if self.holds(table) else None, around, True)

    def kept(self, view: ViewSetup, key: str, seen: PhotoTable) -> _Done:
        """What a view gave, set aside."""
        if seen.around is not None and self.shared is not None:
            self.store.put_array(key, seen.around)
        held = self.holds(seen.table)
        if held and self.shared is None:  # a store for this job alone, which nobody asks
            return _Done(view, key, seen.table, seen.around, False)
        put = self.store.put(key, seen.table)
        return _Done(view, key, None if put and not held else seen.table, seen.around, False)

    def holds(self, table: FacetTable) -> bool:
        """Whether there is room for a table in memory, which then it has."""
        size = table.nbytes
        with self.lock:
            fits = self.held + size <= HELD
            self.held += size if fits else 0
        return fits

    def table(self, done: _Done) -> FacetTable:
        """The table of a finished view."""
        found = self.store.get(done.key) if done.table is None else done.table
        if found is None:  # another run may have cleared the store
            return table_of(self.work, done.view, self.views[done.view.name])
        return found

    def files_of(self, view: ViewSetup) -> dict[str, FileMark]:
        """What a view's files are known by. Raises InputError if one cannot be read."""
        folder, found = self.work.reader.photoset.folder, {}
        for photo in self.views[view.name].photos:
            try:
                found[photo.file] = FileMark.of(folder / photo.file, self.hashes.get(photo.file, ""))
            except OSError as error:
                raise InputError(photo.file, f"cannot be read: {error.strerror}") from error
        return found

    def _photo_key(self, view: ViewSetup) -> str:
        """Of the bytes of a view's files, and of what the reader knows of them and their light."""
        photo = self.views[view.name]
        for one in photo.photos:
            if one.file in self.hashes:
                continue
            try:
                self.hashes[one.file] = hash_file(self.work.reader.photoset.folder / one.file)
            except OSError as error:
                raise InputError(one.file, f"cannot be read: {error.strerror}") from error
        hashes = [self.hashes[one.file] for one in photo.photos]
        exposures = [self.work.reader.exposures.get(one.file) for one in photo.photos]
        return key_of(hashes, exposures, photo.light, [one.turned for one in photo.photos])


def _shared_key(reader: RadianceReader, setup: Setup, plan: Plan) -> str:
    """Of all that bears on any view's table."""
    # exposures and veils, which views hold, bear on single ones; folder, notes and diagnoses on none
    frames = (reader.dark, reader.gain, reader.ambient)
    sensor = (reader.channels, reader.size, reader.sensor, reader.fields, reader.photoset.radiometry)
    place = (setup.camera, setup.sample, setup.channels)
    around = getattr(plan.around, "__name__", None)
    return key_of(code_key(), sensor, frames, place, plan.level, plan.options, around)
