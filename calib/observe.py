"""What each photo shows of lamp, sample and paper, once the camera's place is known."""

from __future__ import annotations

import numpy as np

from calib.board import board_size
from calib.camera import Camera
from calib.highlights import find_highlight
from calib.looking import Progress, Reader
from calib.paper import sample_paper
from calib.sample import find_limb, focal
from calib.shading import Reading
from calib.sight import Sight
from calib.starts import local_noise
from calib.tone import gray, without_fireflies
from capture.photoset import MirrorBall, PhotoSet, Sphere
from capture.radiance import RadianceImage

_ACROSS = 170  # paper samples along the board's longer side
_CAUSTIC = 3.0  # radii around a polished ball where it throws light back onto the paper
_FEWEST = 400  # samples of paper worth a fit
_ASTRAY = 0.04  # of the radius: how far a sample ball may stand from the manifest's place


def observe(
    photoset: PhotoSet,
    reader: Reader,
    camera: Camera,
    sights: list[Sight],
    balls: tuple[MirrorBall, ...],
    tell: Progress,
) -> None:
    """Fill in highlights, limb and paper of every sight."""
    for k, sight in enumerate(sights):
        image = reader(sight.view)
        if image is not None:
            sight.highlights = [
                h
                for number, ball in enumerate(balls)
                if (h := find_highlight(image, camera, sight.pose, ball, number)) is not None
            ]
            if not sight.probe:
                sight.reading = _paper(photoset, image, camera, sight)
                sight.limb = _limb(photoset, image, camera, sight)
        tell("finding lamps, sample and paper", k + 1, len(sights))


def _paper(photoset: PhotoSet, image: RadianceImage, camera: Camera, sight: Sight) -> Reading | None:
    board = photoset.board
    if board is None:
        return None
    samples = sample_paper(
        board,
        image,
        camera,
        sight.pose,
        step=float(board_size(board).max()) / _ACROSS,
        sample=photoset.sample,
        balls=photoset.mirror_balls,
        patches=photoset.white_patches,
    )
    if samples is None:
        return None
    clear = np.ones(len(samples), bool)
    for ball in photoset.mirror_balls:
        clear &= np.hypot(*(samples.points[:, :2] - ball.center[:2]).T) > _CAUSTIC * ball.radius
    samples = samples.keep(clear)
    if len(samples) < _FEWEST:
        return None
    level = samples.value.mean(axis=1)
    noise = samples.variance.mean(axis=1) / samples.variance.shape[1]
    return Reading(samples, level, np.maximum(noise, (local_noise(samples, level) * level) ** 2))


def _limb(photoset: PhotoSet, image: RadianceImage, camera: Camera, sight: Sight):
    sample = photoset.sample
    if not isinstance(sample, Sphere):
        return None
    scale = focal(camera) / np.linalg.norm(sight.pose.apply(np.asarray(sample.center, float)))
    within = 2.0 + _ASTRAY * sample.radius * scale
    level = without_fireflies(gray(image))
    usable = np.isfinite(image.value).all(axis=2)
    return find_limb(level, usable, camera, sight.pose, sample.center, sample.radius, within)
