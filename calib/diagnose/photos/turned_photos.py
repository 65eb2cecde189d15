"""Photos that are stored upside down, or mirrored, against the others.

A photo that was focused or zoomed otherwise than the rest misses in much the same way; where a focal length of its own
for each photo explains them better, sides are judged with that.

The lens's axis does not go through the middle of the picture; in a photo stored turned by half a turn it goes through
on the other side. A still camera's photo shows the board elsewhere. A moving camera's pose takes up nearly all of it,
but what is left tells: each photo by itself says on which side of the middle the axis lies, through the print's
perspective and the lens's distortion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from photogonio.calib.detect.corners import searched_corners
from photogonio.calib.detect.gray import detection_image, without_fireflies
from photogonio.calib.detect.photo_reader import Reader, Seen
from photogonio.calib.geometry.board import FEWEST_CORNERS, Corners
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.geometry.pose import fit_pose
from photogonio.capture.photoset import View

_MANY, _MINORITY = 4, 0.4  # photos that tell which are turned, and the share of a still camera's that may be
# of the picture's longer side, by which a still camera's photos show the board apart at the most
_ASIDE = 0.01
# share of the most markers in a photo that are seen by mistake in a mirrored one; markers that its mirror image shows
_HARDLY, _FEWEST = 0.15, 3
_POSE = 6  # numbers of a pose
_EVEN, _ODD = 4, 4  # fx, fy, k1, k2; and what half a turn changes the sign of: cx, cy, p1, p2
# of them in the slopes of projectPoints, after rotation and translation
_COLUMNS = (6, 7, 10, 11, 8, 9, 12, 13)
_SIDES = 16  # directions of the axis that are begun with
_ROUNDS, _PRINTS = 20, 6
# squared standard errors by which a turned photo must be nearer the axis on the other side, and the middle one of all
# photos on its own: else the axis goes too near the middle for anything to be amiss. More than a few photos are accused
# where it does so plainly: a print with errors of its own may pass for it
_SURE, _TELLING, _PLAINLY, _FEW = 16.0, 30.0, 300.0, 1.0 / 3.0
# of what each photo says of the axis over what all say: in the middle; of a turned one
_SPREAD, _LEAST = 0.35, 0.5
_FOCALS, _ZOOMED = 4, 9.0  # steps to a photo's own focal length; squared standard errors by which it has one
_OWN = 2.0  # squared standard errors a photo, by which focal lengths of their own must explain them better


def upright(one: Seen) -> Seen:
    """A photo with its corners as they are once it is turned by half a turn; its own inverse."""
    view = View(tuple(replace(photo, turned=not photo.turned) for photo in one.view.photos))
    corners = one.corners
    if corners is None:
        return replace(one, view=view, around=None)
    last = np.array(one.size) - 1.0
    about = replace(corners, pixels=last - corners.pixels, marker_pixels=last - corners.marker_pixels)
    return replace(one, view=view, corners=about, around=None)


def turned_photos(seen: Sequence[tuple[Corners, tuple[int, int]]]) -> list[int]:
    """Which of a fixed camera's photos, by number, show the board where the others do once they are turned by half a
    turn; none where they are not a minority."""
    corners = [one for one, _ in seen if len(one) >= FEWEST_CORNERS]
    if len(corners) < _MANY:
        return []
    ids, pixels = (np.concatenate([getattr(one, name) for one in corners]) for name in ("ids", "pixels"))
    middle = {int(k): np.median(pixels[ids == k], axis=0) for k in np.unique(ids)}
    found = []
    for k, (one, size) in enumerate(seen):
        if len(one) < FEWEST_CORNERS:
            continue
        usual = np.array([middle[int(n)] for n in one.ids])
        as_is = np.median(np.linalg.norm(one.pixels - usual, axis=1))
        about = np.median(np.linalg.norm(np.array(size) - 1 - one.pixels - usual, axis=1))
        if about < _ASIDE * max(size) < as_is:
            found.append(k)
    return found if len(found) < _MINORITY * len(corners) else []


def mirrored_photos(reader: Reader, seen: Sequence[Seen]) -> list[str]:
    """Names of the photos with hardly a marker in whose mirror image there are about as many as the others show."""
    board = reader.photoset.board
    counts = [0 if one.corners is None else len(one.corners.marker_ids) for one in seen]
    usual, found = max(counts, default=0), []
    if board is None or usual <= _FEWEST:
        return []
    for one, count in zip(seen, counts, strict=True):
        shown = None if count > _HARDLY * usual else reader.level(one.view)
        if shown is None:
            continue
        image = np.ascontiguousarray(detection_image(without_fireflies(shown[0]))[:, ::-1])
        there = len(searched_corners(board, image, thorough=False).marker_ids)
        if there > max(_FEWEST, 0.5 * usual):
            found.append(one.view.name)
    return found


@dataclass(frozen=True, slots=True)
class _Shown:
    """One photo's corners beside where its own pose puts them, and how that moves with all else."""

    ids: np.ndarray  # (n,)
    miss: np.ndarray  # (2 n,) pixels
    pose: np.ndarray  # (2 n, 6) orthonormal: what its pose takes up
    zoomed: np.ndarray  # (2 n, 7) the same with a focal length of its own
    lens: np.ndarray  # (2 n, 8) by what half a turn leaves, and by what it changes the sign of
    print: np.ndarray  # (n, 2, 2) by the corner's place on the board


