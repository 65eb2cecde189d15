"""The main job and its stages: photo set -> setup -> facet table -> fit -> files."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from photogonio.cache.running import job_in
from photogonio.cache.scratch import Scratch
from photogonio.cache.store import default_folder
from photogonio.calib.remarks import LeftOut
from photogonio.calib.setup import Setup
from photogonio.calib.setup_file import save_setup
from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.errors import InputError
from photogonio.capture.linear.reader import RadianceReader
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.photoset import MANIFEST, PhotoSet
from photogonio.options import Options, asked_symmetry, choose_level
from photogonio.reconstruct.fit import FitResult
from photogonio.reconstruct.goniometer.told import Told
from photogonio.reconstruct.lighting.lamp_directions import relit, turned_lights
from photogonio.reconstruct.reduce.directions import ReduceOptions
from photogonio.reconstruct.reduce.fused import compiled_before
from photogonio.reconstruct.table.facet_table import FacetTable
from photogonio.reconstruct.table.table_file import save_table
from photogonio.report import page
from photogonio.report.marked_photos import pictures_folder, save_pictures
from photogonio.report.summary import (
    clipped,
    contradicted_photos,
    doubts,
    fit_choices,
    physics_warnings,
    relit_warning,
    rescaled_photos,
    spoilt_warnings,
)
from photogonio.report.trust import DISTRUSTED, faults_of
from photogonio.result import Result
from photogonio.run.calibrate_photos import calibrated
from photogonio.run.circumstances import Circumstances, packed
from photogonio.run.cluster import cluster_of
from photogonio.run.colours import in_colours, require_mixable
from photogonio.run.fit_photos import fitted, fitted_photos
from photogonio.run.reduce_photos import Plan, Reduced, reduce_photos
from photogonio.run.surroundings import LightAround, around_of, shown_around
from photogonio.run.tables import quantity_developed, read_table, refuse_empty, take_channels
from photogonio.system.outputs import check_place, staged_file, staged_folder
from photogonio.system.progress import Reporter, Stopwatch
from photogonio.system.provenance import Provenance, canonical_command, hash_file, hash_inputs, hash_photos


def process(
    folder: str | Path,
    out: str | Path | None = None,
    options: Options | None = None,
    reporter: Reporter | None = None,
) -> Result:
    """Photo set to coefficients, ``result.brdf``; with ``out``, also to files there (docs/cli.md).

    Raises:
        InputError: the set cannot be used, or what was asked cannot be done. Nothing is written then.
    """
    options, reporter = options or Options(), reporter or Reporter(quiet=True)
    if out is not None:
        check_place(Path(out), folder=True)
    photoset = load_photoset(folder)
    symmetry = asked_symmetry(photoset, options)
    watch = Stopwatch()
    with Scratch() as scratch, cluster_of(options.executor) as cluster, job_in(default_folder()):
        setup, radiance, kept, correction = calibrated(photoset, reporter, options.threads(), scratch)
        space = photoset.radiometry.colour
        require_mixable(photoset, setup.scale, options.channels)
        watch.lap("calibrate")
        level = choose_level(setup, options)
        reporter.say(f"{level.what} {level.value}: {level.reason}")
        around = ReduceOptions(
            isotropic=symmetry == "isotropic",
            mirror_balls=photoset.mirror_balls,
            white_patches=photoset.white_patches,
        )
        for last in (False, True):
            plan = Plan(int(level.value), around, options.threads(), kept.store, kept.hashes, None, cluster)
            reduced = _reduced(radiance, setup, plan, reporter)
            refuse_empty(reduced.table)
            watch.lap("reduce")
            shown, table = shown_around(photoset, setup, reduced.table, reduced.around)
            table = take_channels(table, options)
            known = Circumstances(
                name=photoset.name,
                setup=setup,
                shown=shown,
                symmetry=asked_symmetry(photoset, Options()),
                level=level,
                left_out=reduced.left_out,
                space="camera" if correction is None else space,
                matrix=None if correction is None else correction.matrix,
            )
            fit, beside = fitted_photos(table, known, options, reporter)
            watch.lap("fit")
            turned = () if last else turned_lights(fit.cells, fit.model, setup)
            if not turned:
                break
            setup = relit(setup, turned, photoset.white_patches)
            reporter.tell(relit_warning(turned))
    provenance = _provenance("process", photoset, options, reduced.hashes)
    known = replace(known, diagnoses=tuple(reporter.diagnoses))
    result = replace(_of_photos(known, table, fit, beside, provenance, reporter), seconds=watch.seconds)
    if out is not None:
        write_result(result, Path(out))
        watch.lap("write")
    return result


def calibrate(
    folder: str | Path,
    out: str | Path | None = None,
    reporter: Reporter | None = None,
    *,
    workers: int | None = None,
) -> Setup:
    """Camera, poses, lights and irradiance scale of a photo set.

    With ``out``, also to that file, with a picture of every photo in a folder beside it.

    Raises:
        InputError: the set cannot be used.
    """
    if out is not None:
        check_place(Path(out), folder=False)
        check_place(pictures_folder(Path(out)), folder=True)
    photoset = load_photoset(folder)
    threads = Options(workers=workers).threads()
    reporter = reporter or Reporter(quiet=True)
    with Scratch() as scratch:
        setup, radiance, kept, _ = calibrated(photoset, reporter, threads, scratch, drawn=out is not None)
        setup = replace(setup, source=_provenance("calibrate", photoset, Options(), kept.hashes).to_dict())
        if out is not None:
            with staged_folder(pictures_folder(Path(out))) as stage:
                save_pictures(radiance, setup, stage, reporter)
            with staged_file(Path(out)) as stage:
                save_setup(setup, stage)
    return setup


def fit(
    table: str | Path,
    out: str | Path | None = None,
    options: Options | None = None,
    *,
    told: Told | None = None,
    reporter: Reporter | None = None,
) -> Result:
    """Coefficients of tabulated measurements, read as ``told``, or of a facet table (.npz) that ``process`` left: of
    that the same ones, with the same options.

    Raises:
        InputError: the table cannot be used, or what was asked cannot be done. Nothing is written then.
    """
    options, reporter = options or Options(), reporter or Reporter(quiet=True)
    if out is not None:
        check_place(Path(out), folder=True)
    path = Path(table)
    told = told or Told()
    options = replace(options, quantity=quantity_developed(path, options, told))
    read = read_table(path, options, told, reporter)
    cells = take_channels(read.table, options)
    wanted = told.to_dict() | options.to_dict()
    provenance = Provenance(canonical_command("fit", path.name, wanted), hash_inputs(path))
    if read.known is not None:
        result = fit_again(read.known, cells, options, provenance, reporter)
    else:
        found = fitted(cells, options, options.symmetry, read.scale, reporter)
        _announce(found, cells, reporter)
        result = Result(
            name=path.stem,
            setup=None,
            table=cells,
            fit=found,
            choices=fit_choices(found),
            left_out=(),
            diagnoses=tuple(reporter.diagnoses),
            provenance=provenance,
        )
        result = replace(result, faults=faults_of(result))
    if out is not None:
        write_result(result, Path(out), with_setup=False)
    return result


def fit_again(
    known: Circumstances, table: FacetTable, options: Options, provenance: Provenance, reporter: Reporter
) -> Result:
    """The result of photos that were calibrated and reduced before.

    Raises:
        InputError: what was asked cannot be done.
    """
    if known.space != "camera" and options.channels:
        raise InputError("--channels", "all are needed, since the colours are mixed of them")
    reporter.tell(*known.diagnoses)
    found, beside = fitted_photos(table, known, options, reporter)
    return _of_photos(known, table, found, beside, provenance, reporter)


def _of_photos(
    known: Circumstances,
    table: FacetTable,
    found: FitResult,
    beside: LightAround,
    provenance: Provenance,
    reporter: Reporter,
) -> Result:
    """What a fit of photos gives back, and told to the user."""
    left_out = (*known.left_out, *contradicted_photos(found))
    _announce_photos(found, table, left_out, beside, reporter)
    coloured = None
    if known.space != "camera" and known.matrix is not None:
        coloured = in_colours(found.brdf, known.matrix, known.space)
    result = Result(
        name=known.name,
        setup=replace(known.setup, source=provenance.to_dict()),
        table=table,
        fit=found,
        choices=(known.level, *fit_choices(found)),
        left_out=(*known.setup.left_out, *left_out),
        diagnoses=tuple(reporter.diagnoses),
        provenance=provenance,
        beside=beside,
        coloured=coloured,
        known=known,
    )
    return replace(result, faults=faults_of(result))


def write_result(result: Result, out: Path, *, with_setup: bool = True) -> None:
    """Coefficients, setup, table, report and pictures, all or none of them."""
    source = {"name": result.name} | result.provenance.to_dict()
    told = json.dumps(source | {"scale": result.brdf.scale})
    with staged_folder(out) as stage, ThreadPoolExecutor(1) as pool:
        saved = pool.submit(  # while pictures are drawn
            save_table,
            result.table,
            stage / "table.npz",
            source=told,
            beside=None if result.known is None else packed(result.known),
        )
        distrust = {DISTRUSTED: [one.code for one in result.faults]} if result.faults else {}
        brdf = replace(result.brdf, source=result.brdf.source | source, fit=result.brdf.fit | distrust)
        brdf.save(stage / "coefficients.json")
        if result.setup is not None and with_setup:
            save_setup(result.setup, stage / "setup.json")
        pictures = page.draw_pictures(result, source=result.provenance.to_text())
        for picture in pictures:
            (stage / f"{picture.name}.png").write_bytes(picture.png)
        (stage / "report.html").write_text(page.report_html(result, pictures), encoding="utf-8")
        saved.result()


def _reduced(radiance: RadianceReader, setup: Setup, plan: Plan, reporter: Reporter) -> Reduced:
    if not compiled_before():
        reporter.say("compiling what photos are reduced with, this first time: some seconds")
    plan = replace(plan, around=around_of(radiance.photoset, setup))
    reduced = reduce_photos(
        radiance, setup, plan, lambda done, total: reporter.progress("reducing photos", done, total)
    )
    if plan.store is not None and plan.store.damaged:
        reporter.say(
            f"{len(plan.store.damaged)} damaged files of the cache were thrown away, and are made anew"
        )
        plan.store.damaged.clear()
    if reduced.at_hand:
        reporter.say(f"{reduced.at_hand} of {len(setup.views)} photos were reduced before, and are not again")
    return reduced


def _announce_photos(
    fit: FitResult,
    table: FacetTable,
    left_out: Sequence[LeftOut],
    beside: LightAround,
    reporter: Reporter,
) -> None:
    for photo in left_out:
        message = f"{photo.name}: left out, {photo.reason}"
        reporter.tell(Diagnosis("photo-left-out", message, views=(photo.name,)))
    reporter.tell(*spoilt_warnings(beside))
    _announce(fit, table, reporter)


def _announce(found: FitResult, table: FacetTable, reporter: Reporter) -> None:
    """What a fit chose, and what it had to put right."""
    reporter.tell(*rescaled_photos(found), *physics_warnings(found), *clipped(table), *doubts(found))
    for choice in fit_choices(found):
        reporter.say(f"{choice.what} {choice.value}: {choice.reason}")


def _provenance(
    command: str, photoset: PhotoSet, options: Options, hashes: Mapping[str, str] | None = None
) -> Provenance:
    files = [photo.file for photo in photoset.photos]
    inputs = {
        MANIFEST: hash_file(photoset.folder / MANIFEST),
        f"{len(set(files))} photos": hash_photos(
            photoset.folder, files, workers=options.threads(), known=hashes or {}
        ),
    }
    name = photoset.folder.resolve().name
    return Provenance(canonical_command(command, name, options.to_dict()), inputs)
