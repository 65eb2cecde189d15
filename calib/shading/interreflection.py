"""Light that the sample ball throws onto the board, for a lamp of unit strength: a diffuse and a glossy part."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from photogonio.calib.geometry.mirror import halfway
from photogonio.calib.geometry.visibility import direct, lit_fraction
from photogonio.capture.jit import borrowing, in_lanes, jit

_FACETS = 160
_GRID = 22  # nodes along the board's longer side
_SMOOTH = 0.05  # of the distance from the ball: what changes little
_F0 = 0.04  # of the glossy part
_RINGS, _SPOKES = 16, 32  # nodes about a polished ball
_FOOT, _OUT = 1.05, 30.0  # radii from its foot where they begin and end
_BOARD = 0.35  # reflectance of a print, white and black together


def bounce_columns(
    points: np.ndarray, light: np.ndarray, center: np.ndarray, radius: float, grid: int = _GRID
) -> np.ndarray:
    """Irradiance (n, 2) on the board at ``points`` (n, 3), all of one height: from a white diffuse ball, and from a
    mirror ball with Schlick's reflectance. Both are smooth: worked out on ``grid`` nodes along the longer side, and
    interpolated."""
    return _grid(points, center, radius, grid).columns(light)


@dataclass(frozen=True, slots=True)
class Nodes:
    """Where one ball's bounce is worked out, and points of the board between: what the lamp's place leaves alone."""

    center: np.ndarray  # (3,) of the ball
    radius: float
    nodes: np.ndarray  # (a b, 3)
    shape: tuple[int, int]  # a, b
    place: np.ndarray  # (n, 2) of the points among the nodes
    weight: np.ndarray  # (n,) what is interpolated goes over into light with; 0: out of reach

    def columns(self, light: np.ndarray) -> np.ndarray:
        """:func:`bounce_columns` of a grid."""
        parts = (
            part(self.nodes, light, self.center, self.radius) for part in (diffuse_bounce, glossy_bounce)
        )
        return self._interpolated(np.stack([part.reshape(self.shape) for part in parts], axis=-1))

    def mirrored(self, light: np.ndarray) -> np.ndarray:
        """:func:`polished_bounce` (n,) of rings."""
        cube = np.linalg.norm(self.nodes - self.center, axis=1) ** 3
        plane = cube * glossy_bounce(self.nodes, light, self.center, self.radius, f0=1.0)
        return self._interpolated(plane.reshape(*self.shape, 1))[:, 0] * self.weight

    def _interpolated(self, planes: np.ndarray) -> np.ndarray:
        result = np.empty((len(self.place), planes.shape[2]))
        _between(planes, self.place, result)
        return result


def _grid(points: np.ndarray, center: np.ndarray, radius: float, count: int) -> Nodes:
    """Even nodes, ``count`` along the longer side of where ``points`` (n, 3) lie."""
    low, high = points[:, :2].min(0), points[:, :2].max(0)
    step = (high - low).max() / (count - 1)
    along = np.ceil((high - low) / step).astype(int) + 1
    x, y = np.meshgrid(*(low[k] + step * np.arange(along[k]) for k in (0, 1)), indexing="ij")
    nodes = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, points[0, 2])])
    return Nodes(center, radius, nodes, x.shape, (points[:, :2] - low) / step, np.ones(len(points)))


def _rings(points: np.ndarray, center: np.ndarray, radius: float) -> Nodes:
    """Nodes in rings about a ball, ever farther apart, out to 30 of its radii."""
    rings = np.log(np.geomspace(_FOOT, _OUT, _RINGS))
    spokes = 2 * np.pi * np.arange(_SPOKES + 1) / _SPOKES
    ring, spoke = np.meshgrid(rings, spokes, indexing="ij")
    flat = (np.exp(ring) * np.array([np.cos(spoke), np.sin(spoke)])).reshape(2, -1).T
    nodes = np.column_stack([center[:2] + radius * flat, np.full(len(flat), points[0, 2])])
    offset = points - center
    away, turn = np.hypot(offset[:, 0], offset[:, 1]) / radius, np.arctan2(offset[:, 1], offset[:, 0])
    outward = (np.log(np.clip(away, _FOOT, _OUT)) - rings[0]) / (rings[1] - rings[0])
    place = np.column_stack([outward, np.mod(turn, 2 * np.pi) * _SPOKES / (2 * np.pi)])
    weight = np.where(away < _OUT, (offset**2).sum(1) ** -1.5, 0.0)
    return Nodes(center, radius, nodes, ring.shape, place, weight)


@dataclass(frozen=True, slots=True)
class Thrown:
    """What balls throw onto points of the board, wherever the lamp is."""

    count: int
    sample: Nodes | None
    polished: tuple[Nodes, ...]

    @classmethod
    def onto(cls, points: np.ndarray, sample: np.ndarray | None, polished: np.ndarray) -> Thrown:
        """``points`` (n, 3) of the board; ``sample`` (4,) and ``polished`` (k, 4): centres and radii."""
        return cls(
            len(points),
            None if sample is None else _grid(points, sample[:3], float(sample[3]), _GRID),
            tuple(_rings(points, ball[:3], float(ball[3])) for ball in polished),
        )

    def of(self, light: np.ndarray) -> np.ndarray:
        """Irradiance (n, 3) by a lamp of unit strength at ``light`` (3,): the sample a white diffuse and a glossy one,
        the polished ones perfect mirrors."""
        thrown = np.zeros((self.count, 3))
        if self.sample is not None:
            thrown[:, :2] = self.sample.columns(light)
        for ball in self.polished:
            thrown[:, 2] += ball.mirrored(light)
        return thrown


@jit
def _between(planes, place, result):
    """``planes`` (a, b, p) on whole numbers, linearly interpolated at ``place`` (n, 2) within them."""
    across, along = planes.shape[0] - 2, planes.shape[1] - 2
    for k in range(len(place)):
        i, j = min(int(place[k, 0]), across), min(int(place[k, 1]), along)
        u, v = place[k, 0] - i, place[k, 1] - j
        for p in range(planes.shape[2]):
            near = planes[i, j, p] + v * (planes[i, j + 1, p] - planes[i, j, p])
            far = planes[i + 1, j, p] + v * (planes[i + 1, j + 1, p] - planes[i + 1, j, p])
            result[k, p] = near + u * (far - near)


def bounce_on_patch(points: np.ndarray, light: np.ndarray, center: np.ndarray, radius: float) -> np.ndarray:
    """As :func:`bounce_columns`, with nodes so close that cells are small beside their distance from the ball; but
    point by point where points are fewer than these."""
    extent, away = np.ptp(points, axis=0), np.linalg.norm(points - center, axis=1).min() - radius
    grid = max(_GRID, int(np.ceil(extent.max() / max(_SMOOTH * away, 1e-12))) + 2)
    if extent[2] == 0.0 and grid**2 < len(points):
        return bounce_columns(points, light, center, radius, grid)
    return np.column_stack([part(points, light, center, radius) for part in (diffuse_bounce, glossy_bounce)])


def diffuse_bounce(points: np.ndarray, light: np.ndarray, center: np.ndarray, radius: float) -> np.ndarray:
    """From a Lambertian ball of albedo 1, (n,): a sum over facets of equal area, each lit by the lamp and, from
    below, by the board."""
    normal = _fibonacci(_FACETS)
    place = center + radius * normal
    offset = light - place
    lit = np.clip(np.einsum("ij,ij->i", offset, normal), 0, None) / (offset**2).sum(1) ** 1.5
    lit += _from_board(place, normal, light, center, radius)
    area = 4 * np.pi * radius**2 / _FACETS
    result = np.empty(len(points))
    _gather(np.ascontiguousarray(points, float), place, normal, lit * area / np.pi, area, result)
    return result


@in_lanes
def _gather(points, place, normal, lit, area, result):
    """Irradiance on the board's plane at ``points`` (n, 3) from Lambertian facets of radiosity over pi ``lit`` (f,)."""
    for k in range(len(points)):
        total = 0.0
        for f in range(len(place)):
            x, y, z = points[k, 0] - place[f, 0], points[k, 1] - place[f, 1], points[k, 2] - place[f, 2]
            squared = max(
                x * x + y * y + z * z, area
            )  # the sum is coarse where a point all but touches the ball
            leaving = max(x * normal[f, 0] + y * normal[f, 1] + z * normal[f, 2], 0.0)
            total += leaving * max(-z, 0.0) / (squared * squared) * lit[f]
        result[k] = total


