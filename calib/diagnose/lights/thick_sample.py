"""Paper beside a thick flat sample, which throws a shadow that shading knows nothing of, and light of its sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from photogonio.calib.adjust.lamps import block_name, place_in_world
from photogonio.calib.adjust.state import Settled, State
from photogonio.calib.detect.observation import Observation
from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.diagnose.base import LightDeparture
from photogonio.calib.geometry.board import board_size
from photogonio.calib.geometry.visibility import direct
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.jit import jit
from photogonio.capture.photoset import Board, Plane, Sphere

THICK = 1 / 40  # of the board's larger side: a thinner sample's shadow is a line beside its edge
BESIDE = 0.4  # heights around the shadow and the sample that the lamp's width blurs, and where it may be off
MOST = 0.15  # of the direct light: paper that white sides would light up so much is not read
ALBEDO, ALBEDO_SPREAD = 0.35, 0.25  # of the sides: anything
FEWEST = 400  # samples of paper that must be left
ALONG, UP = 96, 4  # pieces around the outline, and from the board to its top


def is_thick(board: Board | None, sample: Sphere | Plane) -> bool:
    """Whether a flat sample stands so high on the board that its shadow matters."""
    if board is None or not isinstance(sample, Plane):
        return False
    return sample.height > THICK * float(board_size(board).max())


class ThickSample(LightDeparture):
    """Paper in the shadow of a thick flat sample is not read, nor what its sides light up much."""

    code = "thick-sample"
    entries = (
        Entry(
            code,
            "The flat sample stands so high that it throws a shadow on the board: paper in it is not "
            "read, nor what its "
            "sides light up much.",
            "Nothing.",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        return [Diagnosis(self.code)] if is_thick(state.photoset.board, state.photoset.sample) else []

    def remedy(self, state: State, found: Sequence[Diagnosis]) -> State:
        sample = state.photoset.sample
        if not isinstance(sample, Plane):
            return state
        return state.with_paper(lambda one, reading: clear_of_slab(sample, state.settled, one, reading))


def clear_of_slab(
    sample: Plane, settled: Settled, observation: Observation, reading: PaperReading
) -> PaperReading:
    """A view's paper without the sample's shadow and the light of its sides, with the lamp where it settled."""
    lamp = settled.lamps.get(observation.light)
    if lamp is None or lamp.kind != "point":
        return reading
    place = place_in_world(lamp, settled.values[block_name(lamp.name)], observation.pose)
    if place[2] <= sample.height:
        return reading
    points = reading.samples.points
    thrown = side_light(points, place, sample) / direct(points, place)
    clear = ~shaded(points, place, sample) & (thrown < MOST)
    return _cleared(reading, clear, thrown) if clear.sum() >= FEWEST else reading


def shaded(points: np.ndarray, lamp: np.ndarray, sample: Plane) -> np.ndarray:
    """(n,) bool: points (n, 3) of the board in the shadow that ``sample``'s prism throws, or close to either."""
    outline = np.asarray(sample.outline, float)
    reach = lamp[2] / (lamp[2] - sample.height)
    thrown = lamp[:2] + reach * (outline - lamp[:2])
    hull = cv2.convexHull(np.vstack([outline, thrown]).astype(np.float32))
    near = [cv2.pointPolygonTest(hull, (float(x), float(y)), True) for x, y in points[:, :2]]
    return np.array(near) > -BESIDE * sample.height


def side_light(points: np.ndarray, lamp: np.ndarray, sample: Plane) -> np.ndarray:
    """Irradiance (n,) of the board at ``points`` (n, 3) by the prism's sides, white and diffuse, that a lamp of unit
    strength lights."""
    pieces, normal, width = _pieces(np.asarray(sample.outline, float))
    total = np.zeros(len(points))
    for z in (np.arange(UP) + 0.5) / UP * sample.height:
        offset = lamp - np.column_stack([pieces, np.full(len(pieces), z)])
        facing = np.maximum(np.einsum("ij,ij->i", offset[:, :2], normal), 0.0)
        sent = facing / np.linalg.norm(offset, axis=1) ** 3 * width * (sample.height / UP) / np.pi
        _thrown(np.ascontiguousarray(points, float), pieces, normal, float(z), sent, total)
    return total


def _pieces(outline: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middles (k, 2) of pieces of a convex outline, their normals (k, 2) outward and widths (k,): about ALONG on all of
    it, and one at least on each of its sides."""
    along = np.roll(outline, -1, axis=0) - outline
    length = np.hypot(*along.T)
    count = np.maximum(np.ceil(ALONG * length / length.sum()), 1).astype(int)
    side = np.repeat(np.arange(len(outline)), count)
    share = (np.arange(len(side)) - (np.cumsum(count) - count)[side] + 0.5) / count[side]
    normal = np.column_stack([along[:, 1], -along[:, 0]]) / np.maximum(length, 1e-300)[:, None]
    normal *= np.sign(np.einsum("ij,ij->i", normal, outline - outline.mean(0)))[:, None]
    return outline[side] + share[:, None] * along[side], normal[side], (length / count)[side]


@jit
def _thrown(points, pieces, normal, height, sent, total):
    """Adds to ``total`` (n,) what pieces of a side at one ``height``, which send ``sent`` (k,), throw on ``points``."""
    for j in range(len(pieces)):
        if sent[j] > 0.0:
            for k in range(len(points)):
                x, y = points[k, 0] - pieces[j, 0], points[k, 1] - pieces[j, 1]
                facing = x * normal[j, 0] + y * normal[j, 1]
                if facing > 0.0:
                    total[k] += facing * height / (x * x + y * y + height * height) ** 2 * sent[j]


def _cleared(reading: PaperReading, keep: np.ndarray, thrown: np.ndarray) -> PaperReading:
    """Samples to ``keep``, less what sides of middling albedo throw on them, and that much less sure."""
    thrown = thrown[keep]
    level = reading.level[keep] / (1.0 + ALBEDO * thrown)
    samples = reading.samples.keep(keep)
    samples = replace(samples, value=samples.value / (1.0 + ALBEDO * thrown)[:, None])
    noise = reading.noise[keep] + (ALBEDO_SPREAD * thrown * level) ** 2
    return replace(reading, samples=samples, level=level, noise=noise)
