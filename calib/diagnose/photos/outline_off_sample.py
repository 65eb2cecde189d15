"""A flat sample's outline that reaches over bare board: the print is seen there, and is cut off the outline.

Print under a sample is hidden. Edges of the print that show within the outline, white and black on the sides where they
belong, lie beside the sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from photogonio.calib.adjust.state import State
from photogonio.calib.detect.gray import without_fireflies
from photogonio.calib.detect.observation import Observation
from photogonio.calib.detect.photo_reader import Reader
from photogonio.calib.diagnose.base import Departure, Stage
from photogonio.calib.geometry.camera import Camera, Pose, focal
from photogonio.calib.geometry.print_map import Print, draw_print
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import MANIFEST, Plane

_ASIDE = 1.8  # pixels to both sides of an edge at which the print's tone is read
_STEP = 1.5  # pixels between places
_CONTRAST = 0.5  # of white less black over their sum, at which an edge is the print's
_PHOTOS = 4  # looked at
_FEWEST = 6  # edges that are seen, beyond two for each that is hidden, that tell
_BLUR = 1.2  # pixels, of the picture: as far beyond the sample's border as board beside it still shows
_ROW = 1e-6  # of a length: places no farther apart in depth are as deep
_LEFT = 0.25  # of the outline's area that must remain


class OutlineOffSample(Departure):
    """A flat sample's outline without the parts in which photos show the board's print."""

    stage = Stage.CAMERA
    entries = (
        Entry(
            "outline-off-sample",
            "The board's print is seen within the flat sample's outline: the sample is taken to be what is left of it.",
            "Correct `sample.outline`.",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        found = print_within(state)
        if found is None:
            return []
        kept, deepest = found
        corners = ", ".join(f"[{x:.1f}, {y:.1f}]" for x, y in kept)
        message = (
            f"the board's print is seen within the flat sample's outline, up to {deepest:.2g} "
            f"{state.photoset.length_unit} from its border: the sample is taken to be within [{corners}]; correct "
            "sample.outline"
        )
        told = {"outline": kept.tolist()}
        return [Diagnosis("outline-off-sample", message, deepest, allowed=True, detail=told, grounds=kept)]

    def remedy(self, state: State, found: Sequence[Diagnosis]) -> State:
        sample = replace(state.photoset.sample, outline=found[0].grounds)
        return replace(state, photoset=replace(state.photoset, sample=sample))


def print_within(state: State) -> tuple[np.ndarray, float] | None:
    """What is left of a flat sample's outline (k, 2), and how deep the print is seen in it; None if it is not.

    Raises:
        InputError: hardly anything remains.
    """
    photoset, reader, camera, observations = state.photoset, state.reader, state.camera, state.observations
    plane, board = photoset.sample, photoset.board
    shown = [s for s in observations if not s.probe]
    if not isinstance(plane, Plane) or board is None or board.kind == "markers" or not shown:
        return None
    pattern = draw_print(board)
    if pattern is None:
        return None
    outline = np.asarray(plane.outline, float)
    middle = np.append(outline.mean(axis=0), 0.0)
    pixel = float(np.median([np.linalg.norm(s.pose.apply(middle)) for s in shown])) / focal(camera)
    white, black = print_edges(pattern, outline, pixel)
    every = np.unique(np.linspace(0, len(shown) - 1, _PHOTOS).astype(int))
    seen = [c for k in every if (c := _contrast(reader, camera, shown[k], white, black)) is not None]
    if not seen:
        return None
    visible = np.nanmedian(seen, axis=0) > _CONTRAST
    least = least_deep([s.pose.center - middle for s in (shown[k] for k in every)], pixel, plane.height)
    kept, deepest = cut(outline, (white + black) / 2, visible, least)
    if deepest == 0.0:
        return None
    if len(kept) < 3 or cv2.contourArea(kept.astype(np.float32)) < _LEFT * cv2.contourArea(
        outline.astype(np.float32)
    ):
        where = f"{photoset.folder / MANIFEST}: sample.outline"
        raise InputError(where, "the board's print is seen in most of it: the flat sample lies elsewhere")
    return kept, deepest


def least_deep(toward: Sequence[np.ndarray], pixel: float, height: float) -> float:
    """How deep within an outline in its place the print may seem to be seen, by cameras in the directions ``toward``
    (3,): white and black are read aside of an edge, one of them beyond the border; blur smears board into the sample,
    foreshortened; and one looks under a raised sample's border. What is less is found by the sample's own edges."""
    cosine = float(np.median([one[2] / np.linalg.norm(one) for one in toward]))
    cosine = max(cosine, 0.1)
    return (_ASIDE + _BLUR / cosine) * pixel + abs(height) * float(np.sqrt(1.0 - cosine**2)) / cosine


def print_edges(pattern: Print, outline: np.ndarray, pixel: float) -> tuple[np.ndarray, np.ndarray]:
    """Board points (n, 2) in the print's white and opposite ones in its black, beside edges within ``outline`` (k, 2);
    ``pixel`` is one's size there."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    x, y = np.meshgrid(*(np.arange(a, b, _STEP * pixel) for a, b in zip(low, high, strict=True)))
    places = np.column_stack([x.ravel(), y.ravel()])
    depth = np.min([_depth(places, *side) for side in _sides(outline)], axis=0)
    places = places[(depth > 0) & pattern.on_print(places)]
    whites, blacks = [], []
    for aside in _ASIDE * pixel * np.eye(2):
        one, other = places + aside, places - aside
        (first, clear), (second, free) = pattern.at(one), pattern.at(other)
        good = (first != second) & (np.minimum(clear, free) > pixel)
        whites.append(np.where(first[:, None], one, other)[good])
        blacks.append(np.where(first[:, None], other, one)[good])
    return np.concatenate(whites), np.concatenate(blacks)


