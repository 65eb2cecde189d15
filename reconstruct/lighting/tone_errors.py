"""What a tone curve that print told leaves unsure in cells.

A cell's value is the sample's light over the paper's. The curve is surer between codes that print has than beside them,
and surest of all near the paper's own: so a dark cell is less sure than a bright one, and cells of one code err alike,
whatever photo they are of. The fit does not seek the curve: what models miss would seem to tell it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from photogonio.calib.setup import PrintTone, Setup, ViewSetup
from photogonio.capture.photoset import Sphere
from photogonio.reconstruct.estimate.model import Model
from photogonio.reconstruct.table.cells import Cells

PAPER = 0.8 / np.pi  # BRDF of white print, about: a tenth of it moves its code little
MOST = 1.0  # of the logarithm of light, that one standard deviation changes it: there a code says nothing
LEAST_COSINE = 1e-3


def by_tone(setup: Setup) -> Callable[[Cells, Model], np.ndarray] | None:
    """Change (n, k, c), 1/sr, of the values that a model gives cells, by one standard deviation of each of k
    independent errors of the curve. None where the photos' curve is known, or the codes of their cells are not."""
    tone = setup.tone
    if (
        tone is None
        or not len(tone.doubts)
        or not {view.name for view in setup.views} <= tone.exposures.keys()
    ):
        return None
    views = {view.name: view for view in setup.views}

    def changes(cells: Cells, model: Model) -> np.ndarray:
        channels = [setup.channels.index(name) for name in cells.channels]
        if model.turning or not cells.binned or not channels:
            return np.zeros((len(cells), 0, cells.value.shape[1]))
        value = model.evaluate(cells)
        change = np.zeros((len(cells), len(tone.doubts), value.shape[1]))
        for group in np.unique(cells.group):
            rows, view = cells.group == group, views[cells.groups[group]]
            of_cells = _light(
                setup, view, cells.place[rows], value[rows], _normals(setup, cells.place[rows]), channels
            )
            middle = (
                cells.place[rows].mean(0) if not isinstance(setup.sample, Sphere) else _foot(setup.sample)
            )
            of_paper = _light(setup, view, middle[None], np.full((1, len(channels)), PAPER), _UP, channels)
            apart = _changed(tone, of_cells, channels) - _changed(tone, of_paper, channels)
            change[rows] = np.clip(apart, -MOST, MOST) * value[rows][:, None]
        return change

    return changes


_UP = np.array([[0.0, 0.0, 1.0]])


def _foot(sample: Sphere) -> np.ndarray:
    """Where a ball stands on the ground (3,)."""
    return np.append(np.asarray(sample.center, float)[:2], 0.0)


def _normals(setup: Setup, places: np.ndarray) -> np.ndarray:
    """(n, 3) of the sample at ``places``."""
    if not isinstance(setup.sample, Sphere):
        return np.broadcast_to(_UP, places.shape)
    out = places - np.asarray(setup.sample.center, float)
    return out / np.linalg.norm(out, axis=1)[:, None]


def _light(
    setup: Setup,
    view: ViewSetup,
    places: np.ndarray,
    value: np.ndarray,
    normals: np.ndarray,
    channels: list[int],
) -> np.ndarray:
    """Light (n, c), 1 at full scale, that a view's photo had of a BRDF ``value`` (n, c), 1/sr, at world ``places``."""
    assert setup.tone is not None
    toward, falloff = view.light.toward(places)
    cosine = np.maximum(np.einsum("ij,ij->i", toward, normals), LEAST_COSINE)
    radiance = value * (cosine * falloff)[:, None] * view.strength[channels]
    if setup.falloff is not None and setup.falloff.allowed:
        aside = setup.camera.aside(setup.camera.project(view.pose, places))
        radiance = radiance * np.exp(np.column_stack([aside, aside**2]) @ setup.falloff.terms)[:, None]
    if view.veil is not None:
        radiance = radiance + view.veil[channels]
    return radiance * setup.tone.exposures[view.name]


def _changed(tone: PrintTone, light: np.ndarray, channels: list[int]) -> np.ndarray:
    """Changes (n, k, c) of the logarithm of ``light`` (n, c) as it was read."""
    codes = np.linspace(0.0, 1.0, len(tone.table))
    at = np.linspace(0.0, 1.0, tone.doubts.shape[1])
    found = np.empty((len(light), len(tone.doubts), len(channels)))
    for own, channel in enumerate(channels):
        code = np.interp(light[:, own], tone.table[:, channel], codes)
        for k, one in enumerate(tone.doubts):
            found[:, k, own] = np.interp(code, at, one[:, channel])
    return found
