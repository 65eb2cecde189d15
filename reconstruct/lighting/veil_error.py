"""What is not known of light that lay over whole photos, in what was measured of the sample."""

from __future__ import annotations

import numpy as np

from photogonio.calib.setup import Setup
from photogonio.capture.photoset import Sphere
from photogonio.reconstruct.table.facet_table import FacetTable

LEAST_COSINE = 1e-3


def veil_error(table: FacetTable, setup: Setup) -> float:
    """Relative standard error that it leaves in the middle one of the table's cells; 0 where none was found.

    Photos were read against the same paper, so that they err alike: this is no noise that many of them take away.
    """
    views = {view.name: view for view in setup.views}
    if all(views[name].veil_error is None for name in table.groups):
        return 0.0
    channels = [setup.channels.index(name) for name in table.channels]
    value, place = table.value / table.weight[:, None], table.place / table.weight[:, None]
    normal = np.broadcast_to([0.0, 0.0, 1.0], place.shape)
    if isinstance(setup.sample, Sphere):
        normal = (place - setup.sample.center) / np.linalg.norm(place - setup.sample.center, axis=1)[:, None]
    share = np.zeros_like(value)
    for group, name in enumerate(table.groups):
        view, rows = views[name], table.group == group
        if view.veil_error is None:
            continue
        toward, falloff = view.light.toward(place[rows])
        cosine = np.maximum(np.einsum("ij,ij->i", toward, normal[rows]), LEAST_COSINE)
        light = (cosine * falloff)[:, None] * view.strength[channels]
        share[rows] = view.veil_error[channels] / np.maximum(
            light * np.abs(value[rows]), np.finfo(float).tiny
        )
    return float(np.median(share))
