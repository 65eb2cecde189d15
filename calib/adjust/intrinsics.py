"""The camera from photos of the board: pinhole and as few distortion terms as the photos ask for."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import cv2
import numpy as np

from photogonio.calib.geometry.board import Corners
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.geometry.pose import fit_pose
from photogonio.calib.parallel import abreast
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import MANIFEST

_PINHOLE = cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST
_ONE_TERM = cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST
MODELS: dict[str, int] = {
    "square pixels": _PINHOLE | cv2.CALIB_FIX_ASPECT_RATIO,
    "square pixels, k1": _ONE_TERM | cv2.CALIB_FIX_ASPECT_RATIO,
    "pinhole": _PINHOLE,
    "k1": _ONE_TERM,
    "k1 k2": cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    "k1 k2 p1 p2": cv2.CALIB_FIX_K3,
    "k1 k2 p1 p2 k3": 0,
    "rational": cv2.CALIB_RATIONAL_MODEL,
}
_FEW = ("square pixels", "square pixels, k1")  # models for fewer than four photos
_CENTRED = cv2.CALIB_FIX_PRINCIPAL_POINT | cv2.CALIB_FIX_ASPECT_RATIO  # for fewer than three
_FOLDS = 5
_MOST = 16  # photos that judge the models; all of them then fit the chosen one
_SAME = 1.02  # a held-out residual within this factor counts as equal
_WORTH = 10.0  # drop of the squared residual, in its expected size for a useless term, that a term must bring
_FEWEST = 6  # corners a photo needs
_UNSEEN = (
    "no camera sees its corners where the photos show them: the print is not as the manifest says (lengths, places of "
    "markers, squares, ids)"
)
# steps, and the relative size of the last: far below what corners can tell
_STOP = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 1e-7)


@contextmanager
def _one_thread() -> Iterator[None]:
    """OpenCV on one thread: with more, calibrateCamera adds up in the order of the threads, and no two runs agree."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)


@dataclass(frozen=True, slots=True)
class CameraFit:
    """A camera and how it was found."""

    camera: Camera
    model: str
    rms: float  # pixels, over both coordinates together (OpenCV's)
    standard_errors: (
        np.ndarray
    )  # (4 + k,) fx, fy, cx, cy, then distortion, photos taken as the independent units
    scores: dict[str, float]  # held-out rms of the model, and of those that it was compared with, pixels
    used: np.ndarray  # (photos,) bool
    square: bool  # fx = fy was held
    centred: bool  # so was the principal point, in the picture's middle


@_one_thread()
def fit_camera(views: list[Corners], size: tuple[int, int], workers: int = 1) -> CameraFit | None:
    """The camera from the corners of several photos; None if fewer than one photo shows enough of them. As many
    models as there are ``workers`` are fitted side by side.

    The model is the simplest that no larger one beats: a larger one must lower the squared residual by ten times
    what as many useless terms would, and must not do worse on photos it has not seen.
    """
    enough = np.array([len(v) >= _FEWEST for v in views])
    good = [v for v, e in zip(views, enough, strict=True) if e]
    if not good:
        return None
    names = list(MODELS) if len(good) >= 4 else list(_FEW)
    extra = 0 if len(good) >= 3 else _CENTRED
    judges = [good[k] for k in np.unique(np.linspace(0, len(good) - 1, _MOST).astype(int))]
    fitted = abreast(lambda n: _calibrate(good, size, MODELS[n] | extra), names, workers)
    fits = dict(zip(names, fitted, strict=True))
    held_out: dict[str, float] = {}

    def unseen(name: str) -> float:
        """Of few models it is asked: the larger ones take longest."""
        if name not in held_out:
            held_out[name] = _held_out(judges, size, MODELS[name] | extra, fits[name][1], workers)
        return held_out[name]

    count = 2 * sum(len(v) for v in good)
    model = names[-1]
    for k, name in enumerate(names):
        better = [
            n for n in names[k + 1 :] if _beats(fits[n][0], fits[name][0], count, _terms(n) - _terms(name))
        ]
        if not any(unseen(n) < unseen(name) * _SAME for n in better):
            model = name
            break
    unseen(model)
    rms, camera, errors = fits[model]
    flags = MODELS[model] | extra
    scatter = _jackknife(good, size, flags, camera, workers)
    return CameraFit(
        camera,
        model,
        rms,
        np.maximum(errors[: len(scatter)], scatter),
        held_out,
        enough,
        bool(flags & cv2.CALIB_FIX_ASPECT_RATIO),
        bool(flags & cv2.CALIB_FIX_PRINCIPAL_POINT),
    )


