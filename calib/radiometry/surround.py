"""The radiance of what surrounds the sample: the board, the white patch and the table, as the photos show them.

It is what throws stray light on the sample. Cells of a coarse grid on the board's plane are read in every photo; what
a photo does not show (behind the sample, beyond its edge, clipped) is filled in with the cell's reflectance in the
other photos times the lamp's irradiance there, with the sample's shadow.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from photogonio.calib.geometry.camera import Camera
from photogonio.calib.geometry.visibility import behind_ball, direct, lit_fraction
from photogonio.calib.setup import Setup, ViewSetup
from photogonio.capture.photoset import MirrorBall, Sphere

ACROSS = 64  # points along the picture's longer side that are read
LEAST_SEEN = 0.5  # share of the points that must be readable: what is clipped is the brightest
FEWEST = 100  # points

# sizes of cells near the sample and farther off, of its radius; and how far they reach from its foot, each a whole
# number of its own and of the next ones' size
SIZES = (0.4, 1.2, 9.6)
NEAR, MIDDLE, FAR = REACHES = (3.6, 9.6, 28.8)
SUBCELLS = 5  # points a side that are read in a cell
LEAST_READ = 0.4  # share of a cell's points that must be readable
MARGIN = 1.08  # silhouettes are taken as larger
SPREAD = 2.0  # cells over which neighbours' reflectance is averaged, so that black and white squares mix
LIT = 0.95  # share of the lamp's disc from which a cell's reflectance may be read


@dataclass(frozen=True, slots=True)
class Surround:
    """Cells of the board's plane in one view, each facing up; m cells, c channels."""

    points: np.ndarray  # (m, 3) centres, length units
    area: np.ndarray  # (m,) length units squared
    radiance: np.ndarray  # (m, c) radiance units; NaN where the photo does not show it
    lamp: np.ndarray  # (m, c) irradiance by the lamp alone, radiance units
    lit: np.ndarray  # (m,) share of the lamp's disc seen from the cell


ReadAt = Callable[
    [np.ndarray], tuple[np.ndarray, np.ndarray]
]  # pixels (n, 2) -> radiance (n, c), validity (n,)
Bounds = tuple[int, int, int, int]  # columns and rows [x0, x1) x [y0, y1) that can be read


def surround_of(setup: Setup, view: ViewSetup, radiance: np.ndarray) -> Surround:
    """The surroundings of one view, whose ``radiance`` is :func:`radiance_around`'s."""
    points, size = _grid(setup.ball)
    lamp, lit = _lamp_on(points, size, view, setup.ball)
    return Surround(points=points, area=size**2, radiance=radiance, lamp=lamp, lit=lit)


def radiance_around(
    setup: Setup, view: ViewSetup, read_at: ReadAt, bounds: Bounds, mirror_balls: tuple[MirrorBall, ...] = ()
) -> np.ndarray:
    """Mean radiance (m, c) of the cells around a ball, NaN where too little of a cell can be read."""
    points, size = _grid(setup.ball)
    balls = _balls(setup.ball, mirror_balls)
    return _read(_within(points, size), setup.camera, view, read_at, bounds, balls)


def cells_around(sample: Sphere) -> int:
    """How many cells there are around a ball: m of :func:`radiance_around`."""
    return len(_grid(sample)[0])


def near_shown(around: Sequence[np.ndarray | None]) -> float:
    """Share of the cells near the sample that any of the views' ``radiance`` (m, c) shows."""
    known = [np.isfinite(one).all(-1) for one in around if one is not None]
    return float(np.any(known, axis=0)[: len(_lattice(NEAR, SIZES[0]))].mean()) if known else 0.0


def completed(surrounds: Sequence[Surround | None]) -> tuple[Surround | None, ...]:
    """The surroundings of all views of one set, with what single views do not show filled in."""
    known = [one for one in surrounds if one is not None]
    if not known:
        return tuple(surrounds)
    factor = _spread(_median(np.stack([_reflectance(one) for one in known])), known[0].points)
    filled = [None if one is None else _filled(one, factor) for one in surrounds]
    return tuple(filled)


def _filled(one: Surround, factor: np.ndarray) -> Surround:
    guess = factor * one.lamp * one.lit[:, None]
    return replace(one, radiance=np.where(np.isfinite(one.radiance), one.radiance, guess))


def _reflectance(one: Surround) -> np.ndarray:
    """Radiance over the lamp's irradiance (m, c), NaN where not seen in full light."""
    usable = (one.lit >= LIT)[:, None] & (one.lamp > 0.0)
    return np.divide(one.radiance, one.lamp, out=np.full_like(one.radiance, np.nan), where=usable)


