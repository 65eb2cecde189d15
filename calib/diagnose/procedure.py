"""The order in which departures are asked for and allowed for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from photogonio.calib.adjust.alternate import settle
from photogonio.calib.adjust.state import Settled, State
from photogonio.calib.diagnose.base import Assumption, Known, LightDeparture
from photogonio.calib.setup import ViewSetup

_ASTRAY = 1.2  # times a photo's paper is farther from a model that is nearer to the others'


def ask(known: Known, departures: Iterable[Assumption[Known]]) -> Known:
    """One after the other, each on the state that the one before has left; what is found goes to the remarks."""
    for departure in departures:
        found = departure.evidence(known)
        after = departure.remedy(known, found) if found else known
        if after is not None:
            known.remarks.diagnoses += [one for one in found if one.message]
            known = after
    return known


def settle_allowing(state: State, departures: Sequence[LightDeparture]) -> State:
    """Everything settled, and again for each departure that then shows: the surest first, for any two look a little
    alike. One that is not certain by itself is kept if the paper fits closer with it."""
    state = settle(state)
    left = {one.code: one for one in departures}
    refused: set[str] = set()
    while True:
        seen = {one.code: one for departure in left.values() for one in departure.evidence(state)}
        state = replace(state, found={**{c: d for c, d in state.found.items() if d.allowed}, **seen})
        told = {code: one for code, one in seen.items() if one.told and code not in refused}
        ready = [code for code in told if not any(other in told for other in left[code].after)]
        if not ready:
            return state
        surest = max(ready, key=lambda code: told[code].sureness)
        departure = left[surest]
        remedied = departure.remedy(state, [told[surest]])
        tried = settle(remedied)
        if not departure.certain and one_astray(tried.settled, state.settled):
            tried = settle(remedied, longer=True)
        if not departure.certain and not fits_closer(tried.settled, state.settled):
            refused.add(surest)
            continue
        forgotten = {one.code: one for one in departures if one.code in departure.anew}
        left = {c: one for c, one in {**left, **forgotten}.items() if c != surest}
        known = {c: d for c, d in state.found.items() if c not in forgotten}
        state = replace(tried, found={**known, surest: replace(told[surest], allowed=True)})
        refused.clear()


def fits_closer(settled: Settled, other: Settled) -> bool:
    """Whether the paper of the photos that both have is nearer to the model in the first: by what it misses, relative,
    since the errors that each expects are its own, and count what it does not believe against it."""
    both = settled.shading.keys() & other.shading.keys()
    first, second = (
        sum(one.shading[name].rms ** 2 / one.shading[name].believed for name in both)
        for one in (settled, other)
    )
    return first < second


def one_astray(settled: Settled, other: Settled) -> bool:
    """Whether the paper of most photos is nearer to the model in the first, and of some much farther from it: their
    lamps settled elsewhere, which says nothing against the model."""
    both = settled.shading.keys() & other.shading.keys()
    ratio = np.array([settled.shading[name].rms / other.shading[name].rms for name in both])
    return len(ratio) > 0 and bool(np.median(ratio) < 1.0 < _ASTRAY <= ratio.max())


def tell_lights(
    state: State, departures: Sequence[LightDeparture], allowed: Mapping[str, bool] | None = None
) -> None:
    """What was found of lamps and lens goes to the remarks. ``allowed`` may deny, by code, that what was told could be
    allowed for."""
    for one in departures:
        found = state.found.get(one.code)
        if found is None:
            continue
        found = one.as_settled(state, found)
        state.remarks.residuals.update(one.numbers(found))
        kept = found.allowed and (allowed or {}).get(one.code, True)
        message = one.message(found, allowed=kept)
        if message:
            told = replace(found, code=one.told_as(found), message=message, allowed=kept)
            state.remarks.diagnoses.append(told)


def doubted(
    state: State, departures: Sequence[LightDeparture], views: Sequence[ViewSetup]
) -> tuple[tuple[ViewSetup, ...], float]:
    """The views with what departures leave behind in their strengths' errors, and what of it all of them share,
    relative."""
    doubts = [one.doubt(state, views) for one in departures]
    own = np.linalg.norm([np.broadcast_to(one.own, len(views)) for one in doubts], axis=0)
    wider = [
        replace(view, strength_error=np.hypot(view.strength_error, error * view.strength))
        for view, error in zip(views, own, strict=True)
    ]
    return tuple(wider), float(np.linalg.norm([one.common for one in doubts]))
