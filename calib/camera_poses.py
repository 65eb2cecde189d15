"""The first half of calibration: the camera, and where it stood in every photo."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from photogonio.calib.adjust.bundle import CameraModel
from photogonio.calib.adjust.intrinsics import MODELS, CameraFit, fit_camera, free_terms, quick_camera
from photogonio.calib.adjust.state import State
from photogonio.calib.detect.observation import FIXED_POSE, POSE, Observation, Posed, light_id
from photogonio.calib.detect.photo_reader import Progress, Reader, Seen, look, look_closer
from photogonio.calib.diagnose.board.board_shape import bad_photos
from photogonio.calib.diagnose.board.marker_corners import listed_order, order_warning, reordered
from photogonio.calib.diagnose.board.wrong_board import board_fault
from photogonio.calib.diagnose.photos.turned_photos import (
    mirrored_photos,
    tell_turned,
    turned_against_given,
    turned_against_lens,
    turned_photos,
    upright,
)
from photogonio.calib.geometry.board import FEWEST_CORNERS, Corners, board_points
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.pose import fit_pose, joined
from photogonio.calib.remarks import Remarks
from photogonio.capture import robust
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import copies
from photogonio.capture.photoset import MANIFEST, LooseMarkers, PhotoSet, View

_ASTRAY = 1.0  # pixels that a fixed camera's corner may miss by
_ORDINARY = (
    (0, 0.15),
    (1, 0.1),
    (2, 5e-4),
    (3, 5e-4),
)  # distortion terms of a lens, by OpenCV's number, and size
_ASPECT = 5e-4  # how square pixels are
_CENTRE = 0.01  # of the picture's width: how near its middle the lens's axis goes
_POSE_VALUES = 7  # that each photo's corners fix: its pose, and its share of the camera
_MOVED = 0.5  # share of a photo's corners astray that means the camera moved
_MOST_PIXELS, _MOST_SHARE = (
    3.0,
    1e-3,
)  # rms in pixels, or of the picture's width, that no print misses its places by


@dataclass(frozen=True, slots=True)
class Photos:
    """All photos with their corners, by role."""

    samples: list[Seen]
    probes: list[Seen]
    boards: list[Seen]  # calibration photos

    @property
    def every(self) -> list[Seen]:
        return self.boards + self.samples + self.probes

    def replaced(self, every: list[Seen]) -> Photos:
        """The same with other corners; inverse of ``every``."""
        first, second = len(self.boards), len(self.boards) + len(self.samples)
        return Photos(every[first:second], every[second:], every[:first])


def first_state(photoset: PhotoSet, reader: Reader, tell: Progress, remarks: Remarks) -> State:
    """Where the camera stood in every photo; InputError if nothing can be made of the set."""
    photos = look_at_all(photoset, reader, tell, remarks)
    photoset, photos = as_printed(photoset, reader, photos, remarks)
    camera, model, photos = find_camera(photoset, reader, photos, tell, remarks)
    photoset = reader.photoset = as_read(photoset, photos)
    boards, observations = find_poses(photoset, camera, photos, remarks)
    return State(photoset, reader, camera, model, tuple(boards), tuple(observations), remarks, tell)


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


def as_printed(
    photoset: PhotoSet, reader: Reader, photos: Photos, remarks: Remarks
) -> tuple[PhotoSet, Photos]:
    """The set with the board as the photos show it, where that is no guess, and the photos with its corners there;
    InputError if its markers are others, or lie otherwise."""
    board = photoset.board
    if board is None:
        return photoset, photos
    photos = _not_mirrored(reader, photos, remarks)
    if photoset.camera.fixed:
        photos = _upright(photos, remarks)
    if isinstance(board, LooseMarkers):
        board, photos = _relisted(board, photos, remarks)
        photoset = reader.photoset = replace(photoset, board=board)
    fault = board_fault(board, reader, [one for one in photos.every if one.corners is not None])
    if fault is not None:
        raise InputError(photoset.folder / MANIFEST, fault)
    return photoset, photos


def _not_mirrored(reader: Reader, photos: Photos, remarks: Remarks) -> Photos:
    """Without photos that are stored mirrored, in which no marker is one."""
    names = mirrored_photos(reader, photos.every)
    for name in names:
        remarks.leave_out(name, "it is stored mirrored, against the other photos", "photo-mirrored")
    kept = (
        [one for one in part if one.view.name not in names]
        for part in (photos.samples, photos.probes, photos.boards)
    )
    return Photos(*kept)


def _upright(photos: Photos, remarks: Remarks) -> Photos:
    """A fixed camera's photos, those that are stored upside down turned back: their lens has its axis elsewhere."""
    still = [one for one in photos.samples + photos.probes if one.corners is not None]
    turned = turned_photos([(one.corners, one.size) for one in still if one.corners is not None])
    return _turned_back(photos, {still[k].view.name for k in turned}, remarks)


