"""The camera from photos of the board: pinhole and as few distortion terms as the photos ask for."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from calib.board import Corners
from calib.camera import Camera
from calib.pose import fit_pose

_FREE_NONE = cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST
MODELS: dict[str, int] = {
    "none": _FREE_NONE,
    "k1": cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    "k1 k2": cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    "k1 k2 p1 p2": cv2.CALIB_FIX_K3,
    "k1 k2 p1 p2 k3": 0,
    "rational": cv2.CALIB_RATIONAL_MODEL,
}
_FOLDS = 5
_MOST = 16  # photos that judge the models; all of them then fit the chosen one
_SAME = 1.01  # a held-out residual within this factor of the best counts as equal: the simpler model is taken
_FEWEST = 6  # corners a photo needs


@dataclass(frozen=True, slots=True)
class CameraFit:
    """A camera and how it was found."""

    camera: Camera
    model: str
    rms: float  # pixels, over both coordinates together (OpenCV's)
    standard_errors: np.ndarray  # (4 + 5 or more,) fx, fy, cx, cy, then distortion
    scores: dict[str, float]  # held-out rms of each model tried, pixels
    used: np.ndarray  # (photos,) bool


def fit_camera(views: list[Corners], size: tuple[int, int]) -> CameraFit | None:
    """The camera from the corners of several photos; None if fewer than one photo shows enough of them.

    The model is the first of ``MODELS`` whose error on left-out photos is as good as the best.
    """
    enough = np.array([len(v) >= _FEWEST for v in views])
    good = [v for v, e in zip(views, enough, strict=True) if e]
    if not good:
        return None
    scores = {}
    judges = [good[k] for k in np.unique(np.linspace(0, len(good) - 1, _MOST).astype(int))]
    names = list(MODELS) if len(good) >= 4 else ["none", "k1", "k1 k2"][: len(good)]
    for name in names:
        scores[name] = _held_out(judges, size, MODELS[name])
    least = min(scores.values())
    model = next(n for n, s in scores.items() if s <= least * _SAME) if np.isfinite(least) else "none"
    flags = MODELS[model]
    if len(good) < 3:
        flags |= cv2.CALIB_FIX_PRINCIPAL_POINT | cv2.CALIB_FIX_ASPECT_RATIO
    rms, camera, errors = _calibrate(good, size, flags)
    return CameraFit(camera, model, rms, errors, scores, enough)


def _calibrate(views: list[Corners], size: tuple[int, int], flags: int) -> tuple[float, Camera, np.ndarray]:
    points = [np.ascontiguousarray(v.points, np.float32).reshape(-1, 1, 3) for v in views]
    pixels = [np.ascontiguousarray(v.pixels, np.float32).reshape(-1, 1, 2) for v in views]
    rms, matrix, distortion, _, _, errors, _, _ = cv2.calibrateCameraExtended(
        points, pixels, size, None, None, flags=flags
    )
    distortion = np.asarray(distortion, float).reshape(-1)[: 8 if flags & cv2.CALIB_RATIONAL_MODEL else 5]
    return float(rms), Camera(matrix, distortion, size), np.asarray(errors, float).reshape(-1)


def _held_out(views: list[Corners], size: tuple[int, int], flags: int) -> float:
    """Rms residual of photos left out one after the other, their pose fitted, pixels."""
    folds = np.array_split(np.arange(len(views)), min(_FOLDS, len(views)))
    if len(folds) < 2:
        return _calibrate(views, size, flags | cv2.CALIB_FIX_PRINCIPAL_POINT | cv2.CALIB_FIX_ASPECT_RATIO)[0]
    squares: list[np.ndarray] = []
    for fold in folds:
        rest = [v for k, v in enumerate(views) if k not in fold]
        _, camera, _ = _calibrate(rest, size, flags)
        for k in fold:
            fit = fit_pose(camera, views[k])
            if fit is None:
                return float("inf")
            miss = camera.project(fit.pose, views[k].points) - views[k].pixels
            squares.append((miss[fit.inlier] ** 2).sum(1))
    return float(np.sqrt(np.concatenate(squares).mean()))


def quick_camera(views: list[Corners], size: tuple[int, int]) -> Camera | None:
    """A camera good enough to lay the print over the photos: two radial terms, a few photos."""
    good = [v for v in views if len(v) >= _FEWEST]
    if not good:
        return None
    judges = [good[k] for k in np.unique(np.linspace(0, len(good) - 1, _MOST).astype(int))]
    flags = MODELS["k1 k2"] if len(judges) >= 3 else MODELS["none"]
    if len(judges) < 3:
        flags |= cv2.CALIB_FIX_PRINCIPAL_POINT | cv2.CALIB_FIX_ASPECT_RATIO
    return _calibrate(judges, size, flags)[1]


def free_terms(flags: int) -> tuple[int, ...]:
    """Indices into OpenCV's distortion vector that ``flags`` of ``MODELS`` leave free."""
    free = [k for k, bit in ((0, cv2.CALIB_FIX_K1), (1, cv2.CALIB_FIX_K2)) if not flags & bit]
    free += [] if flags & cv2.CALIB_ZERO_TANGENT_DIST else [2, 3]
    free += [] if flags & cv2.CALIB_FIX_K3 else [4]
    return tuple(free + ([5, 6, 7] if flags & cv2.CALIB_RATIONAL_MODEL else []))
