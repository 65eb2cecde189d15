"""Where a sample of which nothing is told stands on the board, and whether it is a ball or a flat piece.

What hides the print is laid on the board's plane in each photo. A ball that stands on the paper hides an ellipse
behind it, another one from each camera; a flat piece always the same polygon. Either is fitted to what is hidden,
cell by cell, then to the pixels of the photos (silhouette.py). The one that holds more of them is taken, and placed
by its limb or its edges where these agree with the pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.optimize import least_squares, minimize

from photogonio.calib.adjust.flat_sample import moved_points, place_plane
from photogonio.calib.detect.edges import Edges, on_plane, plane_edges
from photogonio.calib.detect.gray import GrayPart, without_fireflies
from photogonio.calib.detect.limb import BLURRED, Limb, settled_limb
from photogonio.calib.geometry.camera import Camera, Pose, focal
from photogonio.calib.geometry.cones import cone_residual, outline
from photogonio.calib.geometry.print_map import Print
from photogonio.calib.geometry.visibility import behind_ball
from photogonio.calib.identify.covered import Cover
from photogonio.calib.identify.silhouette import (
    SOFT,
    SamplePixels,
    ball_by,
    best_shape,
    flat_by,
    held,
    seen_about,
)
from photogonio.calib.identify.standing import main_part
from photogonio.capture.photoset import Plane, Sphere

SEEN_COSTS = 2.0  # a cell that is seen against one that is hidden, within a shape
SIZES = (0.7, 0.9, 1.1)  # radii tried at first, of that of a disc as large as what is hidden
AROUND = 3.0  # radii of that disc about what is hidden, in which a ball is looked for
WIDEST = 1.0  # logarithm of a ball's radius over that of the disc
REACH = 1.6  # of half its size about its middle, that a polygon is looked for in
MOST_PHOTOS = 8  # that tell the shape
BALL_NEARLY = 0.04  # by which a ball may hold less than a polygon does, which follows any hull
GIVEN_UP = 0.08  # of what a ball holds, that a polygon may miss on its way
AGREED = 0.001  # of what is held, that limb or edges may lose
FEWER = 0.01  # likewise, a polygon with a corner less
BLUNT = 0.06  # of a polygon's size, by which a corner must stand out
STRAIGHT = 0.92  # of its narrowest box that a hull must fill, to be a rectangle
CORNERED = 0.03  # of a hull's length that its corners may be cut by
REACHES = (4.0, 2.5)  # pixels in which edges are looked for, closer and closer
LIMB_REACH = 4.0  # pixels, likewise
WITHIN = 1.0  # pixels within its outline, that a sample's own are
SHOWN = 0.5  # mean of what its pixels tell for it (logarithm of chances): a bare print has less than nothing
FEWEST = 60  # pixels that tell it
ASIDE, SWOLLEN = 1.0, 0.04  # units in which places, and a radius' logarithm, are looked for
SURE = 0.8  # of what is hidden that a shape explains; less is a doubt
HEIGHT = 0.5  # of a flat piece above the paper, where nothing tells
LOOSE = 2.0  # standard errors
STILL = 2e-3  # of its distance, by which a camera may have moved


@dataclass(frozen=True, slots=True)
class SamplePhoto:
    """One photo for the search."""

    small: np.ndarray  # (h, w) float32 gray
    pose: Pose
    cover: Cover


@dataclass(frozen=True, slots=True)
class FoundSample:
    """A sample as the photos show it."""

    sample: Sphere | Plane
    explained: float  # share of what is hidden that it explains, less what it should hide and does not
    placed: bool  # by limb or edges, to a fraction of a pixel

    @property
    def sure(self) -> bool:
        return self.placed and self.explained >= SURE


def find_sample(photos: Sequence[SamplePhoto], camera: Camera, print_: Print | None) -> FoundSample | None:
    """The sample of several photos, all of a camera (of the small pictures); None if nothing hides the print."""
    few = [photos[k] for k in np.unique(np.linspace(0, len(photos) - 1, MOST_PHOTOS).astype(int))]
    main = main_part([one.cover for one in few])
    if main is None:
        return None
    covers = [one.cover for one in few]
    flat = fitted_polygon(polygon_of(main, covers[0]), covers)
    ball = ball_of(main, covers)
    seen = [] if print_ is None else _seen(few, camera, print_, ball, flat)
    if not seen:
        return FoundSample(flat, 0.0, False)
    ball, by_ball = silhouette_ball(seen, ball)
    flat, by_flat = silhouette_flat(seen, flat, (1.0 - GIVEN_UP) * by_ball)
    whole = max(sum(float((c.hidden[main.ravel()] == 1).sum()) for c in covers), 1.0)
    if by_ball > (1.0 - BALL_NEARLY) * by_flat:
        explained = _explained([behind(ball, c) for c in covers], covers) / whole
        placed = placed_ball(photos, camera, ball)
        if placed is not None and held(seen, ball_by, _of_ball(placed)) > (1.0 - AGREED) * by_ball:
            ball = placed
        return FoundSample(ball, min(explained, 1.0), by_ball > 0)
    explained = _explained([_inside(flat.outline, c.points) for c in covers], covers) / whole
    settled = placed_flat(photos, camera, flat, print_)
    if settled is not None and held(seen, flat_by, _of_flat(settled)) > (1.0 - AGREED) * by_flat:
        flat = settled
    return FoundSample(flat, min(explained, 1.0), by_flat > 0)


def _seen(
    photos: Sequence[SamplePhoto], camera: Camera, print_: Print, ball: Sphere, flat: Plane
) -> list[SamplePixels]:
    """The pixels about both shapes."""
    found = []
    for one in photos:
        limb = outline(camera, one.pose, ball.center, ball.radius)
        about = np.vstack([limb, camera.project(one.pose, on_plane(flat, flat.outline))])
        seen = seen_about(one.small, one.cover, one.pose, camera, print_, about)
        found += [] if seen is None else [seen]
    return found


def shown_by(
    photos: Sequence[SamplePhoto], camera: Camera, print_: Print | None, sample: Sphere | Plane
) -> list[bool | None]:
    """Whether each photo shows the sample where it stands, and not the print; None if it does not tell."""
    found: list[bool | None] = []
    for one in photos:
        if isinstance(sample, Sphere):
            about, depth, values = (
                outline(camera, one.pose, sample.center, sample.radius),
                ball_by,
                _of_ball(sample),
            )
        else:
            about = camera.project(one.pose, on_plane(sample, sample.outline))
            depth, values = flat_by, _of_flat(sample)
        seen = None if print_ is None else seen_about(one.small, one.cover, one.pose, camera, print_, about)
        if seen is None:
            found.append(None)
            continue
        within = depth(seen, values) > WITHIN
        told = seen.of_sample(within)[within]
        found.append(bool(told.mean() > SHOWN) if (told != 0).sum() >= FEWEST else None)
    return found


def _of_ball(ball: Sphere) -> np.ndarray:
    return np.append(np.asarray(ball.center, float)[:2], np.log(ball.radius))


def _of_flat(flat: Plane) -> np.ndarray:
    return np.append(np.ravel(flat.outline), flat.height)


def silhouette_ball(seen: Sequence[SamplePixels], ball: Sphere) -> tuple[Sphere, float]:
    """A ball on the paper where it holds most of the pixels, and how much."""
    values, total = best_shape(seen, ball_by, _of_ball(ball), np.array([ASIDE, ASIDE, SWOLLEN]))
    return _standing(values), total


def silhouette_flat(seen: Sequence[SamplePixels], flat: Plane, least: float) -> tuple[Plane, float]:
    """A flat piece likewise, with no more corners than it takes; not to the end if it will not hold ``least``."""

    def fitted(start: Plane, stages: tuple[float, ...]) -> tuple[Plane, float]:
        values, total = best_shape(
            seen, flat_by, _of_flat(start), np.full(len(start.outline) * 2 + 1, ASIDE), stages
        )
        return Plane(values[:-1].reshape(-1, 2), max(float(values[-1]), 0.0)), total

    flat, total = fitted(flat, SOFT[:2])
    if total < least:
        return flat, total
    flat, total = fitted(flat, SOFT[2:])
    while len(flat.outline) > 3:
        corners = np.asarray(flat.outline, float)
        before, after = np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0)
        chord = (after - before) / np.linalg.norm(after - before, axis=1, keepdims=True)
        out = np.abs(chord[:, 0] * (corners - before)[:, 1] - chord[:, 1] * (corners - before)[:, 0])
        k = int(np.argmin(out))
        if out[k] > BLUNT * np.ptp(corners, axis=0).max():
            break
        fewer, holds = fitted(replace(flat, outline=np.delete(corners, k, axis=0)), SOFT[1:])
        if holds < (1.0 - FEWER) * total:
            break
        flat, total = fewer, holds
    return flat, total


def polygon_of(main: np.ndarray, cover: Cover) -> Plane:
    """A flat piece about the cells (h, w): a rectangle if they nearly fill one, else a convex polygon."""
    points = cover.points[main.ravel()].astype(np.float32)
    hull = cv2.convexHull(points)
    box = cv2.minAreaRect(hull)
    if cv2.contourArea(hull) > STRAIGHT * box[1][0] * box[1][1]:
        corners = cv2.boxPoints(((box[0]), (box[1][0] + cover.step, box[1][1] + cover.step), box[2]))
    else:
        corners = cv2.approxPolyDP(hull, CORNERED * cv2.arcLength(hull, True), True).reshape(-1, 2)
    return Plane(np.asarray(corners, float), HEIGHT)


def fitted_polygon(flat: Plane, covers: Sequence[Cover]) -> Plane:
    """The polygon moved, turned and stretched so that it best explains what is hidden."""
    middle = np.asarray(flat.outline, float).mean(axis=0)
    size = float(np.ptp(flat.outline, axis=0).max()) / 2

    def shaped(values: np.ndarray) -> np.ndarray:
        moved = values * np.array([size, size, 1.0, 1.0, 1.0])
        cosine, sine = np.cos(moved[2]), np.sin(moved[2])
        off = (np.asarray(flat.outline, float) - middle) @ axes.T * np.exp(moved[3:]) @ axes
        return middle + moved[:2] + off @ np.array([[cosine, sine], [-sine, cosine]])

    edge = flat.outline[1] - flat.outline[0]
    along = edge / np.linalg.norm(edge)
    axes = np.array([along, [-along[1], along[0]]])
    steps = np.diag([0.08, 0.08, 0.06, 0.1, 0.1])
    best = np.zeros(5)
    worth = sum((c.hidden == 1) - SEEN_COSTS * (c.hidden == 0) for c in covers)
    near = (np.abs(covers[0].points - middle) < REACH * size).all(axis=1)
    points, worth = covers[0].points[near], np.asarray(worth)[near]
    for _ in range(2):
        found = minimize(
            lambda values: -float(worth[_inside(shaped(values), points)].sum()),
            best,
            method="Nelder-Mead",
            options={
                "initial_simplex": best + np.vstack([np.zeros(5), steps]),
                "maxiter": 150,
                "xatol": 1e-3,
            },
        )
        best, steps = found.x, 0.4 * steps
    return replace(flat, outline=shaped(best))


def ball_of(main: np.ndarray, covers: Sequence[Cover]) -> Sphere:
    """The ball on the paper that best explains what is hidden, by the cells alone."""
    middle = covers[0].points[main.ravel()].mean(axis=0)
    radius = covers[0].step * float(np.sqrt(main.sum() / np.pi))
    eye = np.mean([c.eye for c in covers], axis=0)
    away = middle - eye[:2]
    slope = float(np.linalg.norm(away)) / max(float(eye[2]), 1e-9)
    away = away / max(float(np.linalg.norm(away)), 1e-9)

    close = (np.abs(covers[0].points - middle) < AROUND * radius).all(axis=1)
    near = [replace(c, points=c.points[close], hidden=c.hidden[close], dark=c.dark[close]) for c in covers]

    def cost(values: np.ndarray) -> float:
        if abs(values[2] - np.log(radius)) > WIDEST:
            return 0.0
        ball = _standing(values)
        return -_explained([behind(ball, c) for c in near], near)

    best: tuple[float, np.ndarray] | None = None
    for size in SIZES:
        start = np.append(middle - size * radius * slope * away, np.log(size * radius))
        simplex = start + np.vstack([np.zeros(3), np.diag([0.2 * radius, 0.2 * radius, 0.15])])
        found = minimize(
            cost,
            start,
            method="Nelder-Mead",
            options={"initial_simplex": simplex, "maxiter": 120, "xatol": 0.02},
        )
        if best is None or found.fun < best[0]:
            best = float(found.fun), found.x
    assert best is not None
    return _standing(best[1])


def _standing(values: np.ndarray) -> Sphere:
    """A ball on the paper, of x, y and the logarithm of its radius."""
    radius = float(np.exp(values[2]))
    return Sphere(np.append(values[:2], radius), radius)


def behind(ball: Sphere, cover: Cover) -> np.ndarray:
    """(n,) bool, cells that a camera sees behind a ball."""
    points = np.column_stack([cover.points, np.zeros(len(cover.points))])
    return behind_ball(points, cover.eye, np.asarray(ball.center, float), ball.radius)


def _inside(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(n,) bool, points within a convex polygon."""
    edges = np.roll(corners, -1, axis=0) - corners
    off = points[:, None] - corners
    cross = edges[:, 0] * off[..., 1] - edges[:, 1] * off[..., 0]
    return (cross >= 0).all(axis=1) | (cross <= 0).all(axis=1)


