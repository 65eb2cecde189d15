"""What lamps' directions leave unsure in cells, where leaving out views does not tell it.

Of many lamps each errs by itself, and a fit without one view in turn shows what that does. Few views are left out in
blocks of directions instead, each of which holds cells of all lamps; and a lamp that shines in many views errs alike in
all of them. There the directions are unknowns of the fit, each expected where calibration has it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from photogonio.calib.setup import Light, Setup, ViewSetup
from photogonio.capture.photoset import Sphere
from photogonio.reconstruct.estimate.model import Model
from photogonio.reconstruct.table.cells import Cells

FEW = 8  # views: of fewer, all lamps are asked for
MOST = 12  # lamps: of more that shine in several views each, errors are as good as chance
STEP = 1e-3  # radians, of the derivatives
LEAST_COSINE = 1e-3
TINY = 1e-12


def by_lamps(setup: Setup, *, every: bool = False) -> Callable[[Cells, Model], np.ndarray]:
    """Change (n, k, c), 1/sr, of the values that a model gives cells, by one standard deviation of each of the two
    angles of the lamps in question, or of ``every`` one."""

    def changes(cells: Cells, model: Model) -> np.ndarray:
        none = np.zeros((len(cells), 0, cells.value.shape[1]))
        if model.turning or not cells.binned:
            return none
        views = {view.name: view for view in setup.views}
        of_group = [views[name] for name in cells.groups]
        used = sorted(np.unique(cells.group))
        parts = [none]
        for lamp in _in_question([of_group[group] for group in used], every):
            rows = np.isin(cells.group, [g for g in used if of_group[g].light.id == lamp])
            seen, change = cells.take(rows), np.zeros((len(cells), 2, cells.value.shape[1]))
            change[rows] = _turned(seen, model, of_group, setup)
            parts.append(change)
        return np.concatenate(parts, axis=1)

    return changes


def _in_question(views: list[ViewSetup], every: bool) -> list[str]:
    """Ids of lamps whose errors are to be heeded, in the order of the views."""
    count: dict[str, int] = {}
    for view in views:
        count[view.light.id] = count.get(view.light.id, 0) + 1
    if len(views) < FEW or every:
        return list(count)
    shared = [name for name, times in count.items() if times > 1]
    return shared if len(shared) <= MOST else []


def _turned(cells: Cells, model: Model, views: list[ViewSetup], setup: Setup) -> np.ndarray:
    """(n, 2, c) of ``cells`` (n,) of one lamp, by one standard deviation of its direction along two axes."""
    light = views[cells.group[0]].light
    sample = setup.sample
    ball = isinstance(sample, Sphere)
    middle = np.asarray(sample.center, float) if isinstance(sample, Sphere) else cells.place.mean(0)
    normal = _unit(cells.place - middle) if ball else np.broadcast_to([0.0, 0.0, 1.0], cells.place.shape)
    back = _unit(np.array([view.pose.center for view in views])[cells.group] - cells.place)

    def radiance(turn: np.ndarray) -> np.ndarray:
        """(n, c) with the lamps turned by a rotation vector (3,); of a flat sample, over its patch."""
        toward = np.empty_like(cells.place)
        for group in np.unique(cells.group):
            rows = cells.group == group
            toward[rows] = views[group].light.toward(cells.place[rows])[0]
        toward = _unit(toward + np.cross(turn, toward))
        cos_i = np.clip(np.einsum("ij,ij->i", normal, toward), LEAST_COSINE, 1.0)
        cos_r = np.clip(np.einsum("ij,ij->i", normal, back), LEAST_COSINE, 1.0)
        sines = np.sqrt(np.maximum((1.0 - cos_i**2) * (1.0 - cos_r**2), TINY))
        cos_d = np.clip((np.einsum("ij,ij->i", back, toward) - cos_i * cos_r) / sines, -1.0, 1.0)
        value = model.evaluate(Cells.of_angles(np.arccos(cos_i), np.arccos(cos_r), np.arccos(cos_d)))
        return value * cos_i[:, None] if ball else value

    now = radiance(np.zeros(3))
    scale = np.maximum(np.abs(now), TINY)
    own = model.evaluate(cells)
    slopes = [(radiance(STEP * axis) - radiance(-STEP * axis)) / (2.0 * STEP) for axis in np.eye(3)]
    relative = np.stack(slopes, axis=1) / scale[:, None]
    return np.einsum("nxc,xk->nkc", relative * own[:, None], _turns(light, middle))


def _turns(light: Light, middle: np.ndarray) -> np.ndarray:
    """Rotation vectors (3, 2), each one standard deviation of the direction of ``light`` from ``middle`` (3,)."""
    covariance, toward = light.covariance, light.toward(middle[None])[0][0]
    if light.kind == "point":
        covariance = covariance / float(np.sum((light.place - middle) ** 2))
    across = np.eye(3) - np.outer(toward, toward)
    size, axes = np.linalg.eigh(across @ covariance @ across)
    shifts = axes[:, 1:] * np.sqrt(np.maximum(size[1:], 0.0))
    return np.cross(toward, shifts, axisb=0, axisc=0)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
