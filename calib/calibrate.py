"""The room's front door: from a photo set to where everything was."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from calib.camera import Camera, Pose
from calib.highlights import find_highlight
from calib.intrinsics import fit_camera
from calib.irradiance import read_patch
from calib.lights import MirroredRay, meet, mirrored_ray
from calib.looking import Progress, Reader, ReadRadiance, Seen, look
from calib.pose import fit_pose, joined
from calib.setup import LeftOut, Light, Setup, ViewSetup
from capture.errors import InputError
from capture.photoset import MANIFEST, LightEntry, PhotoSet, Sphere, View


@dataclass(slots=True)
class _Notes:
    """What is to be told at the end."""

    left_out: list[LeftOut] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    residuals: dict[str, object] = field(default_factory=dict)

    def leave_out(self, name: str, reason: str) -> None:
        self.left_out.append(LeftOut(name, reason))
        self.warnings.append(f"{name}: left out, {reason}")


def calibrate(photoset: PhotoSet, read_radiance: ReadRadiance, progress: Progress | None = None) -> Setup:
    """Camera, poses, lights and irradiance of every sample view.

    Views that cannot be used are in ``left_out`` with the reason; InputError if none can.
    ``progress(label, done, total)`` is called after each photo.
    """
    tell = progress or (lambda label, done, total: None)
    reader, notes = Reader(photoset, read_radiance), _Notes()
    samples = look(reader, photoset.views("sample"), tell, "looking for the board")
    boards = look(reader, photoset.views("calibration"), tell, "looking at calibration photos")
    for name, reason in reader.failed.items():
        notes.leave_out(name, reason)
    if not samples:
        raise InputError(photoset.folder / MANIFEST, "none of the sample photos can be read")
    camera = _camera(photoset, boards, samples, notes)
    poses = _poses(photoset, camera, samples, notes)
    lights = _lights(photoset, reader, camera, poses, notes, tell)
    views = _strengths(photoset, reader, camera, poses, lights, notes)
    if not views:
        raise InputError(photoset.folder / MANIFEST, "no sample photo can be used: " + _reasons(notes))
    channels = _channels(len(views[0].strength))
    scale = "absolute" if photoset.white_patches else "relative"
    return Setup(
        camera,
        photoset.sample,
        tuple(views),
        scale,
        channels,
        tuple(notes.left_out),
        tuple(notes.warnings),
        notes.residuals,
    )


def _reasons(notes: _Notes) -> str:
    return "; ".join(f"{o.name}: {o.reason}" for o in notes.left_out[:3])


def _channels(count: int) -> tuple[str, ...]:
    return {1: ("Y",), 3: ("R", "G", "B")}.get(count, tuple(f"C{k}" for k in range(count)))


def _camera(photoset: PhotoSet, boards: list[Seen], samples: list[Seen], notes: _Notes) -> Camera:
    entry = photoset.camera
    size = samples[0].size
    if entry.matrix is not None:
        distortion = np.zeros(0) if entry.distortion is None else np.asarray(entry.distortion, float)
        return Camera(np.asarray(entry.matrix, float), distortion, size)
    views = [s.corners for s in boards + samples if s.corners is not None and s.size == size]
    fit = fit_camera(views, size)
    if fit is None:
        raise InputError(
            photoset.folder / MANIFEST,
            "too few board corners in every photo to find the camera; give [camera]",
        )
    notes.residuals["camera"] = {
        "model": fit.model,
        "rms_px": fit.rms,
        "standard_errors": fit.standard_errors.tolist(),
        "held_out_rms_px": fit.scores,
    }
    return fit.camera


@dataclass(frozen=True, slots=True)
class _Posed:
    view: View
    pose: Pose
    rms: float


def _poses(photoset: PhotoSet, camera: Camera, samples: list[Seen], notes: _Notes) -> list[_Posed]:
    entry = photoset.camera
    if entry.rotation is not None and entry.translation is not None:
        pose = Pose(np.asarray(entry.rotation, float), np.asarray(entry.translation, float))
        return [_Posed(s.view, pose, float("nan")) for s in samples]
    found = [s.corners for s in samples if s.corners is not None and len(s.corners)]
    if entry.fixed and found:
        fit = fit_pose(camera, joined(found))
        if fit is not None:
            return [_Posed(s.view, fit.pose, fit.rms) for s in samples]
    posed = []
    for s in samples:
        fit = fit_pose(camera, s.corners) if s.corners is not None else None
        if fit is None:
            notes.leave_out(s.view.name, "too few board corners to find the camera's place")
        else:
            posed.append(_Posed(s.view, fit.pose, fit.rms))
    return posed


def _entry(photoset: PhotoSet, view: View) -> LightEntry | None:
    """The manifest's entry of a view's light."""
    if view.light is None and len(photoset.lights) == 1:
        return photoset.lights[0]
    return next((e for e in photoset.lights if e.id == view.light), None)


def _light_id(photoset: PhotoSet, view: View) -> str:
    entry = _entry(photoset, view)
    return entry.id if entry is not None else view.light or view.name


def _lights(
    photoset: PhotoSet, reader: Reader, camera: Camera, posed: list[_Posed], notes: _Notes, tell: Progress
) -> dict[str, Light]:
    """One light an id, by view name."""
    groups: dict[str, list[tuple[View, Pose]]] = {}
    for p in posed:
        groups.setdefault(_light_id(photoset, p.view), []).append((p.view, p.pose))
    probe_pose = posed[0].pose if posed else None
    for view in photoset.views("probe"):
        if probe_pose is not None and _light_id(photoset, view) in groups:
            groups[_light_id(photoset, view)].append((view, probe_pose))
    found: dict[str, Light] = {}
    for k, (name, members) in enumerate(groups.items()):
        light = _one_light(photoset, reader, camera, name, members)
        for p in posed:
            if _light_id(photoset, p.view) == name:
                if light is None:
                    notes.leave_out(p.view.name, f"no highlight of light {name!r} in any mirror ball")
                else:
                    found[p.view.name] = light
        tell("finding the lights", k + 1, len(groups))
    return found


def _one_light(
    photoset: PhotoSet, reader: Reader, camera: Camera, name: str, members: list[tuple[View, Pose]]
) -> Light | None:
    entry = next((e for e in photoset.lights if e.id == name), None)
    if entry is not None and entry.position is not None and entry.attached_to is None:
        return Light(name, "point", np.asarray(entry.position, float), np.zeros((3, 3)), "given")
    if entry is not None and entry.direction is not None:
        toward = np.asarray(entry.direction, float)
        return Light(name, "directional", toward / np.linalg.norm(toward), np.zeros((3, 3)), "given")
    rays: list[MirroredRay] = []
    probes = any(v.photos[0].role == "probe" for v, _ in members)
    for view, pose in members:
        if probes and view.photos[0].role != "probe":
            continue
        image = reader(view)
        if image is None:
            continue
        for number, ball in enumerate(photoset.mirror_balls):
            highlight = find_highlight(image, camera, pose, ball, number)
            ray = mirrored_ray(camera, pose, ball, highlight) if highlight is not None else None
            if ray is not None:
                rays.append(ray)
    if not rays:
        return None
    spread = max(np.linalg.norm(b.center) for b in photoset.mirror_balls) + 1.0
    place = meet(rays, entry.kind if entry is not None else None, float(spread))
    source = "probe" if probes else "mirror balls"
    return Light(name, place.kind, place.place, place.covariance, source, residual=place.residual)


def _strengths(
    photoset: PhotoSet,
    reader: Reader,
    camera: Camera,
    posed: list[_Posed],
    lights: dict[str, Light],
    notes: _Notes,
) -> list[ViewSetup]:
    views = []
    for p in posed:
        if p.view.name not in lights:
            continue
        light = lights[p.view.name]
        image = reader(p.view)
        if image is None:
            continue
        channels = image.value.shape[2]
        strength, error, source = _strength(photoset, image, camera, p.pose, light, channels, p.view)
        views.append(ViewSetup(p.view.name, light, p.pose, strength, error, source, p.rms))
    return views


def _strength(photoset, image, camera, pose, light, channels, view):
    entry = _entry(photoset, view)
    readings = [read_patch(image, camera, pose, light, patch) for patch in photoset.white_patches]
    good = [r for r in readings if r.strength is not None]
    if good:
        return good[0].strength, good[0].error, "white patch"
    given = np.asarray(entry.intensity if entry is not None else (1.0,), float)
    strength = np.broadcast_to(given, (channels,)).copy()
    return strength, 0.1 * strength, "intensity"


def sample_center(sample: object) -> np.ndarray:
    """The middle of the sample, (3,)."""
    if isinstance(sample, Sphere):
        return np.asarray(sample.center, float)
    return np.append(np.asarray(sample.outline, float).mean(0), sample.height)
