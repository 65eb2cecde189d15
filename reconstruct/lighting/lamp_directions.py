"""Lights as the sample's own shading tells them: turned where it contradicts the highlights, or is surer than they.

A direction found in a mirror ball is as good as the ball's place, and a probe photo is not the sample's photo. The
shading of a ball, under a BRDF that all lights share, tells each light's direction too. Only lights on a ball are
judged: on a plane a turn looks like an error of scale. Near lamps that calibration settled by the board's paper are
surer than that; those that only mirror balls told are turned about the sample, their distance kept.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from photogonio.calib.setup import Light, Setup, ViewSetup
from photogonio.capture.photoset import Sphere, WhitePatch
from photogonio.reconstruct.estimate.model import Model
from photogonio.reconstruct.estimate.weights import (
    INDEPENDENT,
    PHOTO_FREEDOM,
    residual_scale,
    student_weights,
)
from photogonio.reconstruct.table.cells import Cells

SUSPECT = 4.0  # standard errors of shading and highlights together
LEAST = np.radians(0.5)  # smaller turns are not told from a misfit of the model
UNSETTLED = np.radians(0.3)  # stated error of a lamp's direction from which on the shading is asked
SURER = 0.5  # of the stated error: the shading's, where it is asked
MOST = np.radians(12.0)  # larger ones are no error of a direction, but another light
LIMIT = np.cos(np.radians(75.0))  # grazing cells tell more of the model than of the light
FEWEST_CELLS = 60
FEWEST_LIGHTS = 4  # what fewer share is not told from what each does
TWO_ANGLES = 2.0 * np.log(2.0)  # median of the sum of two squared normal errors, in their variance
STEP = 2e-3  # radians, of the derivative
ITERATIONS = 6
TINY = 1e-12
LEAST_STRENGTH = 0.01  # relative error of a strength by a patch, the lamp's place aside


@dataclass(frozen=True, slots=True)
class TurnedLight:
    """A light whose direction the shading corrects."""

    id: str
    direction: np.ndarray  # (3,) unit vector toward the light
    angle: float  # radians, from where it was
    error: float  # radians, standard error of each of the direction's two angles

    def of(self, light: Light, center: np.ndarray) -> Light:
        """``light`` turned about ``center`` (3,)."""
        across = self.error**2 * (np.eye(3) - np.outer(self.direction, self.direction))
        if light.kind == "directional":
            return replace(light, place=self.direction, covariance=across, source="refined")
        offset = light.place - center
        distance = float(np.linalg.norm(offset))
        along = offset @ light.covariance @ offset / distance**2 * np.outer(self.direction, self.direction)
        place = center + distance * self.direction
        return replace(light, place=place, covariance=distance**2 * across + along, source="refined")


def turned_lights(cells: Cells, model: Model, setup: Setup) -> tuple[TurnedLight, ...]:
    """All lights, if ``cells``, seen as ``model``, contradict any of them by more than its errors, or tell one that
    calibration left unsettled; else none.

    Directions of highlights and of shading are weighed by their errors, the highlights' by no less than what the
    lights' turns say of them.
    """
    if not isinstance(setup.sample, Sphere) or not cells.binned:
        return ()
    center = np.asarray(setup.sample.center, float)
    lights = {view.light.id: view.light for view in setup.views if _doubtful(view.light, center)}
    moving = {v.light.id for v in setup.views if v.light.id in lights and _elsewhere(v.light, lights)}
    lights = {name: light for name, light in lights.items() if name not in moving}
    if len(lights) < FEWEST_LIGHTS:
        return ()
    views = {view.name: view for view in setup.views}
    of_group = [views[name] for name in cells.groups]
    found = []
    for light in lights.values():
        groups = [g for g, view in enumerate(of_group) if view.light.id == light.id]
        rows = cells.take(np.isin(cells.group, groups))
        if len(rows) >= FEWEST_CELLS:
            seen = _seen(rows, of_group, center, light)
            found.append(_turned(light, _toward(light, center), seen, rows, model))
    stated = np.array([_stated(lights[one.id], center) for one in found])
    angle, error = np.array([[one.angle, one.error] for one in found]).reshape(-1, 2).T
    suspect = (angle > np.maximum(SUSPECT * np.hypot(error, stated), LEAST)) & (angle < MOST)
    near = np.array([lights[one.id].kind == "point" for one in found], bool)
    if not (suspect | (near & (error < SURER * stated))).any():
        return ()
    spread = np.maximum(np.median(angle**2) / TWO_ANGLES - np.median(error**2), 0.0)
    share = 1.0 / (1.0 + error**2 / np.maximum(stated**2, spread))
    return tuple(
        _weighed(one, _toward(lights[one.id], center), part)
        for one, part in zip(found, share, strict=True)
        if one.angle < MOST
    )


def _doubtful(light: Light, center: np.ndarray) -> bool:
    """Whether the shading is asked for this light."""
    if light.source in ("given", "camera"):
        return False
    return light.source == "probe" or _stated(light, center) > UNSETTLED


def _elsewhere(light: Light, lights: dict[str, Light]) -> bool:
    """Whether a light stands elsewhere in another photo, as one does that moves with the camera."""
    return not np.array_equal(light.place, lights[light.id].place)


def _toward(light: Light, center: np.ndarray) -> np.ndarray:
    """Unit vector (3,) from ``center`` toward the light."""
    return light.toward(center[None])[0][0]


def _stated(light: Light, center: np.ndarray) -> float:
    """Standard error of each of the direction's two angles, radians."""
    if light.kind == "directional":
        return float(np.sqrt(np.trace(light.covariance) / 2.0))
    toward = _toward(light, center)
    across = np.trace(light.covariance) - toward @ light.covariance @ toward
    return float(np.sqrt(max(across, 0.0) / 2.0) / np.linalg.norm(light.place - center))


