"""A folder's photos recognised: board, roles, brackets, flash, and where the sample stands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from photogonio.cache.glances import Glances
from photogonio.cache.store import default_store
from photogonio.calib.adjust.intrinsics import quick_camera
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.pose import fit_pose
from photogonio.calib.geometry.print_map import draw_print
from photogonio.calib.identify.covered import cover_of
from photogonio.calib.identify.lamp_glance import shrunk
from photogonio.calib.identify.layout import FoundBoard, find_board
from photogonio.calib.identify.quick_look import QuickLook, quick_look
from photogonio.calib.identify.sample import FoundSample, SamplePhoto, find_sample, shown_by
from photogonio.calib.identify.standing import Thing, showing, things
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import Header, read_header, read_image
from photogonio.capture.linear.alone import encoding_alone, gray_alone
from photogonio.capture.photoset import Board, CharucoBoard, GridBoard, Photo, PrintedBoard, Radiometry

JUDGED = 8  # photos that tell of the board
DARK = 0.004  # of white level: a photo whose bright parts are dimmer was taken with the cap on
NAMED_ROLES = ("dark", "flat", "ambient", "chart", "probe")  # which a name tells, and no picture
SAME_PLACE = 1e-3  # of its distance, by which a camera may have moved within a bracket
SAME_LIGHT = 0.06  # relative scatter of light in exposures of one bracket, about one curve of the other's
SMOOTHED = 5  # pixels' side over which both are averaged: noise, and codes in the dark, are no other light
CURVE = 100  # levels of that curve: a tone curve that nobody tells bends it
OTHER_EXPOSURE = 1.2  # times, by which exposures of a bracket differ
CHANGED = (0.5, 1.8)  # the photos' ratio over the stated one, as logarithms: tone curves are steep and flat

Tell = Callable[[str, int, int], None]


@dataclass(frozen=True, slots=True)
class Recognised:
    """What photos tell of a set."""

    photos: tuple[Photo, ...]  # with their roles and brackets
    found: FoundBoard | None
    sample: FoundSample | None
    camera: str = ""  # maker and model
    flash: tuple[str, ...] = ()  # photos that a flash lit, by EXIF
    unread: tuple[str, ...] = ()
    beside: tuple[Thing, ...] = ()  # what else stands on the board


def recognise(folder: Path, photos: Sequence[Photo], board: Board | None, tell: Tell) -> Recognised:
    """The photos with the roles that they show, the board unless it is given, and the sample."""
    glances = Glances(default_store())
    found = None if board is not None else _board(folder, photos, glances, tell)
    known = board if board is not None else found.board if found is not None else None
    headers = {p.file: h for p in photos if (h := _header(folder, p)) is not None}
    names = [h.camera for h in headers.values() if h.camera]
    flash = tuple(p.file for p in photos if p.file in headers and headers[p.file].flash)
    camera = max(set(names), key=names.count) if names else ""
    if not isinstance(known, CharucoBoard | GridBoard):
        return Recognised(tuple(photos), found, None, camera, flash)
    seen: dict[str, QuickLook] = {}
    unread = []
    for k, photo in enumerate(photos):
        tell("looking at the photos", k + 1, len(photos))
        try:
            seen[photo.file] = _glance(folder, photo, known, glances)
        except InputError:
            unread.append(photo.file)
    sized, sample, beside = _judged(photos, seen, known)
    lit = tuple(file for file in flash if any(p.file == file and p.role == "sample" for p in sized))
    return Recognised(sized, found, sample, camera, lit, tuple(unread), beside)


def _header(folder: Path, photo: Photo) -> Header | None:
    try:
        return read_header(folder / photo.file)
    except InputError:
        return None


def _board(folder: Path, photos: Sequence[Photo], glances: Glances, tell: Tell) -> FoundBoard | None:
    chosen = [photos[k] for k in np.unique(np.linspace(0, len(photos) - 1, JUDGED).astype(int))]
    seen = []
    for k, photo in enumerate(chosen):
        tell("looking for the board", k + 1, len(chosen))
        try:
            markers = _glance(folder, photo, None, glances).markers
        except InputError:
            continue
        if markers is not None:
            seen.append(markers)
    return find_board(seen)


def _glance(folder: Path, photo: Photo, board: Board | None, glances: Glances) -> QuickLook:
    encoding = encoding_alone(Radiometry())
    key = glances.key(folder / photo.file, encoding, "superpixel", board)
    seen = glances.get(key)
    if seen is None:
        seen = quick_look(*gray_alone(read_image(folder / photo.file), encoding), board)
        glances.put(key, seen)
    return seen


def _judged(
    photos: Sequence[Photo], seen: dict[str, QuickLook], board: PrintedBoard
) -> tuple[tuple[Photo, ...], FoundSample | None, tuple[Thing, ...]]:
    """Photos with their roles and brackets, the sample, and what stands beside it."""
    clear = {name: one for name, one in seen.items() if one.clear and one.corners is not None}
    sizes = [one.size for one in clear.values()]
    size = max(set(sizes), key=sizes.count) if sizes else (0, 0)
    same = {name: one for name, one in clear.items() if one.size == size}
    corners = [one.corners for one in same.values() if one.corners is not None]
    camera = quick_camera(corners, size) if corners else None
    dimmed = [_dark(p, seen.get(p.file)) for p in photos]
    if camera is None:
        return tuple(dimmed), None, ()
    laid, poses = _laid(dimmed, same, board, camera)
    shows = dict(zip(laid, showing([one.cover for one in laid.values()]), strict=True))
    one = next(iter(same.values()))
    small, print_ = shrunk(camera, one.step, one.small.shape), draw_print(board)
    sample = None
    for _ in range(2):  # once more if photos show what was found that were not thought to
        shown = [one for name, one in laid.items() if shows[name]]
        sample = find_sample(shown, small, print_) if shown else None
        if sample is None or not sample.placed:
            break
        told = shown_by(list(laid.values()), small, print_, sample.sample)
        judged = {name: shows[name] if say is None else say for name, say in zip(laid, told, strict=True)}
        if judged == shows or not any(judged.values()):
            break
        shows = judged
    result = [
        replace(p, role="sample" if shows[p.file] else "calibration") if p.file in shows else p
        for p in dimmed
    ]
    shown = [one for name, one in laid.items() if shows[name]]
    if not shown:
        return tuple(bracketed(result, poses, clear)), None, ()
    beside = tuple(things([one.cover for one in shown]))
    return tuple(bracketed(result, poses, clear)), sample, beside


def _laid(
    photos: Sequence[Photo], seen: dict[str, QuickLook], board: PrintedBoard, camera: Camera
) -> tuple[dict[str, SamplePhoto], dict[str, Pose]]:
    """Photos of the board or of a sample on it, laid over the board, and their poses, by name."""
    laid, poses = {}, {}
    for photo in photos:
        one = seen.get(photo.file)
        if one is None or one.corners is None or photo.role not in ("sample", "calibration"):
            continue
        fit = fit_pose(camera, one.corners)
        if fit is not None:
            small = shrunk(camera, one.step, one.small.shape)
            cover = cover_of(board, one.small, small, fit.pose)
            poses[photo.file] = fit.pose
            laid[photo.file] = SamplePhoto(one.small, fit.pose, cover)
    return laid, poses


def _dark(photo: Photo, one: QuickLook | None) -> Photo:
    if one is not None and photo.role == "sample" and one.white < DARK and not one.clear:
        return replace(photo, role="dark")
    return photo


def bracketed(photos: Sequence[Photo], poses: dict[str, Pose], seen: dict[str, QuickLook]) -> list[Photo]:
    """Photos one after another that show the same view in the same light at other exposures, with bracket numbers;
    those that have one keep it."""
    number = max((p.bracket for p in photos if p.bracket is not None), default=0)
    result: list[Photo] = []
    for photo in photos:
        last = result[-1] if result else None
        if last is not None and photo.bracket is None and _same_view(last, photo, poses, seen):
            if last.bracket is None:
                number += 1
                result[-1] = replace(last, bracket=number)
            photo = replace(photo, bracket=result[-1].bracket)
        result.append(photo)
    return result


def _same_view(a: Photo, b: Photo, poses: dict[str, Pose], seen: dict[str, QuickLook]) -> bool:
    if a.role != "sample" or b.role != "sample" or a.light != b.light:
        return False
    if a.exposure_time is None or b.exposure_time is None or a.file not in poses or b.file not in poses:
        return False
    ratio = b.exposure_time / a.exposure_time
    if max(ratio, 1 / ratio) < OTHER_EXPOSURE:
        return False
    moved = np.linalg.norm(poses[a.file].center - poses[b.file].center)
    if moved > SAME_PLACE * np.linalg.norm(poses[a.file].center):
        return False
    one, other = seen[a.file], seen[b.file]
    usable = ~one.full & ~other.full & (one.small > 0.02) & (other.small > 0.02)
    if usable.sum() < 1000:
        return False
    before, after = (np.log(cv2.blur(p.small, (SMOOTHED, SMOOTHED))[usable]) for p in (one, other))
    share = float(np.median(after - before)) / float(np.log(ratio))
    return CHANGED[0] < share < CHANGED[1] and _scatter(before, after) < SAME_LIGHT


def _scatter(before: np.ndarray, after: np.ndarray) -> float:
    """Of ``after`` (n,) about its median among those of alike ``before`` (n,)."""
    order = np.argsort(before, kind="stable")
    off = [np.abs(part - np.median(part)) for part in np.array_split(after[order], CURVE)]
    return float(np.median(np.concatenate(off)))
