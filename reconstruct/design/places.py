"""Where camera and lamp may stand for a photo, and which of those places lower the variance of f most."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.design.belief import Belief, lowered, noise, updated
from photogonio.reconstruct.design.pairs import SeenPairs
from photogonio.reconstruct.design.spots import FRONT, Piece, Spot, Stance, apart, flash_shot

CAMERA_ELEVATIONS = (20.0, 35.0, 50.0, 65.0, 80.0)  # degrees above the board
CAMERA_OF_BALL = (20.0, 50.0)  # the same: of a ball only the angle between lamp and camera counts
LAMP_ELEVATIONS = (8.0, 18.0, 30.0, 42.0, 54.0, 66.0, 78.0, 88.0)
TURN = 15.0  # degrees between lamps around
COARSE = 45.0  # the same of cameras and lamps of a surface that is turned
NEAREST = 6.0  # degrees between lamp and camera: closer, one is in the other's way
WORTH = 0.05  # of the mean variance: a photo that lowers it by less is not worth taking


@dataclass(frozen=True, slots=True)
class Feasible:
    """What places there are."""

    camera_distance: float
    lamp_distance: float
    camera: Spot | None = None  # where it stays; None: it may be moved
    lamps: str = "any"  # "any" | "flash" (on the camera alone) | "lamp" (never there)


@dataclass(frozen=True, slots=True)
class Step:
    """A photo that was chosen, and the mean relative variance of f before and after it."""

    stance: Stance
    before: float
    after: float

    @property
    def worth(self) -> bool:
        """Whether it lowers the variance by something."""
        return self.before - self.after > WORTH * self.before


def candidates(feasible: Feasible, piece: Piece, *, turning: bool) -> list[Stance]:
    """All photos that are thought of. What only turns a picture of an isotropic surface is thought of once."""
    if feasible.camera is not None:
        cameras = [feasible.camera]
    else:
        around = np.arange(-180.0, 180.0, COARSE) if turning else [FRONT]
        heights = CAMERA_OF_BALL if piece.ball else CAMERA_ELEVATIONS
        cameras = [Spot(up, float(a), feasible.camera_distance) for up in heights for a in around]
    shots = []
    for camera in cameras:
        if feasible.lamps != "lamp":
            shots.append(flash_shot(camera))
        if feasible.lamps == "flash":
            continue
        turns = np.arange(0.0, 360.0, COARSE) if turning else np.arange(0.0, 180.0 + TURN, TURN)
        for up in LAMP_ELEVATIONS[1::2] if turning else LAMP_ELEVATIONS:
            for turn in turns:
                lamp = Spot(up, wrapped(camera.azimuth + turn), feasible.lamp_distance)
                if apart(camera, lamp) >= NEAREST:
                    shots.append(Stance(camera, lamp))
    return shots


def wrapped(azimuth: float) -> float:
    """The same in (-180, 180]."""
    return -((180.0 - azimuth) % 360.0 - 180.0)


def best_photos(
    belief: Belief,
    shots: Sequence[Stance],
    pairs_of: Callable[[Stance], SeenPairs],
    count: int,
    progress: Callable[[int], None] = lambda done: None,
) -> list[Step]:
    """The photos of which each lowers the mean variance most, after those before it; fewer if no more are to be had."""
    known = [(shot, pairs) for shot in shots if len(pairs := pairs_of(shot))]
    rows = [(shot, belief.features(pairs), noise(pairs)) for shot, pairs in known]
    criterion, covariance = belief.criterion(), belief.covariance
    before = float(np.einsum("kl,lk->", criterion, covariance)) + belief.floor
    steps: list[Step] = []
    for k in range(count if rows else 0):
        gains = [lowered(covariance, criterion, row, error) for _, row, error in rows]
        shot, row, error = rows[int(np.argmax(gains))]
        covariance = updated(covariance, row, error)
        after = float(np.einsum("kl,lk->", criterion, covariance)) + belief.floor
        steps.append(Step(shot, before, after))
        before = after
        progress(k + 1)
    return steps