def _turned_back(photos: Photos, names: set[str], remarks: Remarks) -> Photos:
    tell_turned(sorted(names), remarks)
    return photos.replaced([upright(one) if one.view.name in names else one for one in photos.every])


def _lens_upright(photoset: PhotoSet, photos: Photos, camera: Camera, remarks: Remarks) -> Photos:
    """All photos with the lens's axis on the same side of the middle, the given camera's, if one is."""
    shown = [one for one in photos.every if one.corners is not None and one.size == camera.size]
    corners = [one.corners for one in shown if one.corners is not None]
    find = turned_against_lens if photoset.camera.matrix is None else turned_against_given
    names = {shown[k].view.name for k in find(camera, corners)}
    if photoset.camera.fixed:  # one and the same side, and those that are not were found before
        still = {one.view.name for one in photos.samples + photos.probes}
        told = [one.view.name for one in shown if one.view.name in still]
        most = 2 * sum(name in names for name in told) > len(told)
        names = names - still | (still if most else set())
    return _turned_back(photos, names, remarks)


def as_read(photoset: PhotoSet, photos: Photos) -> PhotoSet:
    """The set whose photos are turned as those of ``photos`` are."""
    seen = {photo.file: photo.turned for one in photos.every for photo in one.view.photos}
    return photoset.turned_to(p.file for p in photoset.photos if seen.get(p.file, p.turned))


def _relisted(board: LooseMarkers, photos: Photos, remarks: Remarks) -> tuple[LooseMarkers, Photos]:
    """Loose markers with their corners in the order that the photos show."""
    orders = listed_order(board, [one.corners for one in photos.every if one.corners is not None])
    if not orders:
        return board, photos
    board = reordered(board, orders)
    remarks.tell("marker-corner-order", order_warning(board, orders), amount=len(orders), allowed=True)
    points, every = board_points(board), []
    for one in photos.every:
        corners = one.corners
        every.append(
            one if corners is None else replace(one, corners=replace(corners, points=points[corners.ids]))
        )
    return board, photos.replaced(every)


def find_camera(
    photoset: PhotoSet, reader: Reader, photos: Photos, tell: Progress, remarks: Remarks
) -> tuple[Camera, CameraModel, Photos]:
    """The camera, given or fitted, and all corners placed as well as they can be with it."""
    size = photos.samples[0].size
    entry = photoset.camera
    if entry.matrix is not None:
        distortion = np.zeros(0) if entry.distortion is None else np.asarray(entry.distortion, float)
        camera = Camera(np.asarray(entry.matrix, float), distortion, size)
        closer = photos.replaced(look_closer(reader, camera, photos.every, tell, remarks))
        closer = _lens_upright(photoset, closer, camera, remarks)
        return camera, CameraModel(size, distortion, ()), closer
    start = quick_camera(_useful(photos.every, size), size)
    if start is None:
        raise InputError(
            photoset.folder / MANIFEST,
            "too few board corners in every photo to find the camera: give [camera] or calibration photos",
        )
    closer = photos.replaced(look_closer(reader, start, photos.every, tell, remarks))
    closer = _lens_upright(photoset, closer, start, remarks)
    return fitted_camera(closer, size, remarks, reader.workers)


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
    factor = max(1.0, float(robust.deviation(np.concatenate(z))))
    boards = tuple((name, replace(c, sigma=factor * c.sigma), pose) for name, c, pose in state.boards)
    still = sum(s.pose_block == FIXED_POSE for s in observations)
    for observation, corners in seen:
        # a still camera's photos repeat the errors of where the pixels cut the print
        alike = np.sqrt(still) if observation.pose_block == FIXED_POSE else 1.0
        observation.corners = replace(corners, sigma=alike * factor * corners.sigma)
    return replace(state, boards=boards, observations=tuple(observations))
