"""Sessions of photos of one sample, joined: each with its own set-up, one table for one fit.

Each session has its frame, its unit of length and its unit of radiance. The later ones are brought to the first one's
frame, so that the middle of the sample lies where it lay there, as large as there: what a fit takes (directions,
irradiance, solid angles) is the same in either. Sessions are taken in an order of their own, by what is in them, so
that the result does not depend on how they were named on the command line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from photogonio.calib.radiometry.surround import cells_around
from photogonio.calib.remarks import LeftOut
from photogonio.calib.setup import Light, Setup, ViewSetup
from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import Plane, Sphere
from photogonio.reconstruct.lighting.stray_limits import Spoilt
from photogonio.reconstruct.lighting.veil_error import veil_error
from photogonio.reconstruct.table.facet_table import FacetTable, add_tables
from photogonio.run.circumstances import Circumstances
from photogonio.run.session_scales import CONTRADICTED, Scales, Session, scaled, scales_of
from photogonio.run.surroundings import Shown

NO_SKY = (
    1e6  # by which the unit of radiance of a dark room is smaller, where another session's room is not dark
)


def joined(sessions: Sequence[Session]) -> tuple[FacetTable, Circumstances]:
    """One table and its circumstances, whatever the order of the sessions.

    Raises:
        InputError: two of them cannot be of one sample, or were reduced otherwise.
    """
    found = sorted(sessions, key=lambda one: one.order)
    # those on an absolute scale first: the others are brought to it
    found.sort(key=lambda one: one.known.setup.scale != "absolute")
    for one, next_one in pairwise(found):
        if one.digest == next_one.digest:
            raise InputError(
                next_one.where, f"is the same table as {one.where}: its photos would count twice"
            )
        _require_alike(found[0], next_one)
    names = _names(found)
    named = [_named(session, name) for session, name in zip(found, names, strict=True)]
    sky = next((k.known.setup.ambient for k in named if k.known.setup.ambient is not None), None)
    moved = [_moved(session, named[0], sky) for session in named]
    scales = scales_of(moved, _shown(moved))
    parts = [scaled(*of) for of in zip(moved, scales.factor, scales.doubt, strict=True)]
    table = add_tables([part.table for part in parts])
    return table, _known(parts, names, scales, table)


def _require_alike(first: Session, other: Session) -> None:
    """Raises InputError where two sessions cannot be added."""
    a, b = first.known, other.known
    told = {
        "facets of level": (first.table.level, other.table.level),
        "channels": (", ".join(first.table.channels), ", ".join(other.table.channels)),
        "channels of the camera": (", ".join(a.setup.channels), ", ".join(b.setup.channels)),
        "a sample that is a": tuple(
            "ball" if isinstance(k.setup.sample, Sphere) else "plane" for k in (a, b)
        ),
        "symmetry": (a.symmetry, b.symmetry),
        "cells of symmetry": tuple("isotropic" if s.table.isotropic else "any" for s in (first, other)),
        "colours": (a.space, b.space),
    }
    for what, (one, two) in told.items():
        if one != two:
            raise InputError(other.where, f"has {what} {two}, and {first.where} {one}: they cannot be added")
    if a.matrix is not None and b.matrix is not None and not np.allclose(a.matrix, b.matrix, rtol=0.1):
        raise InputError(
            other.where, f"has other colours of its camera than {first.where}: they cannot be added"
        )


def _names(sessions: Sequence[Session]) -> list[str]:
    """What the sessions are called: by their sets, with a part of their digests where sets share a name."""
    names = [one.known.name for one in sessions]
    return [n if names.count(n) == 1 else f"{n} {s.digest[:8]}" for n, s in zip(names, sessions, strict=True)]


def _named(session: Session, name: str) -> Session:
    """With the session's name before those of its photos and lamps."""

    def of(photo: str) -> str:
        return f"{name}: {photo}"

    known, setup = session.known, session.known.setup
    views = tuple(
        replace(view, name=of(view.name), light=replace(view.light, id=of(view.light.id)), marks=None)
        for view in setup.views
    )
    left_out = tuple(LeftOut(of(one.name), one.reason) for one in setup.left_out)
    shown = known.shown
    brightness = None if shown.brightness is None else {of(k): v for k, v in shown.brightness.items()}
    known = replace(
        known,
        setup=replace(setup, views=views, boards=(), left_out=left_out, source={}),
        shown=replace(shown, brightness=brightness),
        left_out=tuple(LeftOut(of(one.name), one.reason) for one in known.left_out),
        diagnoses=tuple(_of_session(one, name, tuple(map(of, one.views))) for one in known.diagnoses),
    )
    return replace(
        session, table=replace(session.table, groups=tuple(map(of, session.table.groups))), known=known
    )


def _of_session(one: Diagnosis, name: str, views: tuple[str, ...]) -> Diagnosis:
    return replace(one, message=f"{name}: {one.message}", views=views)


def _moved(session: Session, first: Session, sky: np.ndarray | None) -> Session:
    """In the first one's frame and unit of length, and in a unit of radiance in which its room has the light ``sky``
    (c,)."""
    setup, table, c = session.known.setup, session.table, len(session.known.setup.channels)
    target = first.known.setup
    size = _size(target.sample) / _size(setup.sample)
    shift = _middle(target.sample) - size * _middle(setup.sample)
    unit = _unit(setup.ambient, sky, c)
    views = tuple(_view_moved(view, size, shift, unit) for view in setup.views)
    table = replace(table, place=size * table.place + table.weight[:, None] * shift)
    around = tuple(None if one is None else one * unit for one in session.known.shown.around)
    known = replace(
        session.known,
        setup=replace(setup, views=views, sample=target.sample),
        shown=replace(session.known.shown, around=around),
    )
    return replace(session, table=table, known=known)


