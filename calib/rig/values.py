"""Which values belong to a rig, under what names, and how each kind of them may change from set to set."""

from __future__ import annotations

import numpy as np

from photogonio.calib.rig.gaussian import RigExpected

CAMERA, LAMP, BALL, LIGHT, PAPER = "camera", "lamp", "ball", "light", "paper"
# natural sizes of distortion terms by OpenCV's number: what an ordinary lens has
TERMS = np.array([0.15, 0.1, 5e-4, 5e-4, 0.1, 0.1, 0.1, 0.1])
_ASPECT = 0.01  # natural size of what pixels are not square by, or seem to be by what a lens model misses
_BALL = 0.003  # the same of the logarithm of a ball's radius
_STANDS = 0.02  # of its distance: how far the place of a lamp on a stand is from set to set
_FALLOFF = np.diag([0.5, 0.1])  # natural sizes of how a lens darkens its pictures
WORDS = {
    CAMERA: "focal lengths, centre and distortion of the lens",
    LAMP: "size and beam of the lamps, blackness of the print, how the lens darkens its pictures",
    BALL: "radius of a mirror ball",
    LIGHT: "place of a lamp",
    PAPER: "reflectance of the paper",
}


def camera_name(free: tuple[int, ...]) -> str:
    """Of a camera with some distortion terms: fx, fy, cx, cy and those."""
    return " ".join([CAMERA, *map(str, free)])


def camera_terms(name: str) -> tuple[int, ...]:
    """Inverse of :func:`camera_name`."""
    return tuple(map(int, name.split()[1:]))


def kind_of(name: str) -> str:
    """The kind of values of a name."""
    return name.split(" ")[0]


def changes_of(name: str, value: np.ndarray) -> list[np.ndarray]:
    """Groups of directions (d, m) in which values near ``value`` (d,) change together, each of natural size."""
    kind, d = kind_of(name), len(value)
    if kind == CAMERA:
        zoom = np.zeros((d, 1))
        zoom[:2, 0] = value[:2]
        aspect = np.zeros((d, 1))
        aspect[:2, 0] = _ASPECT * value[0] * np.array([1.0, -1.0])
        centre, lens = np.zeros((d, 2)), np.zeros((d, d - 4))
        centre[[2, 3], [0, 1]] = 2.0 * value[2]  # about the picture's width
        lens[4:] = np.diag(TERMS[list(camera_terms(name))])
        return [zoom, aspect, centre, lens][: 4 if d > 4 else 3]
    if kind == LAMP:
        falloff = np.zeros((d, 2))
        falloff[3:] = _FALLOFF
        return [*(np.eye(d)[:, [k]] for k in range(3)), falloff]
    if kind == LIGHT:
        return [np.linalg.norm(value) * np.eye(d)]
    if kind == PAPER and d > 1:
        return [np.ones((d, 1)), np.eye(d)]
    return [(_BALL if kind == BALL else 1.0) * np.eye(d)]


def steady(name: str, value: np.ndarray, between: np.ndarray) -> bool:
    """Whether values that change from set to set with a covariance ``between`` (d, d) say anything of another set.

    Places of lamps only where they stand still: what lies between those of one carried by hand is no place of it.
    """
    return kind_of(name) != LIGHT or bool(
        np.trace(between) < len(value) * (_STANDS * np.linalg.norm(value)) ** 2
    )


def held(one: RigExpected, places: list[int], sigma: float) -> RigExpected:
    """The same once it is known that the values at ``places`` are 0 within ``sigma``."""
    design = np.eye(len(one.value))[places]
    gain = (
        one.covariance
        @ design.T
        @ np.linalg.inv(design @ one.covariance @ design.T + sigma**2 * np.eye(len(places)))
    )
    covariance = one.covariance - gain @ design @ one.covariance
    return RigExpected(
        one.name, one.value - gain @ one.value[places], (covariance + covariance.T) / 2, one.sets
    )