def _from_board(
    place: np.ndarray, normal: np.ndarray, light: np.ndarray, center: np.ndarray, radius: float
) -> np.ndarray:
    """Irradiance (f,) of a ball's facets by the board, for a lamp of unit strength.

    A facet sees the board with (1 - n_z) / 2 of its cosine-weighted sky, and the board there is taken as lit as its
    brightest part from the facet: where the facet's normal, turned down by half a right angle, meets it.
    """
    down = normal[:, 2:] - 1.0
    foot = place[:, :2] - normal[:, :2] * place[:, 2:] / np.minimum(down, -0.1)
    points = np.column_stack([foot, np.zeros(len(foot))])
    share = lit_fraction(points, np.asarray(light, float), 0.2 * radius, np.array([[*center, radius]]), 0.0)
    return _BOARD * (1 - normal[:, 2]) / 2 * direct(points, np.asarray(light, float)) * share


def polished_bounce(points: np.ndarray, light: np.ndarray, balls: np.ndarray) -> np.ndarray:
    """From perfect mirror balls (k, 4: centre, radius) that stand on the board, (n,), nothing beyond 30 radii.

    Times the cube of the distance it is smooth, and is interpolated between nodes in rings about each ball.
    """
    rings = (_rings(points, ball[:3], float(ball[3])) for ball in balls)
    return sum((one.mirrored(light) for one in rings), np.zeros(len(points)))


