"""The main job and its stages: photo set -> setup -> facet table -> fit -> files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from photogonio.cache.kept import key_of
from photogonio.cache.running import job_in
from photogonio.cache.scratch import Scratch
from photogonio.cache.store import default_folder
from photogonio.calib.rig.gaussian import NOTHING, RigPrior
from photogonio.calib.setup import Setup
from photogonio.calib.setup_file import save_setup
from photogonio.capture.linear.reader import RadianceReader
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.photoset import MANIFEST, PhotoSet
from photogonio.finished import write_result
from photogonio.options import Options
from photogonio.reconstruct.fit_result import FitResult
from photogonio.reconstruct.lighting.lamp_directions import relit, turned_lights
from photogonio.reconstruct.lighting.sample_place import moved_in_words, moved_sample, replaced
from photogonio.reconstruct.reduce.directions import ReduceOptions
from photogonio.reconstruct.reduce.fused import compiled_before
from photogonio.refit import of_photos
from photogonio.report.calibration_report import calibration_html
from photogonio.report.marked_photos import pictures_folder, save_pictures
from photogonio.report.summary import relit_warning
from photogonio.report.viewer.small_prints import SmallPrints
from photogonio.result import Result
from photogonio.run.calibrate_photos import calibrated
from photogonio.run.circumstances import Circumstances
from photogonio.run.cluster import cluster_of
from photogonio.run.colours import require_mixable
from photogonio.run.fit_photos import fitted_photos
from photogonio.run.photo_choices import asked_symmetry, choose_level, refuse_asked
from photogonio.run.reduce_photos import Plan, Reduced, reduce_photos
from photogonio.run.surroundings import around_of, shown_around
from photogonio.run.tables import refuse_empty, take_channels
from photogonio.system.memory import give_back
from photogonio.system.outputs import check_place, check_result_place, staged_file, staged_folder
from photogonio.system.progress import Reporter, Stopwatch
from photogonio.system.provenance import Provenance, canonical_command, hash_file, hash_photos


def process(
    folder: str | Path,
    out: str | Path | None = None,
    options: Options | None = None,
    reporter: Reporter | None = None,
    rig: RigPrior = NOTHING,
) -> Result:
    """Photo set to coefficients, ``result.brdf``; with ``out``, also to files there (docs/cli.md). ``rig``: what other
    sets of the same rig lead to expect (``photogonio.batch.rigs``).

    Raises:
        InputError: the set cannot be used, or what was asked cannot be done. Nothing is written then.
    """
    options, reporter = options or Options(), reporter or Reporter(quiet=True)
    if out is not None:
        check_result_place(Path(out))
    photoset = load_photoset(folder)
    symmetry = asked_symmetry(photoset, options)
    refuse_asked(photoset, symmetry, options)
    require_mixable(photoset, "absolute", options.channels)  # its scale is not known yet
    watch = Stopwatch()
    small = SmallPrints(photoset)
    with (
        Scratch(decoded=small.add) as scratch,
        cluster_of(options.executor) as cluster,
        job_in(default_folder()),
    ):
        setup, radiance, kept, correction = calibrated(
            photoset, reporter, options.threads(), scratch, rig=rig, begun=small.recall
        )
        scratch.let_go()
        give_back()
        setup = replace(setup, rig=())
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
            scratch.let_go()
            give_back()
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
            corrected = None if last else _corrected(setup, fit, photoset, reporter)
            if corrected is None:
                break
            setup = corrected
        prints = {} if out is None else small.of(radiance, kept, options.threads())
    provenance = _provenance("process", photoset, options, reduced.hashes)
    if rig.expected:
        inputs = {**provenance.inputs, "what other sets say of the rig": key_of(rig)}
        provenance = replace(provenance, inputs=inputs)
    known = replace(known, diagnoses=tuple(reporter.diagnoses))
    result = replace(of_photos(known, table, fit, beside, provenance, reporter), seconds=watch.seconds)
    if out is not None:
        write_result(replace(result, prints=prints), Path(out))
        watch.lap("write")
    return result


def _corrected(setup: Setup, fit: FitResult, photoset: PhotoSet, reporter: Reporter) -> Setup | None:
    """The setup with lights, or else the ball, where the sample's shading has them; None if they are there."""
    turned = turned_lights(fit.cells, fit.model, setup)
    if turned:
        reporter.tell(relit_warning(turned))
        return relit(setup, turned, photoset.white_patches)
    moved = moved_sample(fit.cells, fit.model, setup)
    if moved is None:
        return None
    reporter.say(moved_in_words(moved, photoset.length_unit))
    return replaced(setup, moved)


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
        check_result_place(pictures_folder(Path(out)))
    photoset = load_photoset(folder)
    threads = Options(workers=workers).threads()
    reporter = reporter or Reporter(quiet=True)
    small = SmallPrints(photoset)
    with Scratch(decoded=small.add) as scratch:
        setup, radiance, kept, _ = calibrated(
            photoset, reporter, threads, scratch, drawn=out is not None, begun=small.recall
        )
        setup = replace(
            setup,
            rig=(),
            source=_provenance("calibrate", photoset, Options(), kept.hashes).to_dict(),
            warnings=tuple(reporter.warnings),
            diagnoses=tuple(reporter.diagnoses),
        )
        if out is not None:
            prints = small.of(radiance, kept, threads)
            with staged_folder(pictures_folder(Path(out))) as stage:
                save_pictures(radiance, setup, stage, reporter)
            with staged_file(Path(out).with_suffix(".html")) as stage:
                stage.write_text(calibration_html(setup, prints, name=photoset.name), encoding="utf-8")
            with staged_file(Path(out)) as stage:
                save_setup(setup, stage)
    return setup


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
