"""The room's front door: from a photo set to where everything was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from calib.board import Corners
from calib.bundle import Model
from calib.camera import Camera, Pose
from calib.intrinsics import MODELS, CameraFit, fit_camera, free_terms, quick_camera
from calib.irradiance import read_view, tie
from calib.lamps import block_name, place_in_world, start_lamps
from calib.looking import Progress, Reader, ReadRadiance, Seen, look, look_closer
from calib.notes import Notes
from calib.observe import observe
from calib.pose import FEWEST_CORNERS, PoseFit, fit_pose, joined
from calib.setup import Light, Setup, ViewSetup
from calib.sight import FIXED_POSE, Sight, channel_names, light_id
from calib.together import Settled, settle, start_sample, start_scene
from capture.errors import InputError
from capture.photoset import MANIFEST, MirrorBall, PhotoSet, Sphere


def calibrate(photoset: PhotoSet, read_radiance: ReadRadiance, progress: Progress | None = None) -> Setup:
    """Camera, poses, lights, sample and irradiance of every sample view.

    Views that cannot be used are in ``left_out`` with the reason; InputError if none can.
    ``progress(label, done, total)`` is called after each photo.
    """
    tell = progress or (lambda label, done, total: None)
    reader, notes = Reader(photoset, read_radiance), Notes()
    samples = look(reader, photoset.views("sample"), tell, "looking for the board")
    probes = look(reader, photoset.views("probe"), tell, "looking at probe photos")
    boards = look(reader, photoset.views("calibration"), tell, "looking at calibration photos")
    for name, reason in reader.failed.items():
        notes.leave_out(name, reason)
    if not samples:
        raise InputError(photoset.folder / MANIFEST, "none of the sample photos can be read")
    camera, model, boards, samples, probes = _camera(photoset, reader, boards, samples, probes, notes, tell)
    posed, sights = _sights(photoset, camera, boards, samples, probes, notes)
    settled = _settled(photoset, reader, model, camera, posed, sights, notes, tell)
    views, scale = _views(photoset, reader, settled, sights, notes)
    if not views:
        raise InputError(photoset.folder / MANIFEST, "no sample photo can be used: " + notes.reasons())
    return Setup(
        settled.camera,
        _sample(photoset, settled),
        tuple(views),
        scale,
        channel_names(len(views[0].strength)),
        tuple(notes.left_out),
        tuple(notes.warnings),
        notes.residuals,
        mirror_balls=_mirror_balls(photoset, settled),
    )


def _mirror_balls(photoset: PhotoSet, settled: Settled) -> tuple[MirrorBall, ...]:
    blocks = [settled.values[f"ball {k}"] for k in range(len(photoset.mirror_balls))]
    return tuple(MirrorBall(b[:3].copy(), float(b[3])) for b in blocks)


def _camera(
    photoset: PhotoSet,
    reader: Reader,
    boards: list[Seen],
    samples: list[Seen],
    probes: list[Seen],
    notes: Notes,
    tell: Progress,
) -> tuple[Camera, Model, list[Seen], list[Seen], list[Seen]]:
    """The camera, and all corners placed as well as they can be with it."""
    size = samples[0].size
    entry = photoset.camera
    if entry.matrix is not None:
        distortion = np.zeros(0) if entry.distortion is None else np.asarray(entry.distortion, float)
        start = Camera(np.asarray(entry.matrix, float), distortion, size)
    else:
        found = quick_camera(
            [s.corners for s in boards + samples if s.corners is not None and s.size == size], size
        )
        if found is None:
            raise InputError(
                photoset.folder / MANIFEST,
                "too few board corners in every photo to find the camera; give [camera] or calibration photos",
            )
        start = found
    every = look_closer(reader, start, boards + samples + probes, tell)
    boards = every[: len(boards)]
    samples, probes = every[len(boards) : len(boards) + len(samples)], every[len(boards) + len(samples) :]
    if entry.matrix is not None:
        return start, Model(size, start.distortion, ()), boards, samples, probes
    fit = fit_camera([s.corners for s in boards + samples if s.corners is not None and s.size == size], size)
    _note_camera(fit, notes)
    return (
        fit.camera,
        Model(size, fit.camera.distortion, free_terms(MODELS[fit.model])),
        boards,
        samples,
        probes,
    )


def _note_camera(fit: CameraFit, notes: Notes) -> None:
    notes.residuals["camera"] = {
        "model": fit.model,
        "rms_px": fit.rms,
        "held_out_rms_px": fit.scores,
    }


def _sights(
    photoset: PhotoSet,
    camera: Camera,
    boards: list[Seen],
    samples: list[Seen],
    probes: list[Seen],
    notes: Notes,
) -> tuple[list[tuple[str, Corners, Pose]], list[Sight]]:
    """Poses of the calibration photos and of every sample and probe view that has one."""
    posed = []
    for one in boards:
        fit = fit_pose(camera, one.corners) if one.corners is not None else None
        if fit is None:
            notes.leave_out(one.view.name, "too few board corners")
        else:
            posed.append((f"pose {one.view.name}", one.corners.keep(fit.inlier), fit.pose))
    common = _common_pose(photoset, camera, samples + probes)
    sights = []
    for one in samples + probes:
        fit = fit_pose(camera, one.corners) if one.corners is not None else None
        name = light_id(photoset, one.view)
        if common is not None:
            pose, rms = common
            corners = _agreeing(camera, pose, one.corners)
            sights.append(Sight(one.view, name, corners, pose, FIXED_POSE, rms))
        elif fit is not None:
            sights.append(
                Sight(
                    one.view, name, one.corners.keep(fit.inlier), fit.pose, f"pose {one.view.name}", fit.rms
                )
            )
        elif one.view.photos[0].role == "sample":
            notes.leave_out(one.view.name, f"fewer than {FEWEST_CORNERS} board corners agree: no camera pose")
    return posed, sights


def _common_pose(photoset: PhotoSet, camera: Camera, seen: list[Seen]) -> tuple[Pose, float] | None:
    """The one pose of a fixed camera: as given, or from all photos' corners together."""
    entry = photoset.camera
    if entry.rotation is not None and entry.translation is not None:
        return Pose(np.asarray(entry.rotation, float), np.asarray(entry.translation, float)), float("nan")
    found = [s.corners for s in seen if s.corners is not None and len(s.corners)]
    if not entry.fixed or not found:
        return None
    fit: PoseFit | None = fit_pose(camera, joined(found))
    return None if fit is None else (fit.pose, fit.rms)


