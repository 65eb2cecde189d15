"""Shadows of polished balls by rays to the parts of a lamp: no formula of a limb."""

import numpy as np

from photogonio.calib.detect.paper import PaperSamples
from photogonio.calib.detect.paper_near_balls import Close
from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.geometry.visibility import direct
from photogonio.calib.shading.interreflection import glossy_bounce
from photogonio.calib.shading.model import Ball

BALLS = (Ball(np.array([10.0, 10, 8]), 8.0), Ball(np.array([170.0, 130, 8]), 8.0))
TABLE = np.array([[*b.center, b.radius] for b in BALLS])
LAMP_RADIUS = 7.0
SPREAD = np.array([0.25, 0.1, 0.5])  # covariance on the board, mm^2: a slanting view
LAMPS = [
    np.array([90 + 400.0 * np.cos(t), 70 + 400 * np.sin(t), 420 * h]) for t, h in ((0.6, 0.4), (2.5, 0.9))
]


def disc(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 2) on the unit disc that stand for equal areas."""
    radius = np.sqrt((np.arange(count**2) + 0.5) / count**2)
    turn = np.arange(count**2) * np.pi * (3 - np.sqrt(5))
    return radius * np.cos(turn), radius * np.sin(turn)


def seen_of_lamp(points: np.ndarray, lamp: np.ndarray, count: int = 12) -> np.ndarray:
    """Share (n,) of a lamp's disc seen past the balls, by rays to its parts: no formula of a limb."""
    axis = lamp / np.linalg.norm(lamp)
    side = np.cross(axis, [0, 0, 1.0])
    side /= np.linalg.norm(side)
    u, v = disc(count)
    free = np.zeros(len(points))
    for a, b in zip(u, v, strict=True):
        ray = lamp + LAMP_RADIUS * (a * side + b * np.cross(axis, side)) - points
        ray /= np.linalg.norm(ray, axis=1, keepdims=True)
        clear = np.ones(len(points), bool)
        for x, y, z, radius in TABLE:
            offset = np.array([x, y, z]) - points
            clear &= np.linalg.norm(np.cross(offset, ray), axis=1) > radius
        free += clear
    return free / len(u)


def blurred(points: np.ndarray, lamp: np.ndarray, count: int = 9) -> np.ndarray:
    """The same, averaged over what each point gathers."""
    root = np.linalg.cholesky([[SPREAD[0], SPREAD[1]], [SPREAD[1], SPREAD[2]]])
    radius = np.sqrt(-2 * np.log(1 - (np.arange(count**2) + 0.5) / count**2))
    turn = np.arange(count**2) * np.pi * (3 - np.sqrt(5))
    moves = np.column_stack([radius * np.cos(turn), radius * np.sin(turn)]) @ root.T
    return np.mean([seen_of_lamp(points + np.append(move, 0.0), lamp) for move in moves], axis=0)


def ring_of(rng: np.random.Generator, count: int) -> np.ndarray:
    """Points (count, 3) about the balls, 1.2 to 4 of their radii from the foot."""
    ball = TABLE[rng.integers(0, 2, count)]
    away, turn = ball[:, 3] * rng.uniform(1.2, 4.0, count), rng.uniform(0, 2 * np.pi, count)
    return np.column_stack(
        [ball[:, 0] + away * np.cos(turn), ball[:, 1] + away * np.sin(turn), np.zeros(count)]
    )


def paper_about(rng: np.random.Generator, lamp: np.ndarray, mirror: float) -> PaperReading:
    """A board of even white, its paper and what is close to the balls, each by rays; balls reflect ``mirror``."""
    x, y = np.meshgrid(np.arange(2, 180, 4.0), np.arange(2, 140, 4.0))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    clear = (np.hypot(*(points[:, None, :2] - TABLE[:, :2]).transpose(2, 0, 1)) > 24).all(1)
    points = points[clear]
    near = ring_of(rng, 3000)
    near = near[(near[:, :2] > 0).all(1) & (near[:, :2] < [180, 140]).all(1)]

    def level(points: np.ndarray) -> np.ndarray:
        thrown = sum(glossy_bounce(points, lamp, b.center, b.radius, f0=1.0) for b in BALLS)
        light = 1e5 * (direct(points, lamp) * seen_of_lamp(points, lamp) + mirror * thrown)
        return light * (1 + 0.01 * rng.normal(size=len(points)))

    far, close = level(points), level(near)
    square = (points[:, 0] // 20 + 9 * (points[:, 1] // 20)).astype(int)
    samples = PaperSamples(points, np.ones(len(points), bool), far[:, None], 1e-4 * far[:, None] ** 2, square)
    square = (near[:, 0] // 20 + 9 * (near[:, 1] // 20)).astype(int)
    white, still = np.ones(len(near)), np.zeros((len(near), 3))
    about = Close(near, white, close, 1e-4 * close**2, square, still, np.zeros(len(near)))
    return PaperReading(samples, far, 1e-4 * far**2, close=about)