@dataclass(frozen=True, slots=True)
class _Told:
    """What one photo, its pose left free, says of the lens: the quadratic form of its squared residual."""

    normal: np.ndarray  # (8, 8)
    slope: np.ndarray  # (8,)
    square: float  # at the lens that it is developed about
    freedom: int

    @property
    def odd(self) -> np.ndarray:
        """What it alone says of cx and cy, (2,)."""
        at = slice(_EVEN, _EVEN + 2)
        return np.linalg.lstsq(self.normal[at, at], self.slope[at], rcond=None)[0]


@dataclass(frozen=True, slots=True)
class _Sides:
    """Of all photos (n,), on which side they have the axis."""

    side: np.ndarray  # (n,) +1 or -1
    share: np.ndarray  # (n,) what each says of the axis over what all say
    sure: np.ndarray  # (n,) by how much its squared residual is less than on the other side
    left: float  # squared residual of all
    variance: float


def turned_against_lens(camera: Camera, seen: Sequence[Corners]) -> list[int]:
    """Which photos, by number, have the lens's axis on the other side of the picture's middle than most; none where the
    photos do not tell, as where the axis goes through the middle.

    ``camera`` is one whose focal length and radial distortion are about right.
    """
    middle = _centred(camera)
    found = {k: shown for k, one in enumerate(seen) if (shown := _shown(middle, one)) is not None}
    if len(found) < _MANY:
        return []
    photos = list(found.values())
    one, own = _sides_of(photos), _sides_of([replace(photo, pose=photo.zoomed) for photo in photos])
    # photos that were focused or zoomed otherwise would pass for turned ones
    if one.left - own.left > _OWN * len(photos) * own.variance:
        one = own
    turned = one.side < 0
    if turned.sum() * 2 > len(turned):
        turned = ~turned
    least = (_TELLING if turned.mean() < _FEW else _PLAINLY) * one.variance
    if not turned.any() or np.median(one.sure) < least or np.median(np.abs(one.share - 1.0)) > _SPREAD:
        return []
    certain = (one.sure > _SURE * one.variance) & (one.share > _LEAST)
    return [k for k, about in zip(found, turned & certain, strict=True) if about]


def _sides_of(photos: Sequence[_Shown]) -> _Sides:
    """On which side each photo has the axis, with the print's own errors, which all share: they would pass for the
    lens's."""
    offset = np.zeros((max(int(one.ids.max()) for one in photos) + 1, 2))
    for _ in range(_PRINTS):
        told = [_told(one, offset) for one in photos]
        side, lens, left = _best_sides(told)
        offset = offset + _misprint(photos, offset, side, lens)
    share, sure = _sided(told, side, lens)
    return _Sides(side, share, sure, left, left / max(sum(one.freedom for one in told) - _EVEN - _ODD, 1))


def turned_against_given(camera: Camera, seen: Sequence[Corners]) -> list[int]:
    """Which photos, by number, a given camera sees nearer their places once they are turned by half a turn."""
    last, found = np.array(camera.size) - 1.0, []
    for k, one in enumerate(seen):
        as_is, about = (fit_pose(camera, replace(one, pixels=p)) for p in (one.pixels, last - one.pixels))
        if as_is is None or about is None or about.inlier.sum() < as_is.inlier.sum():
            continue
        count = 2 * int(about.inlier.sum()) - _POSE
        if count <= 0 or count * ((as_is.rms / about.rms) ** 2 - 1.0) <= _SURE:
            continue
        free = [_of_own_focal(camera, replace(one, pixels=p)) for p in (one.pixels, last - one.pixels)]
        zoomed = count * (0.5 * about.rms**2 / min(free) - 1.0) > _ZOOMED
        if not zoomed or count * (free[0] / free[1] - 1.0) > _SURE:
            found.append(k)
    return found


def _of_own_focal(camera: Camera, corners: Corners) -> float:
    """The mean squared residual, in pixels, with the focal length that suits this photo best."""
    mean = np.inf
    for _ in range(_FOCALS):
        shown = _shown(camera, corners)
        if shown is None:
            break
        own = shown.lens[:, :2] @ np.diag(camera.matrix)[:2]
        own = own - shown.pose @ (shown.pose.T @ own)
        mean = min(mean, float(np.mean(shown.miss**2)))
        matrix = camera.matrix.copy()
        matrix[:2, :2] *= 1.0 + float(own @ shown.miss) / max(float(own @ own), 1e-300)
        camera = Camera(matrix, camera.distortion, camera.size)
    return mean


