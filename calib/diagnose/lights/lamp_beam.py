"""Lamps that do not shine alike in all directions: a one-sided panel, a spot, a shade. The board shows it: it darkens
away from where they point faster than distance and angle explain, while shadows tell how far they stand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from photogonio.calib.adjust.state import State
from photogonio.calib.adjust.terms import BEAM_HELD
from photogonio.calib.diagnose.base import LightDeparture
from photogonio.calib.diagnose.lights.vignetting import present_falloff
from photogonio.capture.diagnosis import Diagnosis, Entry

_TOLD = 0.2  # power of the cosine that changes a patch's light by half a per cent, and
_SURE = 5.0  # standard errors, at which a beam is told
# power of the cosine of a spot ten degrees wide: what of lamps far away is told is a guess beyond
NARROWEST = 200.0


class LampBeam(LightDeparture):
    """The power of the cosine beside their axis with which all lamps' light falls off, as the photos alone tell it."""

    code = "lamp-beam"
    entries = (
        Entry(
            "lamp-beam",
            "The lamps do not shine alike in all directions: a panel, a spot or a shade. Allowed for as a "
            "cosine's power "
            "beside the way to the sample.",
            "Turn such a lamp toward the sample in every photo.",
            least=0.2,
            sigmas=5.0,
            source="the power; 0.2 of it changes a patch's light by half a per cent",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        """From where it settled while it was expected about 0; nothing where no shading tells."""
        settled = state.settled
        if not settled.shading:
            return []
        found, variance = settled.values["lamp"][2], settled.covariance["lamp"][2, 2]
        told = 1 / variance - BEAM_HELD**-2.0
        if told <= 0:
            return []
        return [Diagnosis(self.code, "", float(found / variance / told), float(told**-0.5), _TOLD, _SURE)]

    def remedy(self, state: State, found: Sequence[Diagnosis]) -> State:
        power = float(np.clip(found[0].amount, -NARROWEST, NARROWEST))
        return replace(state, narrow=power, falloff=present_falloff(state))

    def as_settled(self, state: State, found: Diagnosis) -> Diagnosis:
        if not found.allowed:
            return found
        values, covariance = state.settled.values["lamp"], state.settled.covariance["lamp"]
        return replace(found, amount=float(values[2]), error=float(np.sqrt(covariance[2, 2])))

    def numbers(self, found: Diagnosis) -> dict[str, object]:
        return {"lamp_beam": {"power": found.amount, "error": found.error}}

    def message(self, found: Diagnosis, *, allowed: bool) -> str:
        if not allowed:
            return ""
        return (
            "the lamps do not shine alike in all directions: beside the way to the sample their light falls off as the "
            f"cosine to the power {found.amount:.2f}, allowed for where patch and paper tell how strong they are"
        )
