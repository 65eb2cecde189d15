"""The first half of calibration: the camera, and where it stood in every photo."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogonio.calib.adjust.rig_values import with_rig
from photogonio.calib.adjust.state import State
from photogonio.calib.detect.first_look import FirstLook, Photos
from photogonio.calib.detect.observation import FIXED_POSE, POSE, Observation, Posed, light_id
from photogonio.calib.detect.photo_reader import Progress, Reader, Seen, look
from photogonio.calib.diagnose.procedure import ask
from photogonio.calib.diagnose.registry import Stage, looked_at
from photogonio.calib.first_camera import find_camera
from photogonio.calib.geometry.board import FEWEST_CORNERS, Corners
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.pose import fit_pose, joined
from photogonio.calib.remarks import Remarks
from photogonio.calib.rig.gaussian import RigPrior
from photogonio.capture import robust
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import copies
from photogonio.capture.photoset import MANIFEST, PhotoSet, View

_ASTRAY = 1.0  # pixels that a fixed camera's corner may miss by
_POSE_VALUES = 7  # that each photo's corners fix: its pose, and its share of the camera
_MOVED = 0.5  # share of a photo's corners astray that means the camera moved
_MOST_PIXELS, _MOST_SHARE = (
    3.0,
    1e-3,
)  # rms in pixels, or of the picture's width, that no print misses its places by


def first_state(photoset: PhotoSet, reader: Reader, tell: Progress, remarks: Remarks, rig: RigPrior) -> State:
    """Where the camera stood in every photo; InputError if nothing can be made of the set."""
    first = FirstLook(photoset, reader, look_at_all(photoset, reader, tell, remarks), remarks)
    first = ask(first, looked_at(Stage.LOOK))
    camera, model, photos = find_camera(first, tell, rig)
    photoset = reader.photoset = photos.as_read(first.photoset)
    boards, observations = find_poses(photoset, camera, photos, remarks)
    state = State(photoset, reader, camera, model, tuple(boards), tuple(observations), remarks, tell, rig=rig)
    return with_rig(state)


def look_at_all(photoset: PhotoSet, reader: Reader, tell: Progress, remarks: Remarks) -> Photos:
    """Every photo's corners at first sight; InputError if no sample photo can be read."""
    if not photoset.views("sample"):
        raise InputError(photoset.folder / MANIFEST, 'no [[photo]] has the role "sample"')
    samples = look(reader, _originals(photoset, remarks), tell, "looking for the board")
    probes = look(reader, photoset.views("probe"), tell, "looking at probe photos")
    boards = look(reader, photoset.views("calibration"), tell, "looking at calibration photos")
    for name, reason in reader.failed.items():
        remarks.leave_out(name, reason, "unreadable-photo")
    if not samples:
        raise InputError(photoset.folder / MANIFEST, "none of the sample photos can be read")
    return Photos(samples, probes, boards)


def _originals(photoset: PhotoSet, remarks: Remarks) -> tuple[View, ...]:
    """The sample's views without copies of others, which would count twice and predict themselves."""
    views = photoset.views("sample")
    copied = copies(photoset.folder, [v.name for v in views if len(v.photos) == 1])
    for name, original in copied.items():
        remarks.leave_out(name, f"it is the same file as {original}", "copied-photo")
    return tuple(v for v in views if v.name not in copied)


def find_poses(
    photoset: PhotoSet, camera: Camera, photos: Photos, remarks: Remarks
) -> tuple[list[Posed], list[Observation]]:
    """Poses of the calibration photos and of every sample and probe view that has one."""
    boards: list[Posed] = []
    for one in photos.boards:
        fit = fit_pose(camera, one.corners) if one.corners is not None else None
        if fit is None or one.corners is None:
            remarks.leave_out(one.view.name, f"fewer than {FEWEST_CORNERS} board corners agree", "no-pose")
        else:
            boards.append((POSE + one.view.name, one.corners.keep(fit.inlier), fit.pose))
    common = _common_pose(photoset, camera, photos.samples + photos.probes)
    observations = []
    for one in photos.samples + photos.probes:
        observation = _sight(photoset, camera, one, common, remarks)
        if observation is not None:
            observations.append(observation)
    return boards, observations


def _sight(
    photoset: PhotoSet, camera: Camera, one: Seen, common: tuple[Pose, float] | None, remarks: Remarks
) -> Observation | None:
    name = light_id(photoset, one.view)
    if common is not None and not _moved(camera, common[0], one, remarks):
        corners = _agreeing(camera, common[0], one)
        return Observation(
            one.view, name, corners, common[0], FIXED_POSE, common[1], rejected=_rest(one, corners)
        )
    fit = fit_pose(camera, one.corners) if one.corners is not None else None
    if fit is None or one.corners is None:
        if one.view.photos[0].role == "sample":
            remarks.leave_out(
                one.view.name, f"fewer than {FEWEST_CORNERS} board corners agree: no camera pose", "no-pose"
            )
        return None
    corners = one.corners.keep(fit.inlier)
    return Observation(
        one.view, name, corners, fit.pose, POSE + one.view.name, fit.rms, rejected=_rest(one, corners)
    )


