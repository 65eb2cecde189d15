"""Distant lights as the sample's own shading tells them: turned where it contradicts the highlights.

A direction found in a mirror ball is as good as the ball's place, and a probe photo is not the sample's photo. The
shading of a ball, under a BRDF that all lights share, tells each light's direction too. Only directional lights on a
ball are judged: near ones are settled by calibration, and on a plane a turn looks like an error of scale.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from calib.setup import Light, Setup, ViewSetup
from capture.photoset import Sphere
from reconstruct.cells import Cells
from reconstruct.model import Model
from reconstruct.robust import INDEPENDENT, PHOTO_FREEDOM, residual_scale, student_weights

SUSPECT = 4.0  # standard errors of shading and highlights together
LEAST = np.radians(0.5)  # smaller turns are not told from a misfit of the model
MOST = np.radians(12.0)  # larger ones are no error of a direction, but another light
LIMIT = np.cos(np.radians(75.0))  # grazing cells tell more of the model than of the light
FEWEST_CELLS = 60
FEWEST_LIGHTS = 4  # what fewer share is not told from what each does
TWO_ANGLES = 2.0 * np.log(2.0)  # median of the sum of two squared normal errors, in their variance
STEP = 2e-3  # radians, of the derivative
ITERATIONS = 6


@dataclass(frozen=True, slots=True)
class TurnedLight:
    """A light whose direction the shading corrects."""

    id: str
    direction: np.ndarray  # (3,) unit vector toward the light
    angle: float  # radians, from where it was
    error: float  # radians, standard error of each of the direction's two angles


def turned_lights(cells: Cells, model: Model, setup: Setup) -> tuple[TurnedLight, ...]:
    """All lights, if ``cells``, seen as ``model``, contradict any of them by more than its errors; else none.

    Directions of highlights and of shading are weighed by their errors, the highlights' by no less than what the
    lights' turns say of them.
    """
    lights = {
        view.light.id: view.light
        for view in setup.views
        if view.light.kind == "directional" and view.light.source != "given"
    }
    if not isinstance(setup.sample, Sphere) or len(lights) < FEWEST_LIGHTS or not cells.binned:
        return ()
    views = {view.name: view for view in setup.views}
    of_group = [views[name] for name in cells.groups]
    found = []
    for light in lights.values():
        groups = [g for g, view in enumerate(of_group) if view.light.id == light.id]
        rows = cells.take(np.isin(cells.group, groups))
        if len(rows) >= FEWEST_CELLS:
            found.append(_turned(light, _seen(rows, of_group, setup.sample), rows, model))
    stated = np.array([np.sqrt(np.trace(lights[one.id].covariance) / 2.0) for one in found])
    angle, error = np.array([[one.angle, one.error] for one in found]).reshape(-1, 2).T
    suspect = (angle > np.maximum(SUSPECT * np.hypot(error, stated), LEAST)) & (angle < MOST)
    if not suspect.any():
        return ()
    spread = np.maximum(np.median(angle**2) / TWO_ANGLES - np.median(error**2), 0.0)
    share = 1.0 / (1.0 + error**2 / np.maximum(stated**2, spread))
    return tuple(
        _weighed(one, lights[one.id].place, part)
        for one, part in zip(found, share, strict=True)
        if one.angle < MOST
    )


def _weighed(one: TurnedLight, start: np.ndarray, share: float) -> TurnedLight:
    """``share`` of the way from ``start`` to where the shading has it."""
    direction = _unit((1.0 - share) * start + share * one.direction)
    return TurnedLight(one.id, direction, share * one.angle, np.sqrt(share) * one.error)


def relit(setup: Setup, turned: tuple[TurnedLight, ...]) -> Setup:
    """The setup with the lights turned."""
    by_id = {one.id: one for one in turned}

    def corrected(view: ViewSetup) -> ViewSetup:
        one = by_id.get(view.light.id)
        if one is None:
            return view
        across = np.eye(3) - np.outer(one.direction, one.direction)
        light = replace(view.light, place=one.direction, covariance=one.error**2 * across, source="refined")
        return replace(view, light=light)

    return replace(setup, views=tuple(corrected(view) for view in setup.views))


@dataclass(frozen=True, slots=True)
class _Seen:
    """Normals and directions to the camera, (n, 3) each."""

    normal: np.ndarray
    back: np.ndarray

    def angles(self, light: np.ndarray) -> tuple[np.ndarray, Cells]:
        """Cosines (n,) of incidence, and the pairs of directions, under a light in direction ``light`` (3,)."""
        cos_i = np.clip(self.normal @ light, 1e-3, 1.0)
        cos_r = np.clip(np.einsum("ij,ij->i", self.normal, self.back), 1e-3, 1.0)
        sines = np.sqrt(np.maximum((1.0 - cos_i**2) * (1.0 - cos_r**2), 1e-24))
        cos_d = np.clip((self.back @ light - cos_i * cos_r) / sines, -1.0, 1.0)
        return cos_i, Cells.of_angles(np.arccos(cos_i), np.arccos(cos_r), np.arccos(cos_d))


def _seen(cells: Cells, of_group: list[ViewSetup], sample: Sphere) -> _Seen:
    normal = cells.place - sample.center
    camera = np.array([view.pose.center for view in of_group])[cells.group]
    return _Seen(_unit(normal), _unit(camera - cells.place))


def _turned(light: Light, seen: _Seen, cells: Cells, model: Model) -> TurnedLight:
    """The direction that makes the shading the model's, whatever its scale; robust Gauss and Newton."""
    start = light.place
    cos_i, _ = seen.angles(start)
    radiance = (cells.value * cos_i[:, None]).mean(1)  # over the strength

    def shading(direction: np.ndarray) -> np.ndarray:
        cosine, pairs = seen.angles(direction)
        return model.evaluate(pairs).mean(1) * cosine

    direction, covariance = start, np.zeros((2, 2))
    for _ in range(ITERATIONS):
        frame = _across(direction)
        slopes, expected = _slopes(shading, direction, frame)
        use = (seen.angles(direction)[0] > LIMIT) & (expected > 0.0)
        matrix = np.column_stack([slopes, expected])[use] / expected[use, None]
        moved, covariance = _solved(matrix, radiance[use] / expected[use])
        direction = _unit(direction + frame.T @ moved)
    angle = float(np.arccos(np.clip(direction @ start, -1.0, 1.0)))
    return TurnedLight(light.id, direction, angle, float(np.sqrt(np.trace(covariance) / 2.0)))


