"""Photos that cannot be what they seem: a print that is not sharp, a lamp that is something else.

Of lamps that nothing but mirror balls tells of: is what was found there the lamp?
Where the photos show the board's paper its light decides. Without it, a reflection of something else passes for the
lamp unless the balls contradict one another, or the white patch shows another falloff than that lamp's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from photogonio.calib.adjust.lamps import expected_pixel
from photogonio.calib.adjust.state import Settled, State
from photogonio.calib.detect.observation import Observation, hand_over
from photogonio.calib.diagnose.base import Departure, Stage
from photogonio.calib.diagnose.photos.glossy_print import shining
from photogonio.calib.radiometry.patch import UNEVEN
from photogonio.calib.radiometry.readings import StrengthReadings
from photogonio.calib.shading.initial import Shares, square_ratios, white_level
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import MANIFEST

_FARTHEST = 1.5  # pixels by which highlights of one lamp may miss
_WILD = 6.0  # and in their standard errors
_WASHED = 1.5  # times the other photos' black over white, and
_WASHED_BY = 0.02  # so much more, is black with white in it
_UNLIT = 0.03  # of the other photos' light: less than lamps at other places leave
_DARKEST = 0.1  # share of a photo's squares that show a glossy print's lamp least
_SQUARES = 6  # evenly lit ones, that tell how sharp the print is
_MOST = 0.5  # share of the patches that must agree with their lamps, for the others to tell something


class UnusablePhotos(Departure):
    """Photos without a lamp, or whose print is not sharp, are left out."""

    stage = Stage.PHOTO
    entries = (
        Entry("dark-photo", "No light is on the board in a photo; it is left out.", "Nothing."),
        Entry(
            "unsharp-print",
            "Black print is much brighter beside white in a photo than in the others: out of focus, "
            "shaken, light on the "
            "lens, or the lamp was off. It is left out.",
            "Nothing, if there are enough others.",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        shares, whites = {}, {}
        for name, reading in state.papers():
            shares[name], whites[name] = square_ratios(reading), white_level(reading)
        unsharp = washed_out(shares, shining(shares), whites)
        why = {
            one.view.name: "the photo is dark: no light on the board"
            for one in state.observations
            if one.dark
        }
        if not unsharp and not why:
            return []
        code = "dark-photo" if why else "unsharp-print"
        return [
            Diagnosis(code, amount=len(why | unsharp), views=tuple(why | unsharp), grounds=(why, unsharp))
        ]

    def remedy(self, state: State, found: Sequence[Diagnosis]) -> State:
        dark, unsharp = found[0].grounds
        observations, kept = state.copied(), []
        for observation in observations:
            name = observation.view.name
            if name in dark:
                state.remarks.leave_out(name, dark[name], "dark-photo")
            elif name in unsharp:
                state.remarks.leave_out(name, unsharp[name], "unsharp-print")
            else:
                kept.append(observation)
        if all(one.probe for one in kept):
            why = "no sample photo can be used: " + state.remarks.reasons()
            raise InputError(state.photoset.folder / MANIFEST, why)
        hand_over(observations, kept)
        return state.keeping(kept)


def washed_out(
    shares: Mapping[str, Shares], shining: Sequence[str] = (), whites: Mapping[str, float] | None = None
) -> dict[str, str]:
    """Photos whose black print is much brighter beside its white than the others', by the ``shares`` of their squares,
    with the reason.

    Both are lit alike, so that no lamp does that: white has spread over black. Of a print that shines the darkest
    squares are compared, which show the lamp least; and photos in which it is ``shining`` are not judged: white that
    spreads brightens all squares alike. ``whites``, the radiance of each photo's white, tells a lamp that was off.
    """
    part = _DARKEST if shining else 0.5
    ratios = {name: float(np.quantile(r, part)) for name, (r, *_) in shares.items() if len(r) >= _SQUARES}
    usual = float(np.median(list(ratios.values()))) if ratios else 0.0
    lit = float(np.median([whites[name] for name in ratios])) if whites and ratios else 0.0
    return {
        name: _washed(ratio, usual, whites[name] / lit if whites and lit > 0 else 1.0)
        for name, ratio in ratios.items()
        if ratio > _WASHED * usual + _WASHED_BY and name not in shining
    }


def _washed(ratio: float, usual: float, lit: float) -> str:
    """Why black is ``ratio`` of a white that is ``lit`` times as bright as in photos where it is ``usual``."""
    what = f"black is {ratio:.2f} of white, in the other photos {usual:.2f}"
    if lit < _UNLIT:
        return f"its paper has {lit:.1%} of the light of the other photos', and {what}: was the lamp off?"
    return (
        f"its print is not sharp: {what}; out of focus, shaken, with light on the lens, or with the lamp shining on"
        " glossy paper"
    )


def contradiction(settled: Settled, members: Sequence[Observation]) -> str | None:
    """Why the highlights of one lamp (its views are ``members``) are not believed; None if they may be."""
    name = members[0].light
    lamp = settled.lamps[name]
    if lamp.fixed or lamp.source not in ("mirror balls", "probe"):
        return None
    if any(s.view.name in settled.shading for s in members):
        return None
    misses = [
        (
            float(np.hypot(*(h.pixel - expected_pixel(settled.camera, s, lamp, settled.values, h.ball)))),
            h.sigma,
        )
        for s in members
        for h in s.highlights
    ]
    worst, sigma = max(misses, default=(0.0, 1.0))
    if worst > max(_FARTHEST, _WILD * settled.highlight_scale * sigma):
        return f"the mirror balls contradict one another about its lamp, by {worst:.1f} px"
    return None


def denied_by_patch(
    settled: Settled, observations: Sequence[Observation], readings: dict[str, StrengthReadings]
) -> list[str]:
    """Views whose white patch shows a falloff that is not their lamp's, where most patches agree with theirs."""
    mirrored = [
        s.view.name
        for s in observations
        if s.view.name in readings
        and s.view.name not in settled.shading
        and not settled.lamps[s.light].fixed
        and settled.lamps[s.light].source == "mirror balls"
    ]
    uneven = [n for n in mirrored if readings[n].patch.problem == UNEVEN]
    agreeing = [n for n in mirrored if readings[n].patch.value is not None]
    return uneven if len(agreeing) >= max(2, _MOST * len(mirrored)) else []
