"""The room's front door: from a photo set to where everything was."""

from __future__ import annotations

from typing import Unpack

from photogonio.calib.adjust.state import observed
from photogonio.calib.camera_poses import first_state, scale_corners
from photogonio.calib.detect.photo_reader import Asked, Progress, Reader, ReadRadiance
from photogonio.calib.diagnose.lights.vignetting import corrected
from photogonio.calib.diagnose.procedure import ask, settle_allowing
from photogonio.calib.diagnose.registry import LIGHT, Stage, asked_at
from photogonio.calib.outcome import setup_from
from photogonio.calib.remarks import Remarks
from photogonio.calib.setup import Setup
from photogonio.capture.photoset import PhotoSet


def calibrate(
    photoset: PhotoSet, read_radiance: ReadRadiance, progress: Progress | None = None, **asked: Unpack[Asked]
) -> Setup:
    """Camera, poses, lights, sample and irradiance of every sample view.

    ``asked``: how photos are read, see :class:`calib.detect.photo_reader.Asked`. Views that cannot be used are in
    ``left_out`` with the reason; InputError if none can. ``progress(label, done, total)`` is called after each photo.
    """
    tell = progress or (lambda label, done, total: None)
    state = first_state(photoset, Reader(photoset, read_radiance, **asked), tell, Remarks())
    state = scale_corners(ask(state, asked_at(Stage.MANIFEST)))
    state = observed(ask(state, asked_at(Stage.CAMERA)))
    state = ask(state, asked_at(Stage.PHOTO))
    state = corrected(settle_allowing(state, LIGHT))
    return setup_from(state)