def _rest(one: Seen, kept: Corners | None) -> np.ndarray:
    """Pixels (n, 2) of the corners that were not kept."""
    if one.corners is None:
        return np.zeros((0, 2))
    used = np.zeros(0, int) if kept is None else kept.ids
    return one.corners.pixels[~np.isin(one.corners.ids, used)]


def _common_pose(photoset: PhotoSet, camera: Camera, seen: list[Seen]) -> tuple[Pose, float] | None:
    """The one pose of a fixed camera: as given, or from all photos' corners together."""
    entry = photoset.camera
    if entry.rotation is not None and entry.translation is not None:
        return Pose(np.asarray(entry.rotation, float), np.asarray(entry.translation, float)), float("nan")
    found = [s.corners for s in seen if s.corners is not None and len(s.corners)]
    if not entry.fixed or not found:
        return None
    fit = fit_pose(camera, joined(found))
    return None if fit is None else (fit.pose, fit.rms)


def _moved(camera: Camera, pose: Pose, one: Seen, remarks: Remarks) -> bool:
    """Whether most of a photo's corners agree on another pose than the fixed camera's; such a photo is named."""
    if one.corners is None or len(one.corners) < FEWEST_CORNERS:
        return False
    miss = _misses(camera, pose, one.corners)
    if np.mean(miss > _ASTRAY) <= _MOVED or fit_pose(camera, one.corners) is None:
        return False
    remarks.tell(
        "camera-moved",
        f"{one.view.name}: the board is {np.median(miss):.1f} px off where the fixed camera sees it in the others; "
        "something moved, so this photo has a pose of its own",
        views=(one.view.name,),
        amount=float(np.median(miss)),
        least=_ASTRAY,
    )
    return True


def _agreeing(camera: Camera, pose: Pose, one: Seen) -> Corners | None:
    """A photo's corners where a fixed camera must see them."""
    if one.corners is None or len(one.corners) == 0:
        return None
    kept = one.corners.keep(_misses(camera, pose, one.corners) < _ASTRAY)
    return kept if len(kept) else None


def _misses(camera: Camera, pose: Pose, corners: Corners) -> np.ndarray:
    """(n,) pixels between corners and where ``pose`` puts them."""
    return np.linalg.norm(camera.project(pose, corners.points) - corners.pixels, axis=1)


def _refuse_misfit(photoset: PhotoSet, camera: Camera, photos: list[tuple[Corners, Pose]]) -> None:
    """InputError if in most photos the board's corners lie many pixels beside their places."""
    if not photos:
        return
    each = [float(np.sqrt(np.mean(_misses(camera, pose, corners) ** 2))) for corners, pose in photos]
    rms = float(np.median(each))
    if rms > max(_MOST_PIXELS, _MOST_SHARE * camera.size[0]):
        given = photoset.camera.matrix is not None
        raise InputError(
            photoset.folder / MANIFEST,
            f"[board]: its corners miss their places by {rms:.1f} px (rms) in the photos: "
            + ("matrix or distortion of [camera] is of another camera, or " if given else "")
            + "the print is not as the manifest says (lengths, places of markers, squares), or not flat",
        )


def _freed(corners: Corners) -> float:
    """What the fit of a pose takes off its corners' residuals, as a factor to put it back."""
    count = 2 * len(corners)
    return float(np.sqrt(count / max(count - _POSE_VALUES, 1)))


def scale_corners(state: State) -> State:
    """Give corners the errors they show: those stated know nothing of what all corners of a print share.

    Raises:
        InputError: they lie nowhere near their places.
    """
    camera, observations = state.camera, state.copied()
    seen = [(s, s.corners) for s in observations if s.corners is not None]
    photos = [(c, p) for _, c, p in state.boards] + [(c, s.pose) for s, c in seen]
    _refuse_misfit(state.photoset, camera, photos)
    z = [_freed(c) * (camera.project(p, c.points) - c.pixels) / c.sigma[:, None] for c, p in photos]
    if not z:
        return state
    # by the worse axis of the picture: where the print lies along the rows of pixels, these cut all edges along them
    # alike, and corners err several times as much across
    factor = max(1.0, float(robust.deviation(np.concatenate(z), axis=0).max()))
    boards = tuple((name, replace(c, sigma=factor * c.sigma), pose) for name, c, pose in state.boards)
    still = sum(s.pose_block == FIXED_POSE for s in observations)
    for observation, corners in seen:
        # a still camera's photos repeat the errors of where the pixels cut the print
        alike = np.sqrt(still) if observation.pose_block == FIXED_POSE else 1.0
        observation.corners = replace(corners, sigma=alike * factor * corners.sigma)
    return replace(state, boards=boards, observations=tuple(observations))