def _jackknife(
    views: list[Corners], size: tuple[int, int], flags: int, near: Camera, workers: int
) -> np.ndarray:
    """Standard errors (4 + k,) from leaving groups of photos out (Efron and Tibshirani, 1993, ch. 11)."""
    groups = min(_FOLDS, len(views))
    if groups < 3:
        return np.zeros(9)

    def without(k: int) -> list[float]:
        _, camera, _ = _calibrate([v for n, v in enumerate(views) if n % groups != k], size, flags, near)
        matrix = camera.matrix
        return [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *camera.distortion]

    parts = list(abreast(without, range(groups), workers))
    off = np.array(parts) - np.mean(parts, axis=0)
    return np.sqrt((groups - 1) / groups * (off**2).sum(0))


def _terms(name: str) -> int:
    return len(free_terms(MODELS[name])) - bool(MODELS[name] & cv2.CALIB_FIX_ASPECT_RATIO)


def _beats(larger: float, smaller: float, count: int, terms: int) -> bool:
    """Whether an rms is lower by more than ``terms`` useless terms could make it, ten times over."""
    return count * ((smaller / larger) ** 2 - 1) > _WORTH * max(terms, 1)


def _calibrate(
    views: list[Corners], size: tuple[int, int], flags: int, near: Camera | None = None
) -> tuple[float, Camera, np.ndarray]:
    """Rms, camera and standard errors of a model, found from scratch, or from that of the same model ``near`` it."""
    points = [np.ascontiguousarray(v.points, np.float32).reshape(-1, 1, 3) for v in views]
    pixels = [np.ascontiguousarray(v.pixels, np.float32).reshape(-1, 1, 2) for v in views]
    start = (np.eye(3), None) if near is None else (near.matrix.copy(), near.distortion.copy())
    begun = flags if near is None else flags | cv2.CALIB_USE_INTRINSIC_GUESS
    try:
        rms, matrix, distortion, _, _, errors, _, _ = cv2.calibrateCameraExtended(  # type: ignore[call-overload]  # no start
            points, pixels, size, *start, flags=begun, criteria=_STOP
        )
    except cv2.error as error:
        raise InputError(f"{MANIFEST}: [board]", _UNSEEN) from error
    distortion = np.asarray(distortion, float).reshape(-1)[: 8 if flags & cv2.CALIB_RATIONAL_MODEL else 5]
    return float(rms), Camera(matrix, distortion, size), np.asarray(errors, float).reshape(-1)


def _held_out(views: list[Corners], size: tuple[int, int], flags: int, near: Camera, workers: int) -> float:
    """Rms residual of photos left out one after the other, their pose fitted, pixels."""
    folds = np.array_split(np.arange(len(views)), min(_FOLDS, len(views)))
    if len(folds) < 2:
        return _calibrate(views, size, flags, near)[0]

    def left_out(fold: np.ndarray) -> list[np.ndarray] | None:
        rest = [v for k, v in enumerate(views) if k not in fold]
        _, camera, _ = _calibrate(rest, size, flags, near)
        squares: list[np.ndarray] = []
        for k in fold:
            fit = fit_pose(camera, views[k])
            if fit is None:
                return None
            miss = camera.project(fit.pose, views[k].points) - views[k].pixels
            squares.append((miss[fit.inlier] ** 2).sum(1))
        return squares

    found = list(abreast(left_out, folds, workers))
    if any(one is None for one in found):
        return float("inf")
    return float(np.sqrt(np.concatenate([part for one in found if one for part in one]).mean()))


@_one_thread()
def quick_camera(views: list[Corners], size: tuple[int, int]) -> Camera | None:
    """A camera good enough to lay the print over the photos: two radial terms, a few photos."""
    good = [v for v in views if len(v) >= _FEWEST]
    if not good:
        return None
    judges = [good[k] for k in np.unique(np.linspace(0, len(good) - 1, _MOST).astype(int))]
    flags = MODELS["k1 k2"] if len(judges) >= 4 else MODELS["square pixels"]
    if len(judges) < 3:
        flags |= _CENTRED
    rms, camera, _ = _calibrate(judges, size, flags)
    if (
        len(judges) >= 4
    ):  # of photos that are all alike, as of a camera that stands still, many terms may not settle
        simple, fewer, _ = _calibrate(judges, size, MODELS["square pixels, k1"] | _CENTRED)
        camera = fewer if simple < rms else camera
    return camera


def free_terms(flags: int) -> tuple[int, ...]:
    """Indices into OpenCV's distortion vector that ``flags`` of ``MODELS`` leave free."""
    free = [k for k, bit in ((0, cv2.CALIB_FIX_K1), (1, cv2.CALIB_FIX_K2)) if not flags & bit]
    free += [] if flags & cv2.CALIB_ZERO_TANGENT_DIST else [2, 3]
    free += [] if flags & cv2.CALIB_FIX_K3 else [4]
    return tuple(free + ([5, 6, 7] if flags & cv2.CALIB_RATIONAL_MODEL else []))
