"""The stray light of a photo set: what each photo shows around the sample, read once more and joined."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from calib.setup import Setup
from calib.surround import Surround, completed, measure_surround
from capture.photoset import Sphere
from capture.reader import RadianceReader
from reconstruct.stray import StrayLight
from reconstruct.table import FacetTable


def stray_light(
    reader: RadianceReader,
    setup: Setup,
    table: FacetTable,
    *,
    workers: int = 1,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> StrayLight | None:
    """What shines on the sample besides the lamp, for the groups and channels of ``table``.

    None where nothing is known of it: a flat sample, which lies in the plane of what surrounds it, or a set without a
    board, whose frame has no such plane.
    """
    photoset = reader.photoset
    if not isinstance(setup.sample, Sphere) or photoset.board is None:
        return None
    photos = {view.name: view for view in photoset.views("sample")}
    views = {view.name: view for view in setup.views}

    def measure(name: str) -> Surround | None:
        return measure_surround(setup, views[name], reader.read(photos[name]), photoset.mirror_balls)

    with ThreadPoolExecutor(workers) as pool:
        surrounds = []
        for done, surround in enumerate(pool.map(measure, table.groups), 1):
            surrounds.append(surround)
            progress(done, len(table.groups))
    channels = [setup.channels.index(name) for name in table.channels]
    lit = [replace(views[name], strength=views[name].strength[channels]) for name in table.groups]
    return StrayLight(setup.sample, lit, [_of_channels(one, channels) for one in completed(surrounds)])


def _of_channels(surround: Surround | None, channels: list[int]) -> Surround | None:
    if surround is None:
        return None
    return replace(
        surround,
        radiance=np.ascontiguousarray(surround.radiance[:, channels]),
        lamp=np.ascontiguousarray(surround.lamp[:, channels]),
    )
