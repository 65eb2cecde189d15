"""Places of camera and lamp by their angles, and what a photo from there would see."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.design.pairs import SeenPairs, ball_pairs, flat_pairs

FRONT = -90.0  # degrees: the azimuth from which a board is looked at upright
BESIDE = 0.02  # of the camera's distance: where a flash sits


@dataclass(frozen=True, slots=True)
class Spot:
    """A place by the board: degrees above it, degrees about its normal from x, and how far from the sample."""

    elevation: float
    azimuth: float
    distance: float

    @property
    def place(self) -> np.ndarray:
        """(3,) from the sample's middle."""
        up, turn = np.radians([self.elevation, self.azimuth])
        return self.distance * np.array(
            [np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)], float
        )

    @classmethod
    def of(cls, place: np.ndarray) -> Spot:
        """Inverse of :attr:`place`."""
        distance = float(np.linalg.norm(place))
        up = np.degrees(np.arcsin(np.clip(place[2] / max(distance, 1e-12), -1.0, 1.0)))
        return cls(float(up), float(np.degrees(np.arctan2(place[1], place[0]))), distance)


@dataclass(frozen=True, slots=True)
class Stance:
    """One photo: where camera and lamp stand."""

    camera: Spot
    lamp: Spot
    flash: bool = False  # the lamp sits on the camera


@dataclass(frozen=True, slots=True)
class Piece:
    """The sample, its middle being the origin."""

    ball: bool
    half: tuple[float, float]  # radius twice, or half sides

    def pairs(self, shot: Stance) -> SeenPairs:
        """Which pairs of directions a photo sees."""
        lamp, camera, middle = shot.lamp.place, shot.camera.place, np.zeros(3)
        if self.ball:
            return ball_pairs(lamp, camera, middle, self.half[0])
        return flat_pairs(lamp, camera, middle, self.half)


def flash_shot(camera: Spot) -> Stance:
    """A photo lit from beside the lens."""
    eye = camera.place
    side = np.cross([0.0, 0.0, 1.0], eye)
    side = (
        side / max(float(np.linalg.norm(side)), 1e-12) if np.linalg.norm(side) > 0 else np.array([1.0, 0, 0])
    )
    return Stance(camera, Spot.of(eye + BESIDE * camera.distance * side), flash=True)


def apart(one: Spot, other: Spot) -> float:
    """Degrees between two places as the sample sees them."""
    cosine = one.place @ other.place / (one.distance * other.distance)
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