def _centred(camera: Camera) -> Camera:
    """The camera with its axis through the picture's middle."""
    matrix, distortion = camera.matrix.copy(), np.zeros(5)
    matrix[:2, 2] = 0.5 * (np.array(camera.size) - 1.0)
    distortion[:2] = camera.distortion[:2] if camera.distortion.size else 0.0
    return Camera(matrix, distortion, camera.size)


def _shown(camera: Camera, corners: Corners) -> _Shown | None:
    fit = fit_pose(camera, corners)
    if fit is None or 2 * fit.inlier.sum() <= _POSE:
        return None
    points = np.ascontiguousarray(corners.points[fit.inlier]).reshape(-1, 1, 3)
    there, slopes = cv2.projectPoints(
        points, fit.pose.rodrigues(), fit.pose.translation, camera.matrix, camera.distortion
    )
    miss = (corners.pixels[fit.inlier] - there.reshape(-1, 2)).ravel()
    pose, _ = np.linalg.qr(slopes[:, :_POSE])
    own = slopes[:, _COLUMNS[:2]] @ np.diag(camera.matrix)[:2]
    zoomed, _ = np.linalg.qr(np.column_stack([slopes[:, :_POSE], own]))
    board = slopes[:, _POSE // 2 : _POSE].reshape(-1, 2, 3) @ fit.pose.rotation[:, :2]
    return _Shown(corners.ids[fit.inlier], miss, pose, zoomed, slopes[:, _COLUMNS], board)


def _told(shown: _Shown, offset: np.ndarray) -> _Told:
    """With every corner of the print ``offset`` (k, 2) beside its place."""
    design, miss = shown.lens, shown.miss - (shown.print @ offset[shown.ids][..., None]).ravel()
    design = design - shown.pose @ (shown.pose.T @ design)
    miss = miss - shown.pose @ (shown.pose.T @ miss)
    return _Told(design.T @ design, design.T @ miss, float(miss @ miss), len(miss) - shown.pose.shape[1])


def _misprint(photos: Sequence[_Shown], offset: np.ndarray, side: np.ndarray, lens: np.ndarray) -> np.ndarray:
    """By how much farther (k, 2) the print's corners lie from their places, by what is left in all photos."""
    normal = np.broadcast_to(1e-12 * np.eye(2), (len(offset), 2, 2)).copy()
    slope = np.zeros((len(offset), 2))
    for one, s in zip(photos, side, strict=True):
        left = one.miss - (one.print @ offset[one.ids][..., None]).ravel() - one.lens @ (_flipped(s) * lens)
        left = (left - one.pose @ (one.pose.T @ left)).reshape(-1, 2, 1)
        turned = one.print.transpose(0, 2, 1)
        np.add.at(normal, one.ids, turned @ one.print)
        np.add.at(slope, one.ids, (turned @ left)[..., 0])
    return np.linalg.solve(normal, slope[..., None])[..., 0]


def _flipped(side: float) -> np.ndarray:
    return np.concatenate([np.ones(_EVEN), np.full(_ODD, side)])


def _best_sides(photos: Sequence[_Told]) -> tuple[np.ndarray, np.ndarray, float]:
    """Which side (n,), +1 or -1, each photo has the axis on, the lens (8,), and the squared residual that is left: the
    least of what is found from several beginnings."""
    alone = np.array([one.odd for one in photos])
    angles = np.pi * np.arange(_SIDES) / _SIDES
    starts = [np.ones(len(photos))]
    starts += [np.where(alone @ [np.cos(a), np.sin(a)] < 0, -1.0, 1.0) for a in angles]
    return min((_settled(photos, start) for start in starts), key=lambda found: found[2])


def _settled(photos: Sequence[_Told], side: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """The lens by the sides, and the sides by the lens, until neither moves."""
    for _ in range(_ROUNDS):
        signs = np.array([_flipped(s) for s in side])
        normal = sum(np.outer(s, s) * one.normal for s, one in zip(signs, photos, strict=True))
        slope = np.sum([s * one.slope for s, one in zip(signs, photos, strict=True)], axis=0)
        lens = np.linalg.lstsq(normal, slope, rcond=None)[0]
        after = np.where(_nearer(photos, lens) < 0, -1.0, 1.0)
        if np.array_equal(after, side):
            break
        side = after
    return side, lens, float(sum(one.square for one in photos) - slope @ lens)


def _nearer(photos: Sequence[_Told], lens: np.ndarray) -> np.ndarray:
    """By how much (n,) the squared residual is less with the axis where ``lens`` has it than on the other side."""
    even, odd = lens[:_EVEN], lens[_EVEN:]
    return np.array([4.0 * odd @ (one.slope[_EVEN:] - one.normal[_EVEN:, :_EVEN] @ even) for one in photos])


def _sided(photos: Sequence[_Told], side: np.ndarray, lens: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What each photo says of the axis over what the lens does (n,), 1 where they agree; and :func:`_nearer` on its own
    side."""
    sure, odd = side * _nearer(photos, lens), lens[_EVEN:]
    expected = np.array([4.0 * odd @ one.normal[_EVEN:, _EVEN:] @ odd for one in photos])
    return sure / np.maximum(expected, 1e-300), sure
