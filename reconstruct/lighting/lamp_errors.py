"""What lamps' directions leave unsure in cells, where leaving out views does not tell it.

Of many lamps each errs by itself, and what a view pulls shows what that does. The units of few views are blocks of
directions instead, each of which holds cells of all lamps; a lamp that shines in many views errs alike in all of them;
and of a flat piece one whose place is all but unknown may alone show a peak, which then follows it. There the
directions are unknowns of the fit, each expected where calibration has it. A flat piece takes such a lamp's error for
one of its strength, so that the view is believed less.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from photogonio.calib.setup import Light, Setup, ViewSetup
from photogonio.capture.photoset import Plane, Sphere
from photogonio.reconstruct.estimate.model import Model
from photogonio.reconstruct.table.cells import Cells

FEW = 8  # views: of fewer, all lamps are asked for
MOST = 12  # lamps: of more that shine in several views each, errors are as good as chance
# rms relative change of its cells' values by a lamp's error: most do less than a hundredth
MUCH = 0.02
STEP = 1e-3  # radians, of the derivatives
LEAST_COSINE = 1e-3
TINY = 1e-12


def by_lamps(setup: Setup, *, every: bool = False) -> Callable[[Cells, Model], np.ndarray]:
    """Change (n, k, c), 1/sr, of the values that a model gives cells, by one standard deviation of each of the two
    angles of the lamps in question, or of ``every`` one."""

    def changes(cells: Cells, model: Model) -> np.ndarray:
        found = _each(setup, cells, model)
        if not every:
            found = _in_question(found, setup, cells, model)
        parts = [np.zeros((len(cells), 0, cells.value.shape[1]))]
        for rows, change in found.values():
            one = np.zeros((len(cells), *change.shape[1:]))
            one[rows] = change
            parts.append(one)
        return np.concatenate(parts, axis=1)

    return changes


def doubted_views(setup: Setup) -> Callable[[Cells, Model], np.ndarray]:
    """Relative standard errors (g,) of a flat sample's views by lamps whose errors matter; 0 of all others."""

    def errors(cells: Cells, model: Model) -> np.ndarray:
        found = np.zeros(len(cells.groups))
        if isinstance(setup.sample, Plane):
            for rows, change in _each(setup, cells, model).values():
                size = _relative(change, cells.take(rows), model)
                found[np.unique(cells.group[rows])] = size if size > MUCH else 0.0
        return found

    return errors


def _each(setup: Setup, cells: Cells, model: Model) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Of every lamp by its id, in the order of the views, its cells (n,) bool and their change (k, 2, c)."""
    if model.turning or not cells.binned:
        return {}
    of_group = _views(setup, cells)
    lamp = np.array([view.light.id for view in of_group])[cells.group]
    found = {}
    for name in dict.fromkeys(of_group[group].light.id for group in np.unique(cells.group)):
        rows = lamp == name
        found[name] = rows, _turned(cells.take(rows), model, of_group, setup)
    return found


def _in_question(
    found: dict[str, tuple[np.ndarray, np.ndarray]], setup: Setup, cells: Cells, model: Model
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Those of the lamps whose errors are to be heeded."""
    of_group = _views(setup, cells)
    count: dict[str, int] = {}
    for group in np.unique(cells.group):
        name = of_group[group].light.id
        count[name] = count.get(name, 0) + 1
    if sum(count.values()) < FEW:
        return found
    shared = [name for name, times in count.items() if times > 1]
    heeded = set(shared if len(shared) <= MOST else ())
    if isinstance(setup.sample, Plane):
        size = {name: _relative(change, cells.take(rows), model) for name, (rows, change) in found.items()}
        heeded.update(
            sorted((name for name in size if size[name] > MUCH), key=lambda name: -size[name])[:MOST]
        )
    return {name: one for name, one in found.items() if name in heeded}


def _views(setup: Setup, cells: Cells) -> list[ViewSetup]:
    views = {view.name: view for view in setup.views}
    return [views[name] for name in cells.groups]


def _relative(change: np.ndarray, cells: Cells, model: Model) -> float:
    """Rms, over ``cells`` and channels, of their ``change`` (n, 2, c) by both angles over their values."""
    value = np.maximum(np.abs(model.evaluate(cells)), TINY)
    return float(np.sqrt(np.mean((change**2).sum(1) / value**2)))


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
