"""Where things were in every photo: the result of calibration, and its file ``setup.json``."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from calib.camera import Camera, Pose
from capture.photoset import Plane, Sphere


@dataclass(frozen=True, slots=True)
class Light:
    """One light position. ``place`` is a point in the world frame, or a unit direction toward the light."""

    id: str
    kind: str  # "point" | "directional"
    place: np.ndarray  # (3,) length units, or unit vector
    covariance: np.ndarray  # (3, 3) of place
    source: str  # "given" | "camera" | "markers" | "mirror balls" | "probe" | "refined"
    radius: float = 0.0  # of the glowing ball; 0: unknown or a point
    residual: float = float("nan")  # rms miss distance of the highlights' rays, length units (radians if directional)

    def toward(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unit vectors (n, 3) from world points (n, 3) to the light and 1/r^2 (n,), which is 1 if directional."""
        if self.kind == "directional":
            return np.broadcast_to(self.place, points.shape), np.ones(len(points))
        offset = self.place - points
        squared = np.einsum("ij,ij->i", offset, offset)
        return offset / np.sqrt(squared)[:, None], 1.0 / squared


@dataclass(frozen=True, slots=True)
class ViewSetup:
    """One sample view: where the camera stood, which light shone, and how strongly.

    Irradiance at a point with unit normal n is ``strength * (n . toward) * falloff`` with
    ``toward, falloff = light.toward(point)``.
    """

    name: str  # the view's first file
    light: Light
    pose: Pose
    strength: np.ndarray  # (c,) radiance units x length^2 (point) or radiance units (directional)
    strength_error: np.ndarray  # (c,) standard error
    strength_source: str  # "white patch" | "board" | "intensity" | "none"
    pose_rms: float = float("nan")  # reprojection residual of the board, pixels


@dataclass(frozen=True, slots=True)
class LeftOut:
    name: str  # photo
    reason: str


@dataclass(frozen=True, slots=True)
class Setup:
    """Everything calibration found."""

    camera: Camera
    sample: Sphere | Plane  # as refined
    views: tuple[ViewSetup, ...]
    scale: str  # "absolute" | "relative"
    channels: tuple[str, ...]
    left_out: tuple[LeftOut, ...] = ()
    warnings: tuple[str, ...] = ()
    residuals: dict[str, object] = field(default_factory=dict)  # what was measured on the way; plain JSON values