def _view_moved(view: ViewSetup, size: float, shift: np.ndarray, unit: np.ndarray) -> ViewSetup:
    """``X' = size X + shift`` in the world, the camera's frame as much larger; radiance in another ``unit`` (c,)."""
    light = _light_moved(view.light, size, shift)
    by_distance = size**2 if view.light.kind == "point" else 1.0  # strengths are irradiance times length^2
    spread = np.array([1.0, 1.0, 1.0, size, size, size])
    covariance = view.pose_covariance
    return replace(
        view,
        light=light,
        pose=replace(view.pose, translation=size * view.pose.translation - view.pose.rotation @ shift),
        pose_covariance=None if covariance is None else covariance * np.outer(spread, spread),
        strength=view.strength * unit * by_distance,
        strength_error=view.strength_error * unit * by_distance,
        veil=None if view.veil is None else view.veil * unit,
        veil_error=None if view.veil_error is None else view.veil_error * unit,
    )


def _light_moved(light: Light, size: float, shift: np.ndarray) -> Light:
    if light.kind != "point":
        return light
    return replace(
        light,
        place=size * light.place + shift,
        covariance=size**2 * light.covariance,
        radius=size * light.radius,
    )


def _known(
    parts: Sequence[Session], names: Sequence[str], scales: Scales, table: FacetTable
) -> Circumstances:
    known, setups = [part.known for part in parts], [part.known.setup for part in parts]
    first = setups[0]
    apart: tuple[Diagnosis, ...] = ()
    if scales.apart > CONTRADICTED:
        message = (
            f"the scales of {' and '.join(names)} differ by {scales.apart:.1f} of their standard errors; the error of "
            "all of f is stated as much larger"
        )
        apart = (Diagnosis("sessions-contradict", message, scales.apart, least=CONTRADICTED, allowed=True),)
    setup: Setup = replace(
        first,
        views=tuple(view for one in setups for view in one.views),
        left_out=tuple(photo for one in setups for photo in one.left_out),
        warnings=tuple(f"{name}: {w}" for name, one in zip(names, setups, strict=True) for w in one.warnings),
        residuals={name: one.residuals for name, one in zip(names, setups, strict=True)},
        ambient=next((one.ambient for one in setups if one.ambient is not None), None),
        tone=None,  # each has its own: what they leave unsure is in the scales
        turned=(),
        diagnoses=tuple(
            _of_session(d, name, d.views)
            for name, one in zip(names, setups, strict=True)
            for d in one.diagnoses
        ),
    )
    setup = replace(setup, scale_error=scales.beside(veil_error(table, setup)))
    return replace(
        known[0],
        name=" + ".join(names),
        setup=setup,
        shown=_shown(parts),
        left_out=tuple(photo for one in known for photo in one.left_out),
        diagnoses=(*(one for k in known for one in k.diagnoses), *apart),
    )


def _shown(parts: Sequence[Session]) -> Shown:
    """What lies around the sample in all photos; of sessions that know it, nothing is left unknown."""
    shown, cells = [part.known.shown for part in parts], None
    sample = parts[0].known.setup.sample
    if isinstance(sample, Sphere):
        cells = cells_around(sample)
    around: list[np.ndarray | None] = []
    for part in parts:
        seen = part.known.shown.around or (None,) * len(part.table.groups)
        around += [one if one is not None and len(one) == cells else None for one in seen]
    unknown = [one for one in shown if one.brightness is not None]
    brightness = None
    if unknown:
        brightness = dict.fromkeys((name for part in parts for name in part.table.groups), 0.0)
        for one in unknown:
            brightness |= one.brightness or {}
    return Shown(
        tuple(around),
        brightness,
        bool(unknown) and all(one.grounded for one in unknown),
        _spoilt([one.spoilt for one in shown if one.spoilt is not None]),
        "; ".join(dict.fromkeys(one.why for one in shown if one.why)),
    )


def _spoilt(found: Sequence[Spoilt]) -> Spoilt | None:
    if not found:
        return None
    pixels, of = sum(one.pixels for one in found), sum(one.of for one in found)
    typical = sum(one.of * one.typical for one in found) / max(of, 1)
    return Spoilt(pixels, of, min(one.beyond for one in found), typical)


def _unit(ambient: np.ndarray | None, target: np.ndarray | None, channels: int) -> np.ndarray:
    """By which radiance (c,) is multiplied so that one room's light stands for both sessions'."""
    if target is None:
        return np.ones(channels)
    if ambient is None:
        return np.full(channels, NO_SKY)
    return np.where((ambient > 0.0) & (target > 0.0), target / np.where(ambient > 0.0, ambient, 1.0), NO_SKY)


def _middle(sample: Sphere | Plane) -> np.ndarray:
    return sample.center if isinstance(sample, Sphere) else np.append(sample.outline.mean(0), sample.height)


def _size(sample: Sphere | Plane) -> float:
    """A length that tells one unit from another; a flat sample's may be cut to any size."""
    return sample.radius if isinstance(sample, Sphere) else 1.0
