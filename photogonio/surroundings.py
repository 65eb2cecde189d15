"""The stray light of a photo set: what each photo shows around the sample, joined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calib.setup import Setup, ViewSetup
from calib.surround import Surround, completed, radiance_around, surround_of
from capture.photoset import PhotoSet, Sphere, View
from capture.reader import RadianceReader
from capture.signal import MIDDLE
from reconstruct.stray import StrayLight
from reconstruct.table import FacetTable


def is_stray_light_known(photoset: PhotoSet, setup: Setup) -> bool:
    """Whether a set tells what shines on the sample besides the lamp.

    It does not for a flat sample, which lies in the plane of what surrounds it, nor without a board, whose frame has
    such a plane. Nor where the lamps' strengths are no more than proportions: what shines beside them is measured as
    radiance, and weighs against them.
    """
    measured = setup.scale == "absolute" or all(view.strength_source == "board" for view in setup.views)
    return isinstance(setup.sample, Sphere) and photoset.board is not None and measured


def stray_light(reader: RadianceReader, setup: Setup, table: FacetTable) -> StrayLight | None:
    """What shines on the sample besides the lamp, for the groups and channels of ``table``; reads all its photos."""
    photos = {view.name: view for view in reader.photoset.views("sample")}
    views = {view.name: view for view in setup.views}
    known = is_stray_light_known(reader.photoset, setup)
    around = [
        photo_around(reader, setup, views[name], photos[name]) if known else None for name in table.groups
    ]
    return joined_stray_light(setup, table, around)


def photo_around(reader: RadianceReader, setup: Setup, view: ViewSetup, photo: View) -> np.ndarray:
    """Radiance (m, c) of the cells around the sample in one photo, NaN where it does not show them."""
    width, height = setup.camera.size
    bounds = (MIDDLE, MIDDLE, width - MIDDLE, height - MIDDLE)
    balls = reader.photoset.mirror_balls
    return radiance_around(setup, view, lambda pixels: reader.read_at(photo, pixels), bounds, balls)


def joined_stray_light(
    setup: Setup, table: FacetTable, around: Sequence[np.ndarray | None]
) -> StrayLight | None:
    """The same from ``around``, what :func:`photo_around` read for each group of the table, None where it did not; and
    from the room, if it was not dark."""
    if setup.ambient is None and not any(one is not None for one in around):
        return None
    views = {view.name: view for view in setup.views}
    surrounds = [
        None if radiance is None else surround_of(setup, views[name], radiance)
        for name, radiance in zip(table.groups, around, strict=True)
    ]
    channels = [setup.channels.index(name) for name in table.channels]
    lit = [replace(views[name], strength=views[name].strength[channels]) for name in table.groups]
    sky = None if setup.ambient is None else setup.ambient[channels] / np.pi
    return StrayLight(setup.sample, lit, [_of_channels(one, channels) for one in completed(surrounds)], sky)


def _of_channels(surround: Surround | None, channels: list[int]) -> Surround | None:
    if surround is None:
        return None
    return replace(
        surround,
        radiance=np.ascontiguousarray(surround.radiance[:, channels]),
        lamp=np.ascontiguousarray(surround.lamp[:, channels]),
    )