def cut(
    outline: np.ndarray, places: np.ndarray, visible: np.ndarray, least: float
) -> tuple[np.ndarray, float]:
    """The outline without strips along its sides in which most of ``places`` (n, 2) are ``visible`` (n,), of
    those with such a place deeper than ``least``, and how deep the deepest is; the one that tells most first."""
    kept, deepest = outline, 0.0
    while len(kept) >= 3:
        depths = [_depth(places, *side) for side in _sides(kept)]
        inside = np.min(depths, axis=0) > 0
        told = [_strip(depth[inside], visible[inside]) for depth in depths]
        strips = [(gain, deep, k) for k, (gain, seen, deep) in enumerate(told) if seen > least]
        gain, deep, side = max(strips, default=(0, 0.0, 0))
        if gain < _FEWEST:
            break
        start, inward = _sides(kept)[side]
        kept, deepest = _clipped(kept, start + deep * inward, inward), max(deepest, deep)
    return kept, deepest


def _strip(depth: np.ndarray, visible: np.ndarray) -> tuple[int, float, float]:
    """How many places are visible, less two for each hidden, in the strip where that is most; how deep the last of it
    is; and how deep the first place behind it, which is hidden: between the two it is bare board or sample, and nothing
    tells which."""
    order = np.argsort(depth)
    more = np.cumsum(np.where(visible[order], 1, -2))
    more[:-1][np.diff(depth[order]) < _ROW] = 0  # places of one row tell together
    if not len(more) or more.max() <= 0:
        return 0, 0.0, 0.0
    best = int(np.argmax(more))
    behind = min(best + 1, len(order) - 1)
    return int(more[best]), float(depth[order[best]]), float(depth[order[behind]])


def _sides(outline: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """A point of each side, and the unit normal inward."""
    along = np.roll(outline, -1, axis=0) - outline
    normal = np.column_stack([-along[:, 1], along[:, 0]])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    inward = np.sign(((outline.mean(axis=0) - outline) * normal).sum(axis=1))[:, None] * normal
    return list(zip(outline, inward, strict=True))


def _depth(places: np.ndarray, start: np.ndarray, inward: np.ndarray) -> np.ndarray:
    return (places - start) @ inward


def _clipped(outline: np.ndarray, start: np.ndarray, inward: np.ndarray) -> np.ndarray:
    """The part of a convex polygon on the inner side of a line."""
    depth, kept = _depth(outline, start, inward), []
    for k in range(len(outline)):
        n = (k + 1) % len(outline)
        if depth[k] >= 0:
            kept.append(outline[k])
        if (depth[k] > 0) != (depth[n] > 0) and depth[k] != depth[n]:
            share = depth[k] / (depth[k] - depth[n])
            kept.append(outline[k] + share * (outline[n] - outline[k]))
    return np.array(kept).reshape(-1, 2)


def _contrast(
    reader: Reader, camera: Camera, observation: Observation, white: np.ndarray, black: np.ndarray
) -> np.ndarray | None:
    """White less black over their sum (n,) as a photo shows them; NaN outside; None if it shows none of them."""
    pixels = [_pixels(camera, observation.pose, flat) for flat in (white, black)]
    size = np.array(camera.size)
    inside = np.all([(p >= 1) & (p <= size - 2) for p in pixels], axis=(0, 2))
    if not inside.any():
        return None
    within = np.concatenate([p[inside] for p in pixels])
    low, high = np.floor(within.min(axis=0)).astype(int) - 1, np.ceil(within.max(axis=0)).astype(int) + 2
    shown = reader.level(observation.view, (int(low[0]), int(low[1]), int(high[0]), int(high[1])))
    if shown is None:
        return None
    level = np.nan_to_num(without_fireflies(shown[0])).astype(np.float32)
    values = []
    for one in pixels:
        there = (np.where(inside[:, None], one, low) - low).astype(np.float32)
        values.append(cv2.remap(level, there[:, :1], there[:, 1:], cv2.INTER_LINEAR).ravel().astype(float))
    total = values[0] + values[1]
    contrast = (values[0] - values[1]) / np.where(total > 0, total, np.inf)
    return np.where(inside, contrast, np.nan)


def _pixels(camera: Camera, pose: Pose, flat: np.ndarray) -> np.ndarray:
    return camera.project(pose, np.column_stack([flat, np.zeros(len(flat))]))
