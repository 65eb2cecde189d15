"""One adjustment of everything: camera, poses, lamps, mirror balls and sample, from corners, highlights, limbs and
shading together (Triggs et al., "Bundle adjustment: a modern synthesis", 2000).

Values live in one vector, cut into named blocks. Every term gives its residuals, in standard errors, and their
derivatives by block; the sparse least squares is SciPy's, robust on what may be wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import least_squares
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import aslinearoperator

from photogonio.calib.geometry.board import Corners
from photogonio.calib.geometry.camera import Camera, Pose, focal
from photogonio.calib.geometry.cones import cone_derivatives, cone_residual
from photogonio.calib.geometry.mirror import mirrored_direction, mirrored_point

_ROBUST = 3.0  # standard errors beyond which a robust row counts less
_ROUNDS = 50
_PIXEL_STEP, _LENS_STEP = 0.1, 1e-4  # for derivatives by the camera's values
_DIFFERENCE = 1e-5  # of a length's own size, for derivatives

Values = dict[str, np.ndarray]
Derivatives = dict[str, np.ndarray]
Term = Callable[[Values], tuple[np.ndarray, Derivatives]]


@dataclass(frozen=True, slots=True)
class CameraModel:
    """What a camera block means: which distortion terms it holds, the picture's size, and what is expected."""

    size: tuple[int, int]
    distortion: np.ndarray  # the whole vector, OpenCV's order
    free: tuple[int, ...]  # indices in it that the block holds after fx, fy, cx, cy
    aspect: float = 0.0  # standard error of fy / fx about 1; 0: nothing is expected of it
    centre: float = 0.0  # pixels, of the principal point about the picture's middle; 0: the same
    held: tuple[
        tuple[int, float], ...
    ] = ()  # free terms that are expected about 0, with their standard errors

    def camera(self, block: np.ndarray) -> Camera:
        matrix = np.array([[block[0], 0, block[2]], [0, block[1], block[3]], [0, 0, 1.0]])
        distortion = self.distortion.copy()
        distortion[list(self.free)] = block[4:]
        return Camera(matrix, distortion, self.size)

    def block(self, camera: Camera) -> np.ndarray:
        """Inverse of :meth:`camera`."""
        m = camera.matrix
        return np.concatenate([[m[0, 0], m[1, 1], m[0, 2], m[1, 2]], camera.distortion[list(self.free)]])


def camera_term(model: CameraModel) -> Term:
    """What is expected of the terms that the photos do not ask for.

    They are not fixed: what is not known of them counts in the errors of all others.
    """
    middle = (np.array(model.size, float) - 1) / 2

    def term(values: Values) -> tuple[np.ndarray, Derivatives]:
        block = values["camera"]
        rows: list[tuple[float, dict[int, float]]] = []
        if model.aspect:
            ratio, unit = block[1] / block[0], model.aspect * block[0]
            rows.append(((ratio - 1) / model.aspect, {0: -ratio / unit, 1: 1 / unit}))
        if model.centre:
            rows += [((block[2 + k] - middle[k]) / model.centre, {2 + k: 1 / model.centre}) for k in (0, 1)]
        for index, sigma in model.held:
            place = 4 + model.free.index(index)
            rows.append((block[place] / sigma, {place: 1 / sigma}))
        design = np.zeros((len(rows), len(block)))
        for k, (_, entries) in enumerate(rows):
            for place, value in entries.items():
                design[k, place] = value
        return np.array([value for value, _ in rows]), {"camera": design}

    return term


def pose_block(pose: Pose) -> np.ndarray:
    """Rotation vector and translation, (6,); inverse of :func:`block_pose`."""
    return np.concatenate([pose.rodrigues(), pose.translation])


def block_pose(block: np.ndarray) -> Pose:
    return Pose.from_rodrigues(block[:3], block[3:])


