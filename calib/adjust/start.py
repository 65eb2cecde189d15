"""Sample and board as the adjustment starts with them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogonio.calib.detect.limb import place_ball
from photogonio.calib.detect.observation import Observation
from photogonio.calib.geometry.board import board_size
from photogonio.calib.geometry.camera import Camera, focal
from photogonio.calib.shading.initial import black_over_white
from photogonio.calib.shading.model import Ball, ShadingScene
from photogonio.capture.photoset import PhotoSet, Plane, Sphere

_LAMP_SIZE = 0.02  # of the board's diagonal: a lamp's radius, where nothing is known of it
_EDGE_BLUR = 0.7  # pixels by which lens and pixels soften a shadow's edge


def start_sample(camera: Camera, observations: Sequence[Observation], sample: object) -> np.ndarray | None:
    """Centre and radius (4,) of a sample ball by its limbs; None for a plane."""
    if not isinstance(sample, Sphere):
        return None
    seen = [(s.pose, s.limb) for s in observations if s.limb is not None and len(s.limb) > 20]
    center, radius = np.asarray(sample.center, float), float(sample.radius)
    if seen:
        center, radius = place_ball(camera, [p for p, _ in seen], [limb for _, limb in seen], center, radius)
    return np.append(center, radius)


def start_scene(
    photoset: PhotoSet,
    camera: Camera,
    observations: Sequence[Observation],
    sample: np.ndarray | None,
) -> ShadingScene | None:
    """The things on the board as shading sees them; None where no photo shows enough paper."""
    first = next((s for s in observations if s.has_paper), None)
    if first is None or photoset.board is None:
        return None
    size = board_size(photoset.board)
    given = [e.radius for e in photoset.lights if e.radius is not None]
    scale = focal(camera) / float(np.linalg.norm(first.pose.apply(np.append(size / 2, 0.0))))
    return ShadingScene(
        tuple(Ball(np.asarray(b.center, float), float(b.radius)) for b in photoset.mirror_balls),
        None if sample is None else Ball(sample[:3], float(sample[3])),
        float(np.median(given)) if given else _LAMP_SIZE * float(np.hypot(*size)),
        black_over_white(one for s in observations if (one := s.reading) is not None),
        _EDGE_BLUR / scale,
        aim=_aimed_at(photoset, sample),
    )


def _aimed_at(photoset: PhotoSet, sample: np.ndarray | None) -> tuple[float, float, float]:
    """Where lamps look: the middle of the sample."""
    if sample is not None:
        x, y, z = sample[:3].tolist()
    elif isinstance(photoset.sample, Plane):
        x, y = np.mean(photoset.sample.outline, axis=0).tolist()
        z = float(photoset.sample.height)
    else:
        x, y, z = np.asarray(photoset.sample.center, float).tolist()
    return x, y, z
