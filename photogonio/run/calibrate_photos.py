"""A photo set calibrated, unless it was before: where everything was, and the reader of its photos."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from photogonio.cache.corners import KeptLooks
from photogonio.cache.kept import KeptSetup
from photogonio.cache.scratch import Scratch
from photogonio.cache.store import default_store
from photogonio.calib.calibrate import calibrate as find_setup
from photogonio.calib.response.paper_codes import CodeReader
from photogonio.calib.response.tone import tone_note, tone_of_print, with_tone
from photogonio.calib.rig.codes import DIFFERS
from photogonio.calib.rig.gaussian import NOTHING, RigExpected, RigPrior
from photogonio.calib.rig.values import WORDS, kind_of
from photogonio.calib.setup import PrintTone, Setup
from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import Image
from photogonio.capture.linear.colour_chart import ColourCorrection
from photogonio.capture.linear.frames import falloff_gain
from photogonio.capture.linear.prepare import prepare, untold_by_brackets, vignetting
from photogonio.capture.linear.reader import RadianceReader
from photogonio.capture.photoset import MANIFEST, PhotoSet
from photogonio.run.colours import correction_note, find_correction
from photogonio.system.memory import give_back
from photogonio.system.progress import Reporter

ABREAST = 2  # whole photos that calibration looks at together: the memory they take


def calibrated(
    photoset: PhotoSet,
    reporter: Reporter,
    workers: int,
    scratch: Scratch,
    *,
    drawn: bool = False,
    rig: RigPrior = NOTHING,
    begun: Callable[[KeptSetup], None] = lambda kept: None,
) -> tuple[Setup, RadianceReader, KeptSetup, ColourCorrection | None]:
    """Where everything was, the reader that the sample photos are to be read with, what is kept of the set,
    and the colours of a chart. ``drawn``: a picture of every photo will be made; ``rig``: what other sets of the rig
    lead to expect; ``begun`` is shown what is kept of the set, before any photo is decoded."""
    again = drawn or photoset.radiometry.vignetting == "cos4"
    twice = untold_by_brackets(photoset)
    again = again or twice
    kept = KeptSetup.of(photoset, default_store(), workers, rig)
    begun(kept)
    setup = kept.load()
    decode = scratch.keep if again else _keeping(photoset, scratch)
    radiance = prepare(photoset, decode=decode)
    tone = None if setup is None else setup.tone
    if twice and tone is None:
        tone = _tone_told(radiance, kept, reporter, workers, scratch, rig)
    if tone is not None:
        radiance = prepare(photoset, decode=decode, tone=tone.table)
        radiance = replace(radiance, notes=(tone_note(tone), *radiance.notes))
    correction = find_correction(photoset, radiance, reporter.tell)
    if setup is not None:
        reporter.say("calibrated before, with the same photos, and not again")
    else:
        setup = _found(radiance, kept, reporter, workers, scratch, rig, tone)
        if (
            photoset.radiometry.vignetting == "cos4"
        ):  # takes the camera, and changes the white patch's reading
            setup = _found(with_vignetting(radiance, setup), kept, reporter, workers, scratch, rig, tone)
        if tone is not None:
            seen = {view.name for view in setup.views}
            views = [view for view in photoset.views("sample") if view.name in seen]
            setup = with_tone(setup, tone, {view.name: radiance.factor(view.photos[0]) for view in views})
        setup = kept.save(setup)
    radiance = replace(radiance, photoset=photoset.turned_to(setup.turned), decode=scratch.take)
    radiance = without_veil(with_vignetting(radiance, setup), setup)
    for note in radiance.notes:
        reporter.say(note)
    reporter.tell(*radiance.diagnoses, *setup.diagnoses)
    told: dict[str, object] = {"radiometry": list(radiance.notes)}
    if rig.expected:
        told["rig"] = {one.name: _expected_note(one) for one in rig.expected}
    if rig.differs:
        reporter.tell(differing(rig))
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


def _expected_note(one: RigExpected) -> dict[str, object]:
    error = np.sqrt(np.diag(one.covariance))
    return {"value": one.value.tolist(), "standard_error": error.tolist(), "sets": one.sets}


def differing(rig: RigPrior) -> Diagnosis:
    """What is told of a set that contradicts the others of its rig."""
    words = "; ".join(f"{name} ({WORDS[kind_of(name)]})" for name in rig.differs)
    return Diagnosis(
        DIFFERS,
        f"this set contradicts the others of its rig in {words}: found by itself, and left out of what they share",
        amount=len(rig.differs),
        detail={"of": list(rig.differs)},
    )


def _tone_told(
    radiance: RadianceReader,
    kept: KeptSetup,
    reporter: Reporter,
    workers: int,
    scratch: Scratch,
    rig: RigPrior,
) -> PrintTone:
    """The tone curve that print and paper tell, by a first calibration as if it were sRGB's.

    Raises:
        InputError: they do not tell it.
    """
    reporter.say(
        "no photo tells its tone curve: calibrating as if it were sRGB's, to learn it from the print"
    )
    first = _found(radiance, kept, reporter, workers, scratch, rig)
    try:
        return tone_of_print(radiance.photoset, first, CodeReader(radiance.read, radiance.coded))
    except ValueError as error:
        where = f'{radiance.photoset.folder / MANIFEST}: [radiometry] encoding = "unknown"'
        raise InputError(where, f"the tone curve cannot be recovered: {error}") from error


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
    radiance: RadianceReader,
    kept: KeptSetup,
    reporter: Reporter,
    workers: int,
    scratch: Scratch,
    rig: RigPrior,
    tone: PrintTone | None = None,
) -> Setup:
    def progress(what: str, done: int, total: int) -> None:
        reporter.progress(what, done, total)
        if done == total:  # what follows takes other memory than a pass over all photos
            scratch.let_go()
            give_back()

    return find_setup(
        radiance.photoset,
        lambda _, view: radiance.read(view),
        progress,
        rig,
        tone,
        read_part=radiance.read,
        read_level=radiance.read_level,
        workers=min(workers, ABREAST),
        keep=scratch.put,
        codes=radiance.coded,
        looks=None if kept.store is None else KeptLooks(kept.store, radiance, kept.hashes),
    )