def _weighed(one: TurnedLight, start: np.ndarray, share: float) -> TurnedLight:
    """``share`` of the way from ``start`` to where the shading has it."""
    direction = _unit((1.0 - share) * start + share * one.direction)
    return TurnedLight(one.id, direction, share * one.angle, np.sqrt(share) * one.error)


def relit(setup: Setup, turned: tuple[TurnedLight, ...], patches: Sequence[WhitePatch] = ()) -> Setup:
    """The setup with the lights turned, and as strong as ``patches`` or the board, which told their strengths, have
    them now."""
    by_id = {one.id: one for one in turned}
    center = np.asarray(setup.ball.center, float)
    middles = np.array([[*np.mean(one.outline, axis=0), one.height] for one in patches]).reshape(-1, 3)

    def corrected(view: ViewSetup) -> ViewSetup:
        one = by_id.get(view.light.id)
        if one is None:
            return view
        after = replace(view, light=one.of(view.light, center))
        if view.strength_source == "white patch" and len(middles):
            return _measured_again(view, after, middles, center)
        if view.strength_source == "board":
            return _measured_again(view, after, np.array([[*center[:2], 0.0]]), center)
        return after

    return replace(setup, views=tuple(corrected(view) for view in setup.views))


def _measured_again(
    before: ViewSetup, after: ViewSetup, patches: np.ndarray, center: np.ndarray
) -> ViewSetup:
    """``after`` with the strength that makes ``patches`` (k, 3) as bright as ``before`` did, and its error as it
    reaches the sample at ``center``."""
    first, second = (_received(view.light, patches).mean() for view in (before, after))
    if first <= 0 or second <= 0:
        return after
    strength = before.strength * first / second
    by_place = [_pulled(view.light, patches, center) for view in (before, after)]
    own = np.maximum((before.strength_error / before.strength) ** 2 - by_place[0], LEAST_STRENGTH**2)
    return replace(after, strength=strength, strength_error=strength * np.sqrt(own + by_place[1]))


def _received(light: Light, places: np.ndarray) -> np.ndarray:
    """Irradiance (n,) of level ``places`` (n, 3) over the light's strength."""
    toward, falloff = light.toward(places)
    return np.maximum(toward[:, 2], 0.0) * falloff


def _pulled(light: Light, patches: np.ndarray, center: np.ndarray) -> float:
    """Relative variance, by the error of the light's place, of what reaches ``center`` over what ``patches`` get."""
    size = STEP * float(np.linalg.norm(light.place - center)) if light.kind == "point" else STEP

    def share(moved: np.ndarray) -> float:
        there = replace(light, place=light.place + moved)
        return float(
            np.log(there.toward(center[None])[1][0] / np.maximum(_received(there, patches).mean(), TINY))
        )

    slope = np.array([(share(size * axis) - share(-size * axis)) / (2 * size) for axis in np.eye(3)])
    return float(slope @ light.covariance @ slope)


