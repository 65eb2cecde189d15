"""The room's front door: from a photo set to where everything was."""

from __future__ import annotations

from dataclasses import replace
from typing import Unpack

from photogonio.calib.adjust.state import observed
from photogonio.calib.camera_poses import first_state, scale_corners
from photogonio.calib.detect.photo_reader import Asked, Progress, Reader, ReadRadiance
from photogonio.calib.diagnose.lights.lamp_beam import LampBeam
from photogonio.calib.diagnose.lights.vignetting import Vignetting, corrected
from photogonio.calib.diagnose.procedure import ask, settle_allowing
from photogonio.calib.diagnose.registry import LIGHT, Stage, asked_at
from photogonio.calib.outcome import setup_from
from photogonio.calib.remarks import Remarks
from photogonio.calib.rig.gaussian import NOTHING, RigPrior
from photogonio.calib.rig.values import LAMP
from photogonio.calib.setup import PrintTone, Setup
from photogonio.capture.photoset import PhotoSet

OF_RIG = (Vignetting.code, LampBeam.code)  # what other sets of a rig say better than one


def calibrate(
    photoset: PhotoSet,
    read_radiance: ReadRadiance,
    progress: Progress | None = None,
    rig: RigPrior = NOTHING,
    tone: PrintTone | None = None,
    **asked: Unpack[Asked],
) -> Setup:
    """Camera, poses, lights, sample and irradiance of every sample view.

    ``rig``: what other sets of one rig lead to expect. ``asked``: how photos are read, see
    :class:`calib.detect.photo_reader.Asked`. Views that cannot be used are in ``left_out`` with the reason; InputError
    if none can. ``progress(label, done, total)`` is called after each photo.
    """
    tell = progress or (lambda label, done, total: None)
    state = first_state(photoset, Reader(photoset, read_radiance, **asked), tell, Remarks(), rig)
    state = replace(state, tone=tone)
    state = scale_corners(ask(state, asked_at(Stage.MANIFEST)))
    state = observed(ask(state, asked_at(Stage.CAMERA)))
    state = ask(state, asked_at(Stage.PHOTO))
    # paper's falloff, which tells of a beam, is not believed where the tone curve is known by print alone
    known = OF_RIG if rig.get(LAMP) is not None else (LampBeam.code,) if tone is not None else ()
    state = corrected(settle_allowing(state, [one for one in LIGHT if one.code not in known]))
    return setup_from(state)