def _explained(inside: Sequence[np.ndarray], covers: Sequence[Cover]) -> float:
    """Hidden cells within a shape, less those that are seen there."""
    total = 0.0
    for mask, cover in zip(inside, covers, strict=True):
        own = cover.hidden[mask]
        total += float((own == 1).sum() - SEEN_COSTS * (own == 0).sum())
    return total


def placed_ball(photos: Sequence[SamplePhoto], camera: Camera, ball: Sphere) -> Sphere | None:
    """The ball on the paper by its limbs; None if too few are clear."""
    for _ in range(2):
        limbs = [
            (one.pose, limb) for one in _as_seen(photos) if (limb := _limb(one, camera, ball)) is not None
        ]
        if not limbs:
            return None
        ball = _by_limbs(limbs, camera, ball)
    return ball


def _as_seen(photos: Sequence[SamplePhoto]) -> list[SamplePhoto]:
    """The photos; those of a camera that stood still laid over one another, for no single lamp shows a whole limb."""
    eyes = np.array([one.pose.center for one in photos])
    if len(photos) < 2 or np.ptp(eyes, axis=0).max() > STILL * np.linalg.norm(eyes[0]):
        return list(photos)
    brightest = np.max([one.small / max(float(np.percentile(one.small, 98)), 1e-9) for one in photos], axis=0)
    return [replace(photos[0], small=brightest.astype(np.float32))]