def _slopes(
    shading: Callable[[np.ndarray], np.ndarray], direction: np.ndarray, frame: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives (n, 2) of the shading by the direction's two angles, and the shading (n,)."""
    ends = [[shading(_unit(direction + sign * STEP * axis)) for sign in (1.0, -1.0)] for axis in frame]
    return np.column_stack([(up - down) / (2.0 * STEP) for up, down in ends]), shading(direction)


def _solved(matrix: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The two turns and their covariance; the third column of ``matrix`` is the scale."""
    weight = np.ones(len(target))
    solution = np.zeros(matrix.shape[1])
    for _ in range(ITERATIONS):
        root = np.sqrt(weight)
        solution = np.linalg.lstsq(matrix * root[:, None], target * root, rcond=None)[0]
        residual = target - matrix @ solution
        scale = residual_scale(residual)
        weight = student_weights(residual / scale, PHOTO_FREEDOM)
    together = max(len(target) / INDEPENDENT, 1.0)  # residuals of a photo hang together
    covariance = together * scale**2 * np.linalg.pinv((matrix * weight[:, None]).T @ matrix)
    return solution[:2] / solution[2], covariance[:2, :2]


def _across(direction: np.ndarray) -> np.ndarray:
    """Two unit vectors (2, 3) across ``direction``."""
    first = _unit(np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))]))
    return np.stack([first, np.cross(direction, first)])


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