def _spread(factor: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Reflectances (m, c) with those that no photo shows filled in by what is seen nearest; 0 if nothing is.

    Far outside the picture that is the picture's edge alone: a mean over all of it would make the table as light as
    the board.
    """
    seen = np.isfinite(factor).all(1)
    if not seen.any():
        return np.zeros_like(factor)
    apart = np.linalg.norm(points[~seen, None, :2] - points[None, seen, :2], axis=-1)
    nearest = apart.min(1, keepdims=True)
    share = np.exp(-0.5 * ((apart - nearest) / (SPREAD * _pitch(points))) ** 2)
    factor = factor.copy()
    factor[~seen] = share @ factor[seen] / share.sum(1, keepdims=True)
    return factor


def _pitch(points: np.ndarray) -> float:
    """Distance of the closest cells."""
    return float(np.min(np.diff(np.unique(points[:, 0]))))


def _median(values: np.ndarray) -> np.ndarray:
    """Along the first axis, of what is finite; NaN where nothing is."""
    ordered = np.sort(values, axis=0)  # NaN last
    count = np.isfinite(ordered).sum(0)
    middle = np.maximum(count - 1, 0) // 2
    return np.take_along_axis(ordered, middle[None], axis=0)[0]


def _grid(sample: Sphere) -> tuple[np.ndarray, np.ndarray]:
    """Centres (m, 3) and side lengths (m,) of the cells about the sample's foot."""
    rings, inside = [], 0.0
    for reach, step in zip(REACHES, SIZES, strict=True):
        ring = _lattice(reach, step)
        rings.append(ring[np.abs(ring).max(1) > inside])
        inside = reach
    flat = np.vstack(rings) * sample.radius + sample.center[:2]
    size = np.repeat(SIZES, [len(ring) for ring in rings]) * sample.radius
    return np.column_stack([flat, np.zeros(len(flat))]), size


def _lattice(reach: float, step: float) -> np.ndarray:
    count = round(reach / step)
    line = (np.arange(-count, count) + 0.5) * step
    return np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)


def _balls(sample: Sphere, others: tuple[MirrorBall, ...]) -> list[tuple[np.ndarray, float]]:
    beside = [b for b in others if np.linalg.norm(b.center - sample.center) > sample.radius]
    every: list[Sphere | MirrorBall] = [sample, *beside]
    return [(np.asarray(b.center, float), float(b.radius)) for b in every]


def _lamp_on(
    points: np.ndarray, size: np.ndarray, view: ViewSetup, sample: Sphere
) -> tuple[np.ndarray, np.ndarray]:
    ball = np.array([[*sample.center, sample.radius]])
    if view.light.kind == "point":
        lit = lit_fraction(points, view.light.place, view.light.radius, ball, 0.0)
        irradiance = direct(points, view.light.place)
        wide = size > SIZES[1] * sample.radius  # a low lamp may stand above one of those
        irradiance[wide] = (
            direct(_within(points[wide], size[wide]), view.light.place).reshape(-1, wide.sum()).mean(0)
        )
    else:
        toward, falloff = view.light.toward(points)
        far = view.light.place * 1e6 * sample.radius
        lit = lit_fraction(points, far, 0.0, ball, 0.0)
        irradiance = np.maximum(toward[:, 2], 0.0) * falloff
    return irradiance[:, None] * view.strength, lit


def _within(points: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Points (k m, 3) of the cells, one of each cell after another."""
    line = (np.arange(SUBCELLS) + 0.5) / SUBCELLS - 0.5
    offset = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 1, 2) * size[:, None]
    return np.concatenate([points[:, :2] + offset, np.zeros((*offset.shape[:2], 1))], axis=-1).reshape(-1, 3)


def _read(
    fine: np.ndarray, camera: Camera, view: ViewSetup, read_at: ReadAt, bounds: Bounds, balls
) -> np.ndarray:
    """Mean radiance (m, c) of the readable ones of each cell's ``fine`` points, NaN where too few are."""
    cells = len(fine) // SUBCELLS**2
    eye = view.pose.center
    usable = view.pose.apply(fine)[:, 2] > 0.0
    for center, radius in balls:
        usable &= ~behind_ball(fine, eye, center, radius * MARGIN)
    pixels = np.rint(camera.project(view.pose, fine))
    x0, y0, x1, y1 = bounds
    usable &= ((pixels >= [x0, y0]) & (pixels < [x1, y1])).all(1)
    found, valid = read_at(pixels[usable].astype(int))
    value = np.zeros((len(fine), found.shape[1]), found.dtype)
    value[usable] = np.where(valid[:, None], found, 0.0)
    usable[usable] = valid
    value = value.reshape(SUBCELLS**2, cells, -1).sum(0)
    count = usable.reshape(SUBCELLS**2, cells).sum(0)
    enough = count >= LEAST_READ * SUBCELLS**2
    return np.where(enough[:, None], value / np.maximum(count, 1)[:, None], np.nan)


def backdrop(
    setup: Setup, view: ViewSetup, read_at: ReadAt, bounds: Bounds, mirror_balls: tuple[MirrorBall, ...] = ()
) -> np.ndarray:
    """Mean radiance (c,) of the picture beside a ball and the mirror balls; NaN where too little of it can be read."""
    x0, y0, x1, y1 = bounds
    step = max(1, max(setup.camera.size) // ACROSS)
    pixels = np.stack(np.meshgrid(np.arange(x0, x1, step), np.arange(y0, y1, step)), axis=-1).reshape(-1, 2)
    rays = setup.camera.world_rays(view.pose, pixels.astype(float))
    beside = np.ones(len(pixels), bool)
    balls: list[Sphere | MirrorBall] = [setup.ball, *mirror_balls]
    for ball in balls:
        offset = ball.center - view.pose.center
        along = rays @ offset
        beside &= (offset @ offset - along * along > (MARGIN * ball.radius) ** 2) | (along < 0.0)
    if beside.sum() < FEWEST:
        return np.full(len(view.strength), np.nan)
    value, valid = read_at(pixels[beside])
    if valid.mean() < LEAST_SEEN:
        return np.full(value.shape[1], np.nan)
    return value[valid].mean(0, dtype=float)
