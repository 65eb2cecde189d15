"""What one photo shows of the blocks that are adjusted: corners of the board, highlights in balls, limbs of balls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from photogonio.calib.adjust.bundle import Derivatives, Term, Values
from photogonio.calib.adjust.camera_model import CameraModel, block_pose, project
from photogonio.calib.geometry.board import Corners
from photogonio.calib.geometry.camera import Pose, focal
from photogonio.calib.geometry.cones import cone_derivatives, cone_residual
from photogonio.calib.geometry.mirror import mirrored_direction, mirrored_point

_PIXEL_STEP, _LENS_STEP = 0.1, 1e-4  # for derivatives by the camera's values
_DIFFERENCE = 1e-5  # of a length's own size, for derivatives


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
