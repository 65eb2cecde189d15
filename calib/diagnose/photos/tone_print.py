"""What one photo's print shows of its tone curve: black beside white, and how white grows with the light on it."""

from __future__ import annotations

from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from photogonio.calib.adjust.lamps import sight_rays
from photogonio.calib.detect.mirror_rays import meet
from photogonio.calib.detect.observation import Observation, light_entry
from photogonio.calib.detect.paper import PaperSamples, paper_places, sample_paper
from photogonio.calib.detect.photo_reader import Reader
from photogonio.calib.diagnose.photos.veiling_glare import enough_print, evenly_lit
from photogonio.calib.geometry.board import board_size
from photogonio.calib.geometry.camera import Camera
from photogonio.capture import robust
from photogonio.capture.jit import jit
from photogonio.capture.photoset import PhotoSet

_SPREAD = 0.06  # standard deviation of the logarithm of light over the paper that tells a power
_SAMPLES = 300
_ROUNDS, _WILD = 30, 3.0
# samples of a small print along the board, pixels between white or black and its edges, radii of mirror balls away, and
# white samples beside a black one
_ACROSS, _CLOSE, _APART, _BESIDE = 180, (1.0, 2.0), 3.0, 8
_CLEAR = 0.3  # of the paper's clearest part: a power that fits less of it is none
# of the brightest white about a small print's black, what the darkest must be, for no shadow's edge to run between; and
# noise that it may have
_EVEN, _NOISY = 0.7, 0.03

Pairs = tuple[np.ndarray, np.ndarray]  # black and the white beside, (n, c) each


def black_share(black: np.ndarray, white: np.ndarray) -> float:
    """Radiance of black print over that of the white beside it, (n, c) each, the median; NaN where they cannot be
    compared."""
    lit = white.mean(1) > 0
    return float(np.median(black[lit].mean(1) / white[lit].mean(1))) if lit.any() else float("nan")


def black_and_white(samples: PaperSamples) -> Pairs | None:
    """Black print and what the white beside it says is white there; None where they cannot be compared."""
    if not enough_print(samples):
        return None
    dark, beside, _ = evenly_lit(samples)
    return samples.value[dark], beside


def close_print(photoset: PhotoSet, camera: Camera, one: Observation, reader: Reader) -> PaperSamples | None:
    """White and black of a small print, however close to edges; None if it shows too little. Blurred, white is a tenth
    darker at the most."""
    if photoset.board is None:
        return None
    step = float(board_size(photoset.board).max()) / _ACROSS
    places = paper_places(photoset, camera, one.pose, step=step, apart=_APART, clear_of_edges=_CLOSE)
    samples = None if places is None else sample_paper(places, partial(reader.near, one.view))
    if samples is None or samples.white.sum() < _BESIDE or samples.white.all():
        return None
    return samples


def black_and_brightest(samples: PaperSamples) -> Pairs:
    """Black print that no shadow's edge is near, and the brightest white beside it, where that is well above noise."""
    lit, dark = samples.keep(samples.white), samples.keep(~samples.white)
    tree, level = cKDTree(lit.points[:, :2]), lit.value.mean(1)
    far, near = tree.query(dark.points[:, :2], k=_BESIDE)
    brightest = near[np.arange(len(near)), level[near].argmax(1)]
    # as far as black goes on, so that white on its other side has a say
    reach = 2.0 * float(far[:, 0].max(initial=0.0))
    darkest = _least_about(dark.points, lit.points, level, reach)
    noise = np.sqrt(lit.variance.mean(1) / lit.value.shape[1])
    good = (darkest > _EVEN * level[brightest]) & (noise[brightest] < _NOISY * level[brightest])
    return dark.value[good], lit.value[brightest[good]]


def _least_about(middle: np.ndarray, places: np.ndarray, level: np.ndarray, reach: float) -> np.ndarray:
    """The least ``level`` (m,), inf of none, of ``places`` (m, 3) no farther than ``reach`` along the board from each
    ``middle`` (n, 3)."""
    order = np.argsort(places[:, 1], kind="stable")
    first = np.searchsorted(places[order, 1], middle[:, 1] - reach)
    least = np.full(len(middle), np.inf)
    _fill_least(middle, places[order], level[order], reach, first, least)
    return least


@jit
def _fill_least(middle, places, level, reach, first, least):
    """The same, of places in the order of their y from the ``first`` (n,) on."""
    for i in range(len(middle)):
        for k in range(first[i], len(places)):
            across, along = places[k, 0] - middle[i, 0], places[k, 1] - middle[i, 1]
            if along > reach:
                break
            if across**2 + along**2 <= reach**2:
                least[i] = min(least[i], level[k])


def seen_power(
    photoset: PhotoSet, camera: Camera, one: Observation, samples: PaperSamples, level: np.ndarray
) -> float | None:
    """By which power white paper, of ``samples`` with gray levels (n,), grows with the light of a lamp whose place is
    known whatever it shows."""
    place = lamp_place(photoset, camera, one)
    white = samples.white
    return None if place is None else power_of_light(samples.points[white], level[white], place)


def lamp_place(photoset: PhotoSet, camera: Camera, observation: Observation) -> np.ndarray | None:
    """Where a photo's lamp is (3,), by the manifest or by two mirror balls or more, whatever its paper says."""
    entry = light_entry(photoset, observation.view)
    if entry is not None and entry.position is not None:
        place = np.asarray(entry.position, float)
        return observation.pose.inverse().apply(place) if entry.attached_to == "camera" else place
    if entry is not None and (entry.direction is not None or entry.kind == "directional"):
        return None
    rays = sight_rays(photoset, camera, observation)
    if len({ray.ball for ray in rays}) < 2:
        return None
    span = max(float(np.linalg.norm(ball.center)) for ball in photoset.mirror_balls) + 1.0
    met = meet(rays, None, span)
    return met.place if met.kind == "point" else None


def power_of_light(points: np.ndarray, level: np.ndarray, place: np.ndarray) -> float | None:
    """By which power the radiance ``level`` (n,) of white paper at ``points`` (n, 3) grows with the light of a lamp at
    ``place``; None where it is lit too evenly. What lies in shadows has no say."""
    offset = place - points
    light = offset[:, 2] / np.linalg.norm(offset, axis=1) ** 3
    good = (light > 0) & (level > 0)
    if good.sum() < _SAMPLES:
        return None
    x, y = np.log(light[good]), np.log(level[good])
    design = np.column_stack([np.ones(len(x)), x - x.mean()])
    weight, keep = np.ones(len(x)), np.ones(len(x), bool)
    for turn in range(_ROUNDS):  # least absolute misses, then least squares of what lies near
        root = np.sqrt(weight)[:, None]
        found = np.linalg.lstsq(design * root, y * root[:, 0], rcond=None)[0]
        miss = np.abs(y - design @ found)
        middle = float(robust.deviation(miss)) + 1e-12
        keep = miss < _WILD * middle
        weight = keep.astype(float) if turn >= _ROUNDS // 2 else 1.0 / np.maximum(miss, 0.1 * middle)
    if x[keep].std() < _SPREAD or keep.mean() < _CLEAR:
        return None
    return float(found[1])
