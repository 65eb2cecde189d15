"""The main job and its stages: photo set -> setup -> facet table -> fit -> files."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from photogonio.cache.corners import KeptLooks
from photogonio.cache.kept import KeptSetup
from photogonio.cache.scratch import Scratch
from photogonio.cache.store import default_store
from photogonio.calib.calibrate import calibrate as find_setup
from photogonio.calib.remarks import LeftOut
from photogonio.calib.setup import Setup
from photogonio.calib.setup_file import save_setup
from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import Image
from photogonio.capture.linear.colour_chart import ColourCorrection
from photogonio.capture.linear.frames import falloff_gain
from photogonio.capture.linear.prepare import prepare, vignetting
from photogonio.capture.linear.reader import RadianceReader
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.photoset import MANIFEST, PhotoSet
from photogonio.options import Options, asked_symmetry, choose_level, symmetry_of
from photogonio.reconstruct.fit import FitOptions, FitResult, PhotoErrors, fit_table
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
from photogonio.run.circumstances import Circumstances, lamp_variances, packed, scale_error, view_errors
from photogonio.run.colours import correction_note, find_correction, in_colours, require_mixable
from photogonio.run.reduce_photos import Plan, Reduced, reduce_photos
from photogonio.run.surroundings import LightAround, around_of, light_of, shown_around
from photogonio.run.tables import read_table, refuse_empty, take_channels
from photogonio.system.outputs import check_place, staged_file, staged_folder
from photogonio.system.progress import Reporter, Stopwatch
from photogonio.system.provenance import Provenance, canonical_command, hash_file, hash_inputs, hash_photos

ABREAST = 2  # whole photos that calibration looks at together: the memory they take


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
    with Scratch() as scratch:
        setup, radiance, kept, correction = _calibrated(photoset, reporter, options.threads(), scratch)
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
            plan = Plan(int(level.value), around, options.threads(), kept.store, kept.hashes)
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
            fit, beside = _fitted_photos(table, known, options, reporter)
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
        setup, radiance, kept, _ = _calibrated(photoset, reporter, threads, scratch, drawn=out is not None)
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
    read = read_table(path, options, told, reporter)
    cells = take_channels(read.table, options)
    wanted = told.to_dict() | options.to_dict()
    provenance = Provenance(canonical_command("fit", path.name, wanted), hash_inputs(path))
    if read.known is not None:
        result = _fitted_again(read.known, cells, options, provenance, reporter)
    else:
        found = _fitted(cells, options, options.symmetry, read.scale, reporter)
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


def _fitted_again(
    known: Circumstances, table: FacetTable, options: Options, provenance: Provenance, reporter: Reporter
) -> Result:
    """The result of photos that were calibrated and reduced before."""
    if known.space != "camera" and options.channels:
        raise InputError("--channels", "all are needed, since the colours are mixed of them")
    reporter.tell(*known.diagnoses)
    found, beside = _fitted_photos(table, known, options, reporter)
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


def _calibrated(
    photoset: PhotoSet, reporter: Reporter, workers: int, scratch: Scratch, *, drawn: bool = False
) -> tuple[Setup, RadianceReader, KeptSetup, ColourCorrection | None]:
    """Where everything was, the reader that the sample photos are to be read with, what is kept of the set,
    and the colours of a chart. ``drawn``: a picture of every photo will be made."""
    again = drawn or photoset.radiometry.vignetting == "cos4"
    radiance = prepare(photoset, decode=scratch.keep if again else _keeping(photoset, scratch))
    correction = find_correction(photoset, radiance, reporter.tell)
    kept = KeptSetup.of(photoset, default_store(), workers)
    setup = kept.load()
    if setup is not None:
        reporter.say("calibrated before, with the same photos, and not again")
    else:
        setup = _found(radiance, kept, reporter, workers, scratch)
        if (
            photoset.radiometry.vignetting == "cos4"
        ):  # takes the camera, and changes the white patch's reading
            setup = _found(with_vignetting(radiance, setup), kept, reporter, workers, scratch)
        setup = kept.save(setup)
    radiance = replace(radiance, photoset=photoset.turned_to(setup.turned), decode=scratch.take)
    radiance = without_veil(with_vignetting(radiance, setup), setup)
    for note in radiance.notes:
        reporter.say(note)
    reporter.tell(*radiance.diagnoses, *setup.diagnoses)
    told: dict[str, object] = {"radiometry": list(radiance.notes)}
    if correction is not None:
        told["colour"] = correction_note(correction)
        left = correction.delta_e_left_out.mean()
        reporter.say(
            f"colour chart: Delta E 2000 {correction.delta_e.mean():.2f} in the mean, {left:.2f} left out"
        )
    setup = replace(setup, residuals=setup.residuals | told)
    used, total = len(setup.views), len(photoset.views("sample"))
    reporter.say(f"calibrated {used} of {total} sample views; scale {setup.scale}")
    return setup, radiance, kept, correction


def _keeping(photoset: PhotoSet, scratch: Scratch) -> Callable[..., Image]:
    """What photos are read with: those of the bare board, of which calibration needs one look, are not set aside."""
    once = {photoset.folder / photo.file for photo in photoset.photos if photo.role == "calibration"}
    return lambda path, **asked: (scratch.take if path in once else scratch.keep)(path, **asked)


def with_vignetting(radiance: RadianceReader, setup: Setup) -> RadianceReader:
    """The reader with the gain of cos^4 where the manifest asks for it, which the camera tells, or against what the
    lens was found to darken."""
    if setup.falloff is not None and setup.falloff.allowed:
        return replace(radiance, gain=falloff_gain(setup.camera, setup.falloff.terms))
    if radiance.photoset.radiometry.vignetting != "cos4":
        return radiance
    return replace(radiance, gain=vignetting(radiance, setup.camera))


def without_veil(radiance: RadianceReader, setup: Setup) -> RadianceReader:
    """The reader that takes off what was found to lie over whole photos."""
    return replace(radiance, veil={view.name: view.veil for view in setup.views if view.veil is not None})


def _found(
    radiance: RadianceReader, kept: KeptSetup, reporter: Reporter, workers: int, scratch: Scratch
) -> Setup:
    return find_setup(
        radiance.photoset,
        lambda _, view: radiance.read(view),
        reporter.progress,
        read_part=radiance.read,
        read_level=radiance.read_level,
        workers=min(workers, ABREAST),
        keep=scratch.put,
        looks=None if kept.store is None else KeptLooks(kept.store, radiance, kept.hashes),
    )


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


def _fitted_photos(
    table: FacetTable, known: Circumstances, options: Options, reporter: Reporter
) -> tuple[FitResult, LightAround]:
    """The fit of photos' cells, with what calibration is not sure of; and what shone on the sample beside the lamp."""
    setup, beside = known.setup, light_of(known.shown, known.setup, table)
    found = _fitted(
        table,
        options,
        symmetry_of(options, known.symmetry, setup.sample),
        setup.scale,
        reporter,
        PhotoErrors(
            view_errors=view_errors(setup, table),
            scale_error=scale_error(setup, table),
            lamps=lamp_variances(setup, table),
            stray=beside.known,
            doubt=beside.unknown,
        ),
    )
    return found, beside


def _fitted(
    table: FacetTable,
    options: Options,
    symmetry: str,
    scale: str,
    reporter: Reporter,
    known: PhotoErrors = PhotoErrors(),  # noqa: B008  frozen
) -> FitResult:
    asked = FitOptions(
        order=options.order,
        symmetry=symmetry,
        lobes=options.lobes,
        absolute=scale == "absolute",
        physics=options.physics,
        robust=options.robust,
        smooth=options.prior != "none",
    )
    found = fit_table(table, asked, known, lambda stage: reporter.say(f"fitting: {stage}"))
    if symmetry not in ("auto", found.brdf.symmetry):
        raise InputError(f"--symmetry {symmetry}", f"cannot be fitted here; found {found.brdf.symmetry}")
    return found


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
