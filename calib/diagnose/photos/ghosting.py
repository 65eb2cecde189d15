"""What moved between the exposures of a bracket: where they disagree, nothing is measured, and a person is told."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogonio.calib.adjust.state import State
from photogonio.calib.detect.observation import Observation
from photogonio.calib.detect.photo_reader import Reader
from photogonio.calib.diagnose.base import Departure, Stage
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.cones import outline
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.photoset import Plane, Sphere

_TOLD = 0.01  # of the sample's part of the picture


class MovedInBracket(Departure):
    """Views whose exposures disagree over more than a hundredth of the sample."""

    stage = Stage.STRENGTH
    entries = (
        Entry(
            "moved-in-bracket",
            "Something moved between the exposures of a bracket; that part of the sample's picture is not used.",
            "Nothing, if it is a small part.",
            least=0.01,
            source="of the sample's part of the picture; of drawn brackets in which nothing moved, over four decades "
            "of light, no pixel",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        shares = {
            one.view.name: _ghost_share(state.reader, state.settled.camera, state.photoset.sample, one)
            for one in state.observations
            if len(one.view.photos) > 1
        }
        return [
            Diagnosis(
                "moved-in-bracket",
                f"{name}: something moved between the exposures of its bracket: {share:.0%} of the sample's part of "
                "the picture is not used",
                amount=share,
                least=_TOLD,
                views=(name,),
                allowed=True,
            )
            for name, share in shares.items()
            if share > _TOLD
        ]


def _ghost_share(reader: Reader, camera: Camera, sample: Sphere | Plane, observation: Observation) -> float:
    limb = _limb(camera, observation.pose, sample)
    width, height = camera.size
    x0, y0 = np.clip(np.floor(limb.min(0)), 0, [width - 1, height - 1]).astype(int)
    x1, y1 = np.clip(np.ceil(limb.max(0)) + 1, [x0 + 1, y0 + 1], [width, height]).astype(int)
    image = reader.part(observation.view, (int(x0), int(y0), int(x1), int(y1)))
    if image is None or image.ghost is None:
        return 0.0
    left, top = image.origin  # a small picture comes whole
    return float(image.ghost[y0 - top : y1 - top, x0 - left : x1 - left].mean())


def _limb(camera: Camera, pose: Pose, sample: Sphere | Plane) -> np.ndarray:
    """(k, 2) pixels of the sample's outline."""
    if isinstance(sample, Sphere):
        return outline(camera, pose, np.asarray(sample.center, float), sample.radius)
    flat = np.asarray(sample.outline, float)
    return camera.project(pose, np.column_stack([flat, np.full(len(flat), sample.height)]))
