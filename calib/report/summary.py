"""What a calibration found, with its errors, in numbers and for the eye."""

from __future__ import annotations

import numpy as np

from photogonio.calib.adjust.camera_model import pose_block, project
from photogonio.calib.adjust.lamps import expected_pixel
from photogonio.calib.adjust.state import Settled, State
from photogonio.calib.detect.observation import Observation
from photogonio.calib.geometry.board import Corners
from photogonio.calib.geometry.camera import Pose
from photogonio.calib.remarks import Remarks
from photogonio.calib.setup import Marks
from photogonio.capture.photoset import PhotoSet


def account(state: State) -> None:
    """Fill in residuals and standard errors."""
    settled, remarks = state.settled, state.remarks
    _camera(settled, remarks)
    remarks.residuals["corner_residual_sigmas"] = settled.corner_rms
    if settled.scene is not None and settled.shading:
        error = float(np.sqrt(settled.covariance["lamp"][0, 0])) * settled.scene.lamp_radius
        remarks.residuals["lamp_radius"] = settled.scene.lamp_radius
        remarks.residuals["lamp_radius_error"] = error
        rms = [f.rms for f in settled.shading.values()]
        remarks.residuals["shading_rms"] = float(np.median(rms))


def _camera(settled: Settled, remarks: Remarks) -> None:
    covariance = settled.covariance.get("camera")
    if covariance is None:
        return
    told = remarks.residuals.setdefault("camera", {})
    if isinstance(told, dict):
        names = ["fx", "fy", "cx", "cy", *(f"distortion[{k}]" for k in settled.model.free)]
        told["standard_errors"] = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
        told["corner_error_px"] = corner_error(settled, covariance)


def corner_error(settled: Settled, covariance: np.ndarray) -> float:
    """Standard error, pixels, of where a far point at the picture's corner is projected."""
    camera = settled.camera
    ray = camera.rays(np.array([[0.0, 0.0]]))
    _, _, by_camera, _ = project(
        settled.model, settled.values["camera"], pose_block(Pose(np.eye(3), np.zeros(3))), ray
    )
    spread = by_camera[0] @ covariance @ by_camera[0].T
    return float(np.sqrt(np.trace(spread) / 2))


def marks(photoset: PhotoSet, settled: Settled, observation: Observation) -> Marks:
    """What was found in one photo, for the eye."""
    empty = np.zeros((0, 2))
    corners, misses = empty, empty
    if observation.corners is not None:
        corners = observation.corners.pixels
        misses = settled.camera.project(observation.pose, observation.corners.points) - corners
    lamp = settled.lamps.get(observation.light)
    expected = [
        expected_pixel(settled.camera, observation, lamp, settled.values, k)
        for k in range(len(photoset.mirror_balls))
        if lamp is not None
    ]
    return Marks(
        corners,
        misses,
        observation.rejected,
        empty if observation.limb is None else observation.limb.pixels,
        np.array([h.pixel for h in observation.highlights]).reshape(-1, 2),
        np.array([e for e in expected if np.isfinite(e).all()]).reshape(-1, 2),
    )


def board_marks(settled: Settled, corners: Corners, pose: Pose) -> Marks:
    """The board's corners in one calibration photo."""
    empty = np.zeros((0, 2))
    misses = settled.camera.project(pose, corners.points) - corners.pixels
    return Marks(corners.pixels, misses, empty, empty, empty, empty)
