"""Where a ball stands as its own shading tells it, where its limb in small pictures tells that less well.

A centre that is off by a fiftieth of the radius turns normals by a degree: a gloss's peak then lies aside on either
side of the mirror direction, which no reciprocal surface does, and in all photos alike. Centre and radius are found
together with all that the surface, the lamps and the views' scales may do instead, by one step of Gauss and Newton;
what calibration knows of them is the prior.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from photogonio.calib.setup import Setup
from photogonio.capture.photoset import Sphere
from photogonio.reconstruct.estimate.model import Model, shape_slopes
from photogonio.reconstruct.estimate.pilot import PILOT_PRIOR
from photogonio.reconstruct.estimate.weights import (
    PHOTO_FREEDOM,
    error_model,
    independence,
    level,
    residual_scale,
    student_weights,
)
from photogonio.reconstruct.lighting.lamp_errors import by_lamps
from photogonio.reconstruct.table.cells import Cells

SURE = 4.0  # standard errors of the move
IMPLAUSIBLE = 5.0  # of calibration: a move by more is something else's doing
LEAST = 0.002  # rms change of the cells' radiance: a smaller one is not worth looking at all photos again
LIMIT = np.radians(75.0)  # grazing cells tell more of the model than of the place
FEWEST_VIEWS = 4
STEP = 1e-3  # of the radius, of the derivatives
ROUNDS = 4  # of reweighting
VIEW_ERROR = 0.003  # relative, of a view's scale, at least
SHAPE_SPREAD = 1.0  # of the logarithm of a lobe's shape
TINY = 1e-12


@dataclass(frozen=True, slots=True)
class MovedSample:
    """By how much centre and radius (4,) of the ball change where the shading has it."""

    change: np.ndarray
    covariance: np.ndarray  # (4, 4) of what they are then
    changed: float  # rms relative change of the cells' radiance


def moved_sample(cells: Cells, model: Model, setup: Setup) -> MovedSample | None:
    """The ball by ``cells`` seen as ``model``; None where they tell no more than calibration, or too little."""
    known = _known(setup)
    if not isinstance(setup.sample, Sphere) or not cells.binned or model.turning or known is None:
        return None
    cells = cells.take((cells.theta_i < LIMIT) & (cells.theta_r < LIMIT))
    if len(np.unique(cells.group)) < FEWEST_VIEWS:
        return None
    slopes = _slopes(_shading(cells, model, setup), setup.sample)
    found, covariance = _solved(
        cells, model, slopes, known, by_lamps(setup, every=True)(cells, model).mean(2)
    )
    changed = float(np.sqrt(np.mean((slopes @ found) ** 2)))
    if found @ np.linalg.solve(covariance, found) < SURE**2 or changed < LEAST:
        return None
    if found @ np.linalg.solve(known, found) > IMPLAUSIBLE**2:
        return None
    return MovedSample(found, covariance, changed)


def replaced(setup: Setup, moved: MovedSample) -> Setup:
    """The setup with the ball there."""
    ball, change, told = setup.ball, moved.change, _told(setup)
    sample = replace(ball, center=ball.center + change[:3], radius=ball.radius + float(change[3]))
    error = np.sqrt(np.diag(moved.covariance))
    told = {
        "shift": (np.array(told["shift"]) + change[:3]).tolist(),
        "shift_error": error[:3].tolist(),
        "radius_change": told["radius_change"] + float(change[3]),
        "radius_error": float(error[3]),
        "covariance": moved.covariance.tolist(),
    }
    return replace(setup, sample=sample, residuals=setup.residuals | {"sample": told})


def _told(setup: Setup) -> dict[str, Any]:
    """What calibration says of the sample's place; empty if nothing."""
    told = setup.residuals.get("sample")
    return told if isinstance(told, dict) else {}


def _known(setup: Setup) -> np.ndarray | None:
    """Covariance (4, 4) of the ball's place and radius; None where calibration does not say, as in earlier files."""
    told = _told(setup)
    if not {"shift", "radius_change", "covariance"} <= told.keys():
        return None
    known = np.array(told["covariance"], float)
    return known if np.linalg.eigvalsh(known)[0] > 0.0 else None


def by_place(setup: Setup) -> Callable[[Cells, Model], np.ndarray] | None:
    """What the ball's place leaves unsure in cells: change (n, 4, c), 1/sr, of the values that a model gives them, by
    one standard deviation of each of four independent turns of centre and radius. All photos share it: it is no noise
    that many of them take away. None where calibration does not say how sure the place is, or of a flat sample."""
    known = _known(setup)
    if known is None or not isinstance(setup.sample, Sphere):
        return None
    root, sample = np.linalg.cholesky(known), setup.sample

    def changes(cells: Cells, model: Model) -> np.ndarray:
        if model.turning or not cells.binned:
            return np.zeros((len(cells), 0, cells.value.shape[1]))
        slopes = _slopes(_shading(cells, model, setup), sample) @ root
        return slopes[:, :, None] * model.evaluate(cells)[:, None]

    return changes


