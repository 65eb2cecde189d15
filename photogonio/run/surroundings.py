"""The stray light of a photo set: what each photo shows around the sample, joined; and what may be there unseen."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from photogonio.calib.radiometry.surround import (
    Surround,
    backdrop,
    cells_around,
    completed,
    near_shown,
    radiance_around,
    surround_of,
)
from photogonio.calib.setup import Setup, ViewSetup
from photogonio.capture.linear.reader import RadianceReader
from photogonio.capture.linear.signal import MIDDLE
from photogonio.capture.photoset import PhotoSet, Sphere, View
from photogonio.reconstruct.lighting.stray_light import StrayLight
from photogonio.reconstruct.lighting.stray_limits import Spoilt, UnknownStray, unknown_stray, without_spoilt
from photogonio.reconstruct.table.facet_table import FacetTable

ON_GROUND = 0.1  # of a ball's radius: how far its foot may be from the frame's z = 0, and stand there
LEAST_SHOWN = 0.2  # share of what lies near the sample that photos must show; the rest is as the nearest

PhotoAround = Callable[[RadianceReader, Setup, ViewSetup, View], np.ndarray]


@dataclass(frozen=True, slots=True)
class LightAround:
    """What shines on the sample besides the lamp: as far as it is known, and where it is not."""

    known: StrayLight | None
    unknown: UnknownStray | None = None
    spoilt: Spoilt | None = None  # pixels left out for it
    why: str = ""  # it is not known


@dataclass(frozen=True, slots=True)
class Shown:
    """What the photos show around the sample, for a table's groups: what :class:`LightAround` is made of."""

    around: tuple[np.ndarray | None, ...]  # (m, c) of each group, by :func:`photo_around`
    brightness: Mapping[str, float] | None = None  # of each group, as UnknownStray has it; None: it is known
    grounded: bool = False
    spoilt: Spoilt | None = None
    why: str = ""

    def check(self, setup: Setup, groups: int) -> None:
        """Raises ValueError where it cannot be of such a set."""
        if len(self.around) != groups:
            raise ValueError(f"surroundings of {len(self.around)} photos, not {groups}")
        if self.brightness is not None and not isinstance(setup.sample, Sphere):
            raise ValueError("surroundings that are not known, of a flat sample")
        given = [one for one in self.around if one is not None]
        if not given:
            return
        if not isinstance(setup.sample, Sphere):
            raise ValueError("surroundings of a flat sample")
        shape = (cells_around(setup.sample), len(setup.channels))
        if any(one.shape != shape or np.isinf(one).any() for one in given):
            raise ValueError(f"surroundings of shape {given[0].shape}, not {shape}")


def is_stray_light_known(photoset: PhotoSet, setup: Setup) -> bool:
    """Whether a set can tell what shines on the sample besides the lamp.

    It has no need to for a flat sample, which lies in the plane of what surrounds it. For a ball there must be such a
    plane: the board's or, in a frame without a board, the one that the ball stands on. And where the lamps' strengths
    are no more than proportions, what shines beside them, measured as radiance, cannot be weighed against them.
    """
    return isinstance(setup.sample, Sphere) and is_grounded(photoset, setup.sample) and is_measured(setup)


def is_measured(setup: Setup) -> bool:
    """Whether the lamps' strengths are in units of radiance."""
    return setup.scale == "absolute" or any(view.strength_source == "board" for view in setup.views)


def is_grounded(photoset: PhotoSet, sample: Sphere) -> bool:
    """Whether the frame's z = 0 is what lies around the ball."""
    return photoset.board is not None or abs(sample.center[2] - sample.radius) <= ON_GROUND * sample.radius


def around_of(photoset: PhotoSet, setup: Setup) -> PhotoAround | None:
    """What is to be read of each photo beside the sample; None for a flat one."""
    if not isinstance(setup.sample, Sphere):
        return None
    return photo_around if is_stray_light_known(photoset, setup) else photo_backdrop


