"""The camera by the board's corners alone, as given or fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogonio.calib.adjust.camera_model import CameraModel
from photogonio.calib.adjust.intrinsics import MODELS, CameraFit, fit_camera, free_terms, quick_camera
from photogonio.calib.adjust.rig_values import model_of_rig, refined_camera
from photogonio.calib.detect.first_look import FirstLook, Photos
from photogonio.calib.detect.observation import Posed
from photogonio.calib.detect.photo_reader import Progress, Seen, look_closer, placed_both_ways
from photogonio.calib.diagnose.board.board_shape import bad_photos
from photogonio.calib.diagnose.procedure import ask
from photogonio.calib.diagnose.registry import Stage, looked_at
from photogonio.calib.geometry.board import FEWEST_CORNERS, Corners
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.geometry.pose import fit_pose
from photogonio.calib.remarks import Remarks
from photogonio.calib.rig.gaussian import NOTHING, RigExpected, RigPrior
from photogonio.calib.rig.values import CAMERA
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import MANIFEST

_ORDINARY = (
    (0, 0.15),
    (1, 0.1),
    (2, 5e-4),
    (3, 5e-4),
)  # distortion terms of a lens, by OpenCV's number, and size
_ASPECT = 5e-4  # how square pixels are
_CENTRE = 0.01  # of the picture's width: how near its middle the lens's axis goes


def find_camera(
    look: FirstLook, tell: Progress, rig: RigPrior = NOTHING
) -> tuple[Camera, CameraModel, Photos]:
    """The camera, given, known of other sets or fitted, and all corners placed as well as they can be with it."""
    size = look.photos.samples[0].size
    entry = look.photoset.camera
    if entry.matrix is not None:
        distortion = np.zeros(0) if entry.distortion is None else np.asarray(entry.distortion, float)
        camera = Camera(np.asarray(entry.matrix, float), distortion, size)
        return camera, CameraModel(size, distortion, ()), placed(look, camera, tell)
    if (expected := rig.starting(CAMERA)) is not None:
        return _as_expected(look, tell, expected, size)
    start = quick_camera(_useful(look.photos.every, size), size)
    if start is None:
        raise InputError(
            look.photoset.folder / MANIFEST,
            "too few board corners in every photo to find the camera: give [camera] or calibration photos",
        )
    return fitted_camera(placed(look, start, tell), size, look.remarks, look.reader.workers)


def _as_expected(
    look: FirstLook, tell: Progress, expected: RigExpected, size: tuple[int, int]
) -> tuple[Camera, CameraModel, Photos]:
    """The camera of the rig, as far as the corners do not say otherwise."""
    camera, model = model_of_rig(expected, size)
    photos = placed(look, camera, tell)
    seen = {
        s.view.name: s.corners
        for s in photos.boards + photos.samples
        if s.corners is not None and len(s.corners) >= FEWEST_CORNERS and s.size == size
    }
    look.remarks.residuals["camera"] = {"model": f"of the rig, as {expected.sets} other sets have it"}
    return refined_camera(camera, model, seen), model, photos


def placed(look: FirstLook, camera: Camera, tell: Progress) -> Photos:
    """The photos' corners placed by the print, with its markers if these are where they should be, and the photos
    turned as the others are."""
    every = look.photos.every
    look = replace(look, camera=camera, both_ways=placed_both_ways(look.reader, camera, every))
    look = ask(look, looked_at(Stage.PLACED))
    closer = look_closer(look.reader, camera, every, tell, look.both_ways, bare=look.bare)
    return ask(replace(look, photos=look.photos.replaced(closer)), looked_at(Stage.CLOSER)).photos


def _useful(seen: list[Seen], size: tuple[int, int]) -> list[Corners]:
    return [s.corners for s in seen if s.corners is not None and s.size == size]


def fitted_camera(
    photos: Photos, size: tuple[int, int], remarks: Remarks, workers: int = 1
) -> tuple[Camera, CameraModel, Photos]:
    """The camera from all corners, once more without the photos that do not fit."""
    seen = [s for s in photos.boards + photos.samples if s.corners is not None and s.size == size]
    fit = fit_camera([s.corners for s in seen if s.corners is not None], size, workers)
    if fit is None:
        raise InputError(MANIFEST, "too few board corners in every photo to find the camera")
    posed = [
        (s, p) for s in seen if s.corners is not None and (p := fit_pose(fit.camera, s.corners)) is not None
    ]
    boards: list[Posed] = [
        (s.view.name, s.corners.keep(p.inlier), p.pose) for s, p in posed if s.corners is not None
    ]
    bad = dict(bad_photos(fit.camera, boards))
    if bad:
        names = {boards[k][0] for k in bad}
        for k, reason in bad.items():
            if posed[k][0].view.photos[0].role == "calibration":
                remarks.leave_out(boards[k][0], reason, "corners-astray")
        photos = replace(photos, boards=[s for s in photos.boards if s.view.name not in names])
        better = fit_camera([c for n, c, _ in boards if n not in names], size, workers)
        fit = better if better is not None else fit
    model = model_of(fit)
    remarks.residuals["camera"] = {
        "model": fit.model,
        "rms_px": fit.rms,
        "held_out_rms_px": fit.scores,
        "photos": sum(bool(u) for u in fit.used),
    }
    return fit.camera, model, photos


def model_of(fit: CameraFit) -> CameraModel:
    """What is adjusted later: the chosen terms, and those of an ordinary lens that the photos did not ask for, which
    are expected to be small. A term left out for good would make all others look surer than they are.
    """
    chosen = free_terms(MODELS[fit.model])
    held = tuple((k, sigma) for k, sigma in _ORDINARY if k not in chosen)
    return CameraModel(
        fit.camera.size,
        fit.camera.distortion,
        tuple(sorted({*chosen, *(k for k, _ in held)})),
        _ASPECT if fit.square else 0.0,
        _CENTRE * fit.camera.size[0] if fit.centred else 0.0,
        held,
    )