def moved_in_words(moved: MovedSample, unit: str) -> str:
    """For who waits."""
    away = float(np.linalg.norm(moved.change[:3]))
    return f"the ball's shading has it {away:.2g} {unit} off where its limb does: photos are reduced again"


def _shading(cells: Cells, model: Model, setup: Setup) -> Callable[[np.ndarray], np.ndarray]:
    """Logarithm (n,) of the radiance that pixels of the cells see, by change (4,) of the ball's centre and radius."""
    views = {view.name: view for view in setup.views}
    of_group = [views[name] for name in cells.groups]
    camera = np.array([view.pose.center for view in of_group])[cells.group]
    ray = _unit(cells.place - camera)
    center, radius = np.asarray(setup.ball.center, float), float(setup.ball.radius)

    def radiance(change: np.ndarray) -> np.ndarray:
        offset, size = camera - (center + change[:3]), radius + change[3]
        along = np.einsum("ij,ij->i", offset, ray)
        reach = np.sqrt(np.maximum(along**2 - np.einsum("ij,ij->i", offset, offset) + size**2, 0.0))
        place = camera - (along + reach)[:, None] * ray
        normal = _unit(place - center - change[:3])
        light, falloff = np.empty_like(place), np.empty(len(place))
        for group in np.unique(cells.group):
            rows = cells.group == group
            light[rows], falloff[rows] = of_group[group].light.toward(place[rows])
        cos_i = np.clip(np.einsum("ij,ij->i", normal, light), 1e-3, 1.0)
        cos_r = np.clip(-np.einsum("ij,ij->i", normal, ray), 1e-3, 1.0)
        sines = np.sqrt(np.maximum((1.0 - cos_i**2) * (1.0 - cos_r**2), 1e-24))
        cos_d = np.clip((-np.einsum("ij,ij->i", ray, light) - cos_i * cos_r) / sines, -1.0, 1.0)
        value = model.evaluate(Cells.of_angles(np.arccos(cos_i), np.arccos(cos_r), np.arccos(cos_d))).mean(1)
        return np.log(np.maximum(value, TINY) * cos_i * falloff)

    return radiance


def _slopes(radiance: Callable[[np.ndarray], np.ndarray], sample: Sphere) -> np.ndarray:
    """(n, 4) derivatives of it."""
    size = STEP * sample.radius
    ends = [[radiance(sign * size * axis) for sign in (1.0, -1.0)] for axis in np.eye(4)]
    return np.column_stack([(up - down) / (2.0 * size) for up, down in ends])


def _solved(
    cells: Cells, model: Model, slopes: np.ndarray, known: np.ndarray, lamps: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Change (4,) of centre and radius and its covariance, with all else free: of the mean of the channels. ``lamps``
    (n, k) are changes by one standard deviation of the lamps' directions."""
    said = model.evaluate(cells).mean(1)
    mirror = model.lobes.columns(cells)[1]
    surface = np.column_stack([model.basis.design(cells), mirror, shape_slopes(model, cells).mean(2)])
    views = np.eye(len(cells.groups))[cells.group] * said[:, None]
    matrix = np.column_stack([slopes * said[:, None], surface, views, lamps])
    modes = PILOT_PRIOR.precision(model.basis.degree(), level(cells)).mean(0)
    precision = np.zeros((matrix.shape[1],) * 2)
    precision[:4, :4] = np.linalg.inv(known)
    held = np.concatenate(
        [
            modes,
            np.zeros(mirror.shape[1]),
            np.full(surface.shape[1] - len(modes) - mirror.shape[1], SHAPE_SPREAD**-2),
        ]
    )
    held = np.concatenate([held, np.full(views.shape[1], VIEW_ERROR**-2), np.ones(lamps.shape[1])])
    precision[np.arange(4, len(precision)), np.arange(4, len(precision))] = held
    target = cells.value.mean(1) - said
    deviation, counts = error_model(cells).mean(1), independence(cells)[:, 0]
    weight, found, inverse, scale = np.ones(len(target)), np.zeros(len(precision)), precision, 1.0
    for _ in range(ROUNDS):
        scaled = weight * counts / (scale * deviation) ** 2
        inverse = np.linalg.pinv((matrix * scaled[:, None]).T @ matrix + precision, hermitian=True)
        found = inverse @ (matrix.T @ (scaled * target))
        residual = (target - matrix @ found) / deviation
        scale = residual_scale(residual)
        weight = student_weights(residual / scale, PHOTO_FREEDOM)
    return found[:4], inverse[:4, :4]


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
