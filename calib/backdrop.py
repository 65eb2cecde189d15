"""How bright the surroundings are that a photo shows beside the sample, where nobody knows what and where they are."""

from __future__ import annotations

import numpy as np
from photogonio.calib.radiometry.surround import MARGIN, Bounds, ReadAt
from photogonio.calib.setup import Setup, ViewSetup
from photogonio.capture.photoset import MirrorBall

ACROSS = 64  # points along the picture's longer side that are read
LEAST_READ = 0.5  # share of the points that must be readable: what is clipped is the brightest
FEWEST = 100  # points


def backdrop(
    setup: Setup, view: ViewSetup, read_at: ReadAt, bounds: Bounds, mirror_balls: tuple[MirrorBall, ...] = ()
) -> np.ndarray:
    """Mean radiance (c,) of the picture beside a ball and the mirror balls; NaN where too little of it can be read."""
    x0, y0, x1, y1 = bounds
    step = max(1, max(setup.camera.size) // ACROSS)
    pixels = np.stack(np.meshgrid(np.arange(x0, x1, step), np.arange(y0, y1, step)), axis=-1).reshape(-1, 2)
    rays = setup.camera.world_rays(view.pose, pixels.astype(float))
    beside = np.ones(len(pixels), bool)
    for ball in (setup.sample, *mirror_balls):
        offset = ball.center - view.pose.center
        passing = np.linalg.norm(np.cross(rays, offset), axis=1)
        beside &= (passing > MARGIN * ball.radius) | (rays @ offset < 0.0)
    if beside.sum() < FEWEST:
        return np.full(len(view.strength), np.nan)
    value, valid = read_at(pixels[beside])
    if valid.mean() < LEAST_READ:
        return np.full(value.shape[1], np.nan)
    return value[valid].mean(0, dtype=float)
