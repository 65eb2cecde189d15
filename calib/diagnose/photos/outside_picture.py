"""Photos that do not show the sample."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogonio.calib.adjust.state import State
from photogonio.calib.diagnose.base import Departure, Stage
from photogonio.calib.geometry.board import board_size
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import MANIFEST, PhotoSet, Plane, Sphere

_FAR_OFF = 10.0  # board diagonals: a sample as far is told in another unit


class SampleOutsidePicture(Departure):
    """Views in whose picture no part of the sample lies are left out."""

    stage = Stage.MANIFEST
    entries = (
        Entry(
            "sample-outside-picture",
            "The sample lies outside a photo, which is left out.",
            "If it does not: correct the sample's place in the manifest, or the unit of its lengths.",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        out = [
            one.view.name
            for one in state.observations
            if not one.probe and not sample_in_picture(state.camera, one.pose, state.photoset.sample)
        ]
        lost = all(one.probe or one.view.name in out for one in state.observations)
        return [Diagnosis("sample-outside-picture", amount=len(out), views=tuple(out))] if out or lost else []

    def remedy(self, state: State, found: Sequence[Diagnosis]) -> State:
        out = found[0].views
        for name in out:
            state.remarks.leave_out(name, "the sample lies outside the picture", "sample-outside-picture")
        kept = [one for one in state.observations if one.view.name not in out]
        if all(one.probe for one in kept):
            why = state.remarks.reasons() + _other_unit(state.photoset)
            raise InputError(state.photoset.folder / MANIFEST, "no sample photo can be used: " + why)
        return state.keeping(kept)


def sample_in_picture(camera: Camera, pose: Pose, sample: Sphere | Plane) -> bool:
    """Whether any of the sample's outline or middle lies within the picture."""
    if isinstance(sample, Sphere):
        points = np.asarray(sample.center, float) + sample.radius * np.vstack(
            [np.zeros(3), np.eye(3), -np.eye(3)]
        )
    else:
        flat = np.asarray(sample.outline, float)
        flat = np.vstack([flat, flat.mean(0), (flat + np.roll(flat, 1, axis=0)) / 2])
        points = np.column_stack([flat, np.full(len(flat), sample.height)])
    ahead = pose.apply(points)[:, 2] > 0
    pixels = camera.project(pose, points[ahead]) if ahead.any() else np.zeros((0, 2))
    inside = (pixels >= -0.5).all(1) & (pixels <= np.array(camera.size) - 0.5).all(1)
    return bool(inside.any())


def _other_unit(photoset: PhotoSet) -> str:
    """A hint, where the sample lies so far from the board that one of them may be told in another unit."""
    if photoset.board is None:
        return ""
    sample, size = photoset.sample, board_size(photoset.board)
    flat = sample.center[:2] if isinstance(sample, Sphere) else np.mean(sample.outline, axis=0)
    if np.linalg.norm(flat - size / 2) < _FAR_OFF * np.linalg.norm(size):
        return ""
    width, height = size
    return (
        f". It is told to be at [{flat[0]:g}, {flat[1]:g}], the board to be {width:g} x {height:g} large: all lengths "
        "must be in one unit"
    )