def _limb(one: SamplePhoto, camera: Camera, ball: Sphere) -> Limb | None:
    limb = outline(camera, one.pose, ball.center, ball.radius)
    width, height = camera.size
    if not np.isfinite(limb).all() or (np.abs(limb) > 2 * max(width, height)).any():
        return None
    calm = without_fireflies(one.small)
    part = GrayPart(calm, np.isfinite(calm))
    center = np.asarray(ball.center, float)
    sharp = settled_limb(part, camera, one.pose, center, ball.radius, LIMB_REACH)
    return sharp or settled_limb(part, camera, one.pose, center, ball.radius, LIMB_REACH, BLURRED)


def _by_limbs(limbs: Sequence[tuple[Pose, Limb]], camera: Camera, ball: Sphere) -> Sphere:
    rays = [camera.rays(limb.pixels) for _, limb in limbs]

    def residual(values: np.ndarray) -> np.ndarray:
        center = np.append(values[:2], values[2])
        return np.concatenate(
            [
                cone_residual(ray, pose.apply(center), values[2], focal(camera)) / limb.sigma
                for ray, (pose, limb) in zip(rays, limbs, strict=True)
            ]
        )

    start = np.append(np.asarray(ball.center, float)[:2], ball.radius)
    found = least_squares(residual, start, loss="soft_l1", f_scale=LOOSE, x_scale=ball.radius).x
    return Sphere(np.append(found[:2], found[2]), float(found[2]))


def placed_flat(
    photos: Sequence[SamplePhoto], camera: Camera, flat: Plane, print_: Print | None
) -> Plane | None:
    """A flat piece by its edges; None if too few are clear."""
    done = None
    for reach in REACHES:
        seen: list[tuple[Pose, Edges]] = []
        for one in photos:
            calm = without_fireflies(one.small)
            part = GrayPart(calm, np.isfinite(calm))
            edges = plane_edges(part, camera, one.pose, flat, reach, print_)
            if edges is not None:
                seen.append((one.pose, edges))
        move = place_plane(camera, [pose for pose, _ in seen], [edges for _, edges in seen], flat)
        if move is None:
            return done
        values = move.values.copy()
        values[4:6] = 0.0  # it lies level
        values[3] = np.clip(values[3], -0.5 * HEIGHT, 20.0 * HEIGHT)
        moved = moved_points(on_plane(flat, flat.outline), flat, values)
        flat = done = Plane(moved[:, :2], max(flat.height + float(values[3]), 0.0))
    return done