def project(
    model: CameraModel, camera: np.ndarray, pose: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Pixels (n, 2) and derivatives by pose (n, 2, 6), camera (n, 2, k) and point (n, 2, 3)."""
    made = model.camera(camera)
    flat = np.ascontiguousarray(points, float).reshape(-1, 1, 3)
    pixels, jacobian = cv2.projectPoints(flat, pose[:3], pose[3:], made.matrix, made.distortion)
    jacobian = jacobian.reshape(len(points), 2, -1)
    by_shift = jacobian[:, :, 3:6]
    rotation = cv2.Rodrigues(pose[:3])[0]
    columns = [6, 7, 8, 9, *(10 + k for k in model.free)]
    return pixels.reshape(-1, 2), jacobian[:, :, :6], jacobian[:, :, columns], by_shift @ rotation


def corner_term(model: CameraModel, pose_name: str, corners: Corners) -> Term:
    """Reprojection of the board's corners in one photo, two rows a corner."""

    def term(values: Values) -> tuple[np.ndarray, Derivatives]:
        pixels, by_pose, by_camera, _ = project(model, values["camera"], values[pose_name], corners.points)
        weight = np.repeat(1 / corners.sigma, 2)
        rows = 2 * len(corners)
        residual = (pixels - corners.pixels).ravel() * weight
        return residual, {
            "camera": by_camera.reshape(rows, -1) * weight[:, None],
            pose_name: by_pose.reshape(rows, -1) * weight[:, None],
        }

    return term


@dataclass(frozen=True, slots=True)
class Sighting:
    """One highlight: which blocks it ties together."""

    pose: str
    light: str
    ball: str  # centre and radius
    directional: bool
    attached: bool  # the light's block is a place in the camera's frame
    pixel: np.ndarray  # (2,)
    sigma: float


def highlight_term(model: CameraModel, sightings: Sequence[Sighting]) -> Term:
    """Where the lamps are seen in the mirror balls, two rows each."""
    members: dict[str, list[int]] = {}  # by photo
    for k, s in enumerate(sightings):
        members.setdefault(s.pose, []).append(k)
    place = [members[s.pose].index(k) for k, s in enumerate(sightings)]

    def term(values: Values) -> tuple[np.ndarray, Derivatives]:
        points, by_eye, by_light, by_ball = _mirrored(sightings, values)
        residual = np.empty(2 * len(sightings))
        parts: dict[str, np.ndarray] = {}
        shown = {n: project(model, values["camera"], values[n], points[own]) for n, own in members.items()}
        eyes = {name: _world_by_pose(values[name], np.zeros(3)) for name in members}
        for k, s in enumerate(sightings):
            pose = values[s.pose]
            pixel, by_pose, by_camera, by_point = (part[place[k]] for part in shown[s.pose])
            rows = slice(2 * k, 2 * k + 2)
            residual[rows] = (pixel - s.pixel) / s.sigma
            by_place = by_point / s.sigma
            pieces = {
                "camera": by_camera / s.sigma,
                s.pose: by_pose / s.sigma + by_place @ by_eye[k] @ eyes[s.pose],
                s.light: by_place @ by_light[k],
                s.ball: by_place @ by_ball[k],
            }
            if s.attached:
                pieces[s.pose] += by_place @ by_light[k] @ _world_by_pose(pose, values[s.light])
                pieces[s.light] = pieces[s.light] @ block_pose(pose).rotation.T
            for name, piece in pieces.items():
                whole = parts.setdefault(name, np.zeros((len(residual), piece.shape[1])))
                whole[rows] += piece
        return residual, parts

    return term


def _world_by_pose(pose: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Derivative (3, 6) by rotation vector and translation of the world point that the camera has at ``place``."""
    rotation, by_vector = cv2.Rodrigues(pose[:3])
    by_vector = by_vector.reshape(3, 3, 3)  # [parameter, row, column] of the rotation
    turned = np.einsum("prc,r->cp", by_vector, place - pose[3:])
    return np.hstack([turned, -rotation.T])


def _mirrored(sightings: Sequence[Sighting], values: Values) -> tuple[np.ndarray, ...]:
    """Mirroring points (n, 3) and derivatives by eye (n, 3, 3), light (n, 3, 3), and ball (n, 3, 4)."""
    poses = [block_pose(values[s.pose]) for s in sightings]
    eye = np.array([p.center for p in poses])
    light = np.array(
        [_in_world(values[s.light], p, s.attached) for s, p in zip(sightings, poses, strict=True)]
    )
    ball = np.array([values[s.ball] for s in sightings])
    base = np.hstack([eye, light, ball])
    step = _DIFFERENCE * np.repeat(ball[:, 3:4], 10, axis=1)
    far = np.array([s.directional for s in sightings])
    step[:, 3:6] = np.where(far[:, None], 1e-6, step[:, 3:6])

    def solve(x: np.ndarray) -> np.ndarray:
        eye, light, center, radius = x[..., :3], x[..., 3:6], x[..., 6:9], x[..., 9:]
        near = mirrored_point(center, radius, eye, light)
        if not far.any():
            return near
        toward = light / np.linalg.norm(light, axis=-1, keepdims=True)
        return np.where(far[:, None], mirrored_direction(center, radius, eye, toward), near)

    moves = np.eye(10)[:, None] * step  # one value of all sightings at a time
    middle, ahead, behind = np.split(solve(np.concatenate([base[None], base + moves, base - moves])), [1, 11])
    derivative = np.moveaxis((ahead - behind) / (2 * step.T[:, :, None]), 0, 2)
    return middle[0], derivative[:, :, :3], derivative[:, :, 3:6], derivative[:, :, 6:]


def _in_world(place: np.ndarray, pose: Pose, attached: bool) -> np.ndarray:
    return pose.inverse().apply(place) if attached else place


def limb_term(model: CameraModel, pose_name: str, ball: str, pixels: np.ndarray, sigma: np.ndarray) -> Term:
    """Limb of a ball in one photo, one row a point; ``limb offset`` is a bias that all limbs share, pixels."""

    def miss(block: np.ndarray, axis: np.ndarray, radius: float) -> np.ndarray:
        camera = model.camera(block)
        return cone_residual(camera.rays(pixels), axis, radius, focal(camera))

    def by_camera(block: np.ndarray, axis: np.ndarray, radius: float) -> np.ndarray:
        step = np.r_[np.full(4, _PIXEL_STEP), np.full(len(block) - 4, _LENS_STEP)]
        ahead = [miss(block + move, axis, radius) for move in np.diag(step)]
        behind = [miss(block - move, axis, radius) for move in np.diag(step)]
        return (np.array(ahead) - np.array(behind)).T / (2 * step)

    def term(values: Values) -> tuple[np.ndarray, Derivatives]:
        camera = model.camera(values["camera"])
        rays, focal_length = camera.rays(pixels), focal(camera)
        pose, ball_now = values[pose_name], values[ball]
        axis = block_pose(pose).apply(ball_now[:3])
        residual = cone_residual(rays, axis, ball_now[3], focal_length) + values["limb offset"]
        by_axis, by_radius = cone_derivatives(rays, axis, ball_now[3], focal_length)
        rotation, by_vector = cv2.Rodrigues(pose[:3])
        turned = np.einsum("prc,c->rp", by_vector.reshape(3, 3, 3), ball_now[:3])
        return residual / sigma, {
            "camera": by_camera(values["camera"], axis, ball_now[3]) / sigma[:, None],
            pose_name: np.hstack([by_axis @ turned, by_axis]) / sigma[:, None],
            ball: np.hstack([by_axis @ rotation, np.full((len(rays), 1), by_radius)]) / sigma[:, None],
            "limb offset": 1 / sigma[:, None],
        }

    return term


@dataclass(frozen=True, slots=True)
class Part:
    """Some values of a block, mapped: ``turn @ block[where] + shift``."""

    block: str
    where: slice
    turn: np.ndarray | None = None
    shift: np.ndarray | None = None

    def value(self, values: Values) -> np.ndarray:
        taken = values[self.block][self.where]
        return taken if self.turn is None else self.turn @ taken + self.shift


def quadratic_term(parts: Sequence[Part], at: np.ndarray, normal: np.ndarray, slope: np.ndarray) -> Term:
    """A term known by its information matrix and gradient at ``at``, the values of ``parts`` in a row."""
    size, axes = np.linalg.eigh((normal + normal.T) / 2)
    strong = size > 1e-10 * size.max()
    root = np.sqrt(size[strong])
    rows = root[:, None] * axes[:, strong].T
    start = (axes[:, strong].T @ slope) / root

    def term(values: Values) -> tuple[np.ndarray, Derivatives]:
        now = np.concatenate([p.value(values) for p in parts])
        derivatives: Derivatives = {}
        column = 0
        for p in parts:
            width = len(values[p.block][p.where])
            piece = rows[:, column : column + width]
            whole = derivatives.setdefault(p.block, np.zeros((len(rows), len(values[p.block]))))
            whole[:, p.where] += piece if p.turn is None else piece @ p.turn
            column += width
        return start + rows @ (now - at), derivatives

    return term


def prior_term(name: str, mean: np.ndarray, sigma: np.ndarray) -> Term:
    """A block expected at ``mean`` within ``sigma``."""

    def term(values: Values) -> tuple[np.ndarray, Derivatives]:
        return (values[name] - mean) / sigma, {name: np.diag(1 / np.asarray(sigma, float))}

    return term


@dataclass(frozen=True, slots=True)
class Adjusted:
    """The result of one adjustment."""

    values: Values
    covariance: dict[str, np.ndarray]  # of each block, the others free
    residuals: list[np.ndarray]  # of each term, in standard errors
    cost: float


def adjust(
    start: Values, terms: Sequence[tuple[Term, bool]], fixed: frozenset[str] = frozenset()
) -> Adjusted:
    """Least squares over all blocks but the ``fixed`` ones; each term comes with whether its loss is robust."""
    names = [n for n in start if n not in fixed]
    edges = np.cumsum([0] + [len(start[n]) for n in names])
    place = {n: slice(edges[k], edges[k + 1]) for k, n in enumerate(names)}
    sizes = [len(t(start)[0]) for t, _ in terms]
    robust = np.repeat([r for _, r in terms], sizes)

    origin = np.concatenate([start[n] for n in names])

    latest: list[tuple[bytes, list[tuple[np.ndarray, Derivatives]]]] = []

    def unpack(x: np.ndarray) -> Values:
        return start | {n: x[place[n]] for n in names}

    def worked_out(x: np.ndarray) -> list[tuple[np.ndarray, Derivatives]]:
        """All terms; residuals and derivatives at the same place are asked for one after the other."""
        if not latest or latest[0][0] != x.tobytes():
            values = unpack(x)
            latest[:] = [(x.tobytes(), [term(values) for term, _ in terms])]
        return latest[0][1]

    def residual(x: np.ndarray) -> np.ndarray:
        return np.concatenate([found for found, _ in worked_out(x)])

    def jacobian(x: np.ndarray) -> csr_matrix:
        return _assemble([slopes for _, slopes in worked_out(x)], sizes, place, int(edges[-1]))

    def loss(z: np.ndarray) -> np.ndarray:
        return _mixed_loss(z, robust)

    # in steps of the first Jacobian's Cholesky factor all directions weigh alike, and LSMR needs few iterations
    basis = _basis(_normal(jacobian(origin), residual(origin), robust))
    found = least_squares(
        lambda y: residual(origin + basis @ y),
        np.zeros(len(origin)),
        jac=lambda y: aslinearoperator(jacobian(origin + basis @ y)) @ aslinearoperator(basis),
        loss=loss,
        tr_solver="lsmr",
        ftol=1e-8,
        xtol=1e-9,
        max_nfev=_ROUNDS,
    )
    x = origin + basis @ found.x
    last = residual(x)
    inverse = _inverse(_normal(jacobian(x), last, robust))
    values = unpack(x)
    return Adjusted(
        {n: np.array(v) for n, v in values.items()},
        {n: inverse[place[n], place[n]] for n in names},
        np.split(last, np.cumsum(sizes)[:-1]),
        float(found.cost),
    )


def _normal(jacobian: csr_matrix, residual: np.ndarray, robust: np.ndarray) -> np.ndarray:
    """Dense J' W J with the weights of the robust loss."""
    weight = _mixed_loss(residual**2, robust)[1]
    return (jacobian.T @ jacobian.multiply(weight[:, None])).toarray()


def _basis(normal: np.ndarray) -> np.ndarray:
    """Columns in which ``normal`` becomes the unit matrix."""
    scale = 1 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    scaled = normal * scale * scale[:, None] + 1e-12 * np.eye(len(normal))
    return scale[:, None] * solve_triangular(cholesky(scaled, lower=True), np.eye(len(normal)), lower=True).T


def _mixed_loss(z: np.ndarray, robust: np.ndarray) -> np.ndarray:
    """SciPy's loss and its two derivatives, (3, n): Cauchy's on robust rows, plain squares on the others."""
    scaled = z / _ROBUST**2
    return np.array(
        [
            np.where(robust, _ROBUST**2 * np.log1p(scaled), z),
            np.where(robust, 1 / (1 + scaled), 1.0),
            np.where(robust, -1 / (_ROBUST**2 * (1 + scaled) ** 2), 0.0),
        ]
    )


def _inverse(normal: np.ndarray) -> np.ndarray:
    """Inverse of a normal matrix, scaled first so that units do not matter."""
    scale = 1 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    return (
        scale[:, None] * np.linalg.pinv(normal * scale * scale[:, None], rcond=1e-14, hermitian=True) * scale
    )


def _assemble(parts: list[Derivatives], sizes: list[int], place: dict[str, slice], width: int) -> csr_matrix:
    rows, columns, entries = [], [], []
    top = 0
    for derivatives, size in zip(parts, sizes, strict=True):
        for name, matrix in derivatives.items():
            if name in place and size:
                y, x = np.nonzero(matrix)
                rows.append(top + y)
                columns.append(place[name].start + x)
                entries.append(matrix[y, x])
        top += size
    flat = (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns)))
    return csr_matrix(flat, shape=(top, width))