def glossy_bounce(
    points: np.ndarray, light: np.ndarray, center: np.ndarray, radius: float, f0: float = _F0
) -> np.ndarray:
    """From a mirror ball of reflectance ``f0`` at normal incidence, (n,): the lamp's virtual images in the two
    principal sections (Coddington's equations)."""
    result = np.empty(len(points))
    rows = (np.ascontiguousarray(one, float) for one in (points, light, center))
    _glossy(*rows, float(radius), float(f0), result)
    return result


@borrowing
def _glossy(points, light, center, radius, f0, result):
    for k in range(len(points)):
        nx, ny, nz = halfway(center, points[k], light, radius)
        px, py, pz = center[0] + radius * nx, center[1] + radius * ny, center[2] + radius * nz
        x, y, z = points[k, 0] - px, points[k, 1] - py, points[k, 2] - pz
        far = math.sqrt(x * x + y * y + z * z)
        cosine = (x * nx + y * ny + z * nz) / far
        if cosine <= 1e-3 or z >= 0:
            result[k] = 0.0
            continue
        cosine = min(cosine, 1.0)
        reach = math.sqrt((light[0] - px) ** 2 + (light[1] - py) ** 2 + (light[2] - pz) ** 2)
        tangential = 1 / (1 / reach + 2 / (radius * cosine))
        sagittal = 1 / (1 / reach + 2 * cosine / radius)
        spread = tangential * sagittal / ((tangential + far) * (sagittal + far) * reach * reach)
        result[k] = (f0 + (1 - f0) * (1 - cosine) ** 5) * spread * -z / far


@lru_cache(maxsize=4)
def _fibonacci(count: int) -> np.ndarray:
    """Nearly even unit vectors, (count, 3)."""
    step = np.arange(count) + 0.5
    z = 1 - 2 * step / count
    turn = step * np.pi * (1 + np.sqrt(5))
    flat = np.sqrt(1 - z**2)
    return np.column_stack([flat * np.cos(turn), flat * np.sin(turn), z])
