"""Which pairs of directions a photo would see of a ball or of a flat piece, from where camera and lamp stand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

COUNT = 28  # pairs that stand for all pixels of a photo
TRIED = 2500  # normals of which those are taken that are lit and seen
STEEPEST = np.radians(86.0)  # from the normal
ACROSS = (-0.7, 0.0, 0.7)  # of a flat piece's half sides: where its pairs are taken
PLASTIC = 0.7548776662466927, 0.5698402909980532  # a sequence whose every beginning is even (Roberts 2018)


@dataclass(frozen=True, slots=True)
class SeenPairs:
    """Directions in the frame of each point; radians."""

    theta_i: np.ndarray  # (n,)
    phi_i: np.ndarray  # (n,)
    theta_r: np.ndarray  # (n,)
    phi_r: np.ndarray  # (n,)

    def __len__(self) -> int:
        return len(self.theta_i)

    @property
    def angles(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """As a BRDF takes them."""
        return self.theta_i, self.phi_i, self.theta_r, self.phi_r

    @property
    def dphi(self) -> np.ndarray:
        """(n,) between the azimuths, from 0 to pi."""
        return np.arccos(np.clip(np.cos(self.phi_r - self.phi_i), -1.0, 1.0))


@lru_cache(maxsize=1)
def _normals() -> np.ndarray:
    """(TRIED, 3) unit vectors all around, every beginning of which is even."""
    step = np.arange(1, TRIED + 1)[:, None]
    u, v = ((0.5 + step * np.array(PLASTIC)) % 1.0).T
    z = 2 * u - 1
    side = np.sqrt(1 - z**2)
    return np.column_stack([side * np.cos(2 * np.pi * v), side * np.sin(2 * np.pi * v), z])


def ball_pairs(lamp: np.ndarray, camera: np.ndarray, center: np.ndarray, radius: float) -> SeenPairs:
    """Of a ball, seen from ``camera`` (3,) and lit from ``lamp`` (3,), both places in the frame of ``center``."""
    normal = _normals()
    points = center + radius * normal
    return _thinned(_pairs(points, normal, lamp, camera))


def flat_pairs(
    lamp: np.ndarray, camera: np.ndarray, center: np.ndarray, half: tuple[float, float]
) -> SeenPairs:
    """Of a flat piece that lies level, its half sides ``half``."""
    x, y = np.meshgrid(ACROSS, ACROSS)
    points = center + np.column_stack([x.ravel() * half[0], y.ravel() * half[1], np.zeros(x.size)])
    normal = np.broadcast_to([0.0, 0.0, 1.0], points.shape)
    return _pairs(points, normal, lamp, camera)


def _pairs(points: np.ndarray, normal: np.ndarray, lamp: np.ndarray, camera: np.ndarray) -> SeenPairs:
    incident, leaving = (_unit(place - points) for place in (lamp, camera))
    theta_i, theta_r = (np.arccos(np.clip((d * normal).sum(1), -1.0, 1.0)) for d in (incident, leaving))
    shown = (theta_i < STEEPEST) & (theta_r < STEEPEST)
    normal, incident, leaving = normal[shown], incident[shown], leaving[shown]
    across = _unit(np.cross([0.0, 1.0, 0.0], normal) + np.array([1e-12, 0.0, 0.0]))
    along = np.cross(normal, across)
    phi_i, phi_r = (np.arctan2((d * along).sum(1), (d * across).sum(1)) for d in (incident, leaving))
    return SeenPairs(theta_i[shown], phi_i, theta_r[shown], phi_r)


def _thinned(pairs: SeenPairs) -> SeenPairs:
    return SeenPairs(*(angle[:COUNT] for angle in pairs.angles))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)