def light_around(reader: RadianceReader, setup: Setup, table: FacetTable) -> tuple[LightAround, FacetTable]:
    """What :func:`told_around` finds, from the set's photos, which it reads."""
    photos = {view.name: view for view in reader.photoset.views("sample")}
    views = {view.name: view for view in setup.views}
    read = around_of(reader.photoset, setup)
    around = [
        None if read is None else read(reader, setup, views[name], photos[name]) for name in table.groups
    ]
    return told_around(reader.photoset, setup, table, around)


def told_around(
    photoset: PhotoSet, setup: Setup, table: FacetTable, around: Sequence[np.ndarray | None]
) -> tuple[LightAround, FacetTable]:
    """What shines on the sample besides the lamp, for the groups and channels of ``table``; and the table, where that
    cannot be known without the pixels that it may spoil.

    ``around`` is what :func:`around_of`'s reader read for each group of the table.
    """
    shown, kept = shown_around(photoset, setup, table, around)
    return light_of(shown, setup, kept), kept


def shown_around(
    photoset: PhotoSet, setup: Setup, table: FacetTable, around: Sequence[np.ndarray | None]
) -> tuple[Shown, FacetTable]:
    """What of :func:`told_around` does not depend on which of its channels are fitted."""
    known = is_stray_light_known(photoset, setup) and near_shown(around) >= LEAST_SHOWN
    if not isinstance(setup.sample, Sphere) or known:
        return Shown(tuple(around)), table
    nobody = np.full(len(setup.channels), np.nan)
    seen = np.stack([nobody if one is None or one.ndim > 1 else one for one in around])
    grounded, measured = is_grounded(photoset, setup.sample), is_measured(setup)
    unknown = unknown_stray(table, setup, seen, grounded=grounded, measured=measured)
    kept, spoilt = without_spoilt(table, unknown)
    nothing = (None,) * len(around)
    return Shown(nothing, unknown.brightness, grounded, spoilt, _why_unknown(photoset, setup)), kept


def light_of(shown: Shown, setup: Setup, table: FacetTable) -> LightAround:
    """What shines on the sample besides the lamp, for the groups and channels of ``table``."""
    room = joined_stray_light(setup, table, shown.around)
    if shown.brightness is None or not isinstance(setup.sample, Sphere):
        return LightAround(room)
    views = {view.name: view for view in setup.views}
    lights = {name: views[name].light for name in table.groups}
    unknown = UnknownStray(setup.sample, lights, shown.brightness, shown.grounded)
    return LightAround(room, unknown, shown.spoilt, shown.why)


def _why_unknown(photoset: PhotoSet, setup: Setup) -> str:
    if not is_grounded(photoset, setup.ball):
        return "there is no board, nor does the ball stand on z = 0"
    return (
        "no photo shows what lies around it"
        if is_measured(setup)
        else "the lamps' strengths are mere proportions"
    )


def photo_around(reader: RadianceReader, setup: Setup, view: ViewSetup, photo: View) -> np.ndarray:
    """Radiance (m, c) of the cells around the sample in one photo, NaN where it does not show them."""
    balls = reader.photoset.mirror_balls
    return radiance_around(setup, view, lambda pixels: reader.read_at(photo, pixels), _bounds(setup), balls)


def photo_backdrop(reader: RadianceReader, setup: Setup, view: ViewSetup, photo: View) -> np.ndarray:
    """Mean radiance (c,) beside the sample in one photo, wherever that is; NaN where it does not show it."""
    balls = reader.photoset.mirror_balls
    return backdrop(setup, view, lambda pixels: reader.read_at(photo, pixels), _bounds(setup), balls)


def _bounds(setup: Setup) -> tuple[int, int, int, int]:
    width, height = setup.camera.size
    return MIDDLE, MIDDLE, width - MIDDLE, height - MIDDLE


def joined_stray_light(
    setup: Setup, table: FacetTable, around: Sequence[np.ndarray | None]
) -> StrayLight | None:
    """What shines on the sample besides the lamp, from ``around``, what :func:`photo_around` read for each group of
    the table, None where it did not; and from the room, if it was not dark."""
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