def _agreeing(camera: Camera, pose: Pose, corners: Corners | None) -> Corners | None:
    if corners is None or len(corners) == 0:
        return None
    miss = np.linalg.norm(camera.project(pose, corners.points) - corners.pixels, axis=1)
    return corners.keep(miss < 1.0)


def _settled(
    photoset: PhotoSet,
    reader: Reader,
    model: Model,
    camera: Camera,
    posed: list[tuple[str, Corners, Pose]],
    sights: list[Sight],
    notes: Notes,
    tell: Progress,
) -> Settled:
    if not sights:
        raise InputError(photoset.folder / MANIFEST, "no sample photo can be used: " + notes.reasons())
    observe(photoset, reader, camera, sights, photoset.mirror_balls, tell)
    sample = start_sample(camera, sights, photoset.sample)
    scene = start_scene(photoset, camera, sights, sample)
    groups: dict[str, list[Sight]] = {}
    for sight in sights:
        groups.setdefault(sight.light, []).append(sight)
    wanted = {name: members for name, members in groups.items() if any(not s.probe for s in members)}
    lamps = start_lamps(photoset, camera, wanted, scene, tell)
    _scale_corners(camera, posed, sights)
    return settle(photoset, reader, model, camera, posed, sights, lamps, scene, sample, tell)


def _scale_corners(camera: Camera, posed: list[tuple[str, Corners, Pose]], sights: list[Sight]) -> None:
    """Give corners the errors they show: those stated know nothing of what all corners of a print share."""
    z = [(camera.project(p, c.points) - c.pixels) / c.sigma[:, None] for _, c, p in posed]
    z += [
        (camera.project(s.pose, s.corners.points) - s.corners.pixels) / s.corners.sigma[:, None]
        for s in sights
        if s.corners
    ]
    if not z:
        return
    factor = max(1.0, 1.4826 * float(np.median(np.abs(np.concatenate(z)))))
    for k, (name, corners, pose) in enumerate(posed):
        posed[k] = (name, replace(corners, sigma=factor * corners.sigma), pose)
    for sight in sights:
        if sight.corners is not None:
            sight.corners = replace(sight.corners, sigma=factor * sight.corners.sigma)


def _views(
    photoset: PhotoSet, reader: Reader, settled: Settled, sights: list[Sight], notes: Notes
) -> tuple[list[ViewSetup], str]:
    lights: dict[str, Light] = {}
    readings, given, kept = {}, {}, []
    for sight in sights:
        name = sight.view.name
        if sight.probe:
            continue
        if sight.light not in settled.lamps:
            notes.leave_out(name, f"light {sight.light!r} is seen in no mirror ball and on no paper")
            continue
        image = reader(sight.view)
        if image is None:
            notes.leave_out(name, reader.failed[name])
            continue
        lights[name] = _light(settled, sight)
        readings[name] = read_view(photoset, image, settled, sight, lights[name], notes)
        entry = settled.lamps[sight.light].entry
        intensity = np.asarray(entry.intensity if entry is not None else (1.0,), float)
        given[name] = np.broadcast_to(intensity, (image.value.shape[2],)).copy()
        kept.append(sight)
    if not kept:
        return [], "relative"
    tied, scale = tie(photoset, readings, lights, given, notes)
    views = [
        ViewSetup(
            s.view.name,
            lights[s.view.name],
            s.pose,
            tied[s.view.name].value,
            tied[s.view.name].error,
            tied[s.view.name].source,
            s.pose_rms,
        )
        for s in kept
    ]
    return views, scale


def _light(settled: Settled, sight: Sight) -> Light:
    lamp = settled.lamps[sight.light]
    block = settled.values[block_name(lamp.name)]
    covariance = settled.covariance.get(block_name(lamp.name), np.zeros((3, 3)))
    place = place_in_world(lamp, block, sight.pose)
    if lamp.attached:
        covariance = sight.pose.rotation.T @ covariance @ sight.pose.rotation
    if lamp.kind == "directional":
        place = place / np.linalg.norm(place)
        across = np.eye(3) - np.outer(place, place)
        covariance = across @ covariance @ across
    misses = settled.misses.get(lamp.name)
    rms = float(np.sqrt(np.mean(misses**2))) if misses is not None and len(misses) else float("nan")
    radius = lamp.entry.radius if lamp.entry is not None and lamp.entry.radius is not None else 0.0
    if settled.scene is not None and radius == 0.0 and lamp.kind == "point":
        radius = settled.scene.lamp_radius
    return Light(lamp.name, lamp.kind, place, covariance, lamp.source, radius, rms)


def _sample(photoset: PhotoSet, settled: Settled) -> object:
    if isinstance(photoset.sample, Sphere) and "sample" in settled.values:
        block = settled.values["sample"]
        return Sphere(block[:3].copy(), float(block[3]))
    return photoset.sample