@dataclass(frozen=True, slots=True)
class _Seen:
    """What a light shines on, and from where the camera sees it."""

    place: np.ndarray  # (n, 3) from the middle of the ball
    normal: np.ndarray  # (n, 3)
    back: np.ndarray  # (n, 3) unit vectors to the camera
    distance: float  # of the light from the middle; inf

    def under(self, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray, Cells]:
        """Cosines (n,) of incidence, irradiance (n,) over that of the middle at normal incidence, and the pairs of
        directions, under a light in ``direction`` (3,)."""
        offset = direction - self.place / self.distance
        reach = np.linalg.norm(offset, axis=1)
        light = offset / reach[:, None]
        cos_i = np.clip(np.einsum("ij,ij->i", self.normal, light), 1e-3, 1.0)
        cos_r = np.clip(np.einsum("ij,ij->i", self.normal, self.back), 1e-3, 1.0)
        sines = np.sqrt(np.maximum((1.0 - cos_i**2) * (1.0 - cos_r**2), 1e-24))
        between = np.einsum("ij,ij->i", self.back, light)
        cos_d = np.clip((between - cos_i * cos_r) / sines, -1.0, 1.0)
        return cos_i, cos_i / reach**2, Cells.of_angles(np.arccos(cos_i), np.arccos(cos_r), np.arccos(cos_d))


def _seen(cells: Cells, of_group: list[ViewSetup], center: np.ndarray, light: Light) -> _Seen:
    camera = np.array([view.pose.center for view in of_group])[cells.group]
    near = light.kind == "point"
    distance = float(np.linalg.norm(light.place - center)) if near else np.inf
    place = cells.place - center
    return _Seen(place, _unit(place), _unit(camera - cells.place), distance)


def _turned(light: Light, start: np.ndarray, seen: _Seen, cells: Cells, model: Model) -> TurnedLight:
    """The direction, from ``start`` (3,) on, that makes the shading the model's, whatever its scale; robust Gauss and
    Newton."""
    radiance = cells.value.mean(1) * seen.under(start)[1]  # over the strength

    def shading(direction: np.ndarray) -> np.ndarray:
        _, irradiance, pairs = seen.under(direction)
        return model.evaluate(pairs).mean(1) * irradiance

    direction, covariance = start, np.zeros((2, 2))
    doubt = np.zeros(len(cells)) if cells.doubt is None else cells.doubt.mean(1) * seen.under(start)[1]
    for _ in range(ITERATIONS):
        frame = _across(direction)
        slopes, expected = _slopes(shading, direction, frame)
        use = (seen.under(direction)[0] > LIMIT) & (expected > 0.0)
        matrix = np.column_stack([slopes, expected])[use] / expected[use, None]
        moved, covariance = _solved(matrix, radiance[use] / expected[use], doubt[use] / expected[use])
        direction = _unit(direction + frame.T @ moved)
    angle = float(np.arccos(np.clip(direction @ start, -1.0, 1.0)))
    return TurnedLight(light.id, direction, angle, float(np.sqrt(np.trace(covariance) / 2.0)))


def _slopes(
    shading: Callable[[np.ndarray], np.ndarray], direction: np.ndarray, frame: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives (n, 2) of the shading by the direction's two angles, and the shading (n,)."""
    ends = [[shading(_unit(direction + sign * STEP * axis)) for sign in (1.0, -1.0)] for axis in frame]
    return np.column_stack([(up - down) / (2.0 * STEP) for up, down in ends]), shading(direction)


def _solved(matrix: np.ndarray, target: np.ndarray, doubt: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The two turns and their covariance; the third column of ``matrix`` is the scale. ``doubt`` (n,) is the standard
    error that all of ``target`` share, by stray light that nobody knows."""
    weight = np.ones(len(target))
    solution = np.zeros(matrix.shape[1])
    for _ in range(ITERATIONS):
        root = np.sqrt(weight)
        solution = np.linalg.lstsq(matrix * root[:, None], target * root, rcond=None)[0]
        residual = target - matrix @ solution
        scale = residual_scale(residual)
        weight = student_weights(residual / scale, PHOTO_FREEDOM)
    together = max(len(target) / INDEPENDENT, 1.0)  # residuals of a photo hang together
    inverse = np.linalg.pinv((matrix * weight[:, None]).T @ matrix)
    shared = inverse @ matrix.T @ (weight * doubt)
    covariance = together * scale**2 * inverse + np.outer(shared, shared)
    return solution[:2] / solution[2], covariance[:2, :2]


def _across(direction: np.ndarray) -> np.ndarray:
    """Two unit vectors (2, 3) across ``direction``."""
    first = _unit(np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))]))
    return np.stack([first, np.cross(direction, first)])


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
