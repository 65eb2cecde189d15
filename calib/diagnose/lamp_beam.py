"""Lamps that do not shine alike in all directions: a one-sided panel, a spot, a shade. The board shows it: it darkens
away from where they point faster than distance and angle explain, while shadows tell how far they stand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from photogonio.calib.adjust.alternate import Settled
from photogonio.calib.adjust.terms import BEAM_HELD
from photogonio.calib.remarks import Remarks

_TOLD = 0.2  # power of the cosine that changes a patch's light by half a per cent, and
_SURE = 5.0  # standard errors, at which a beam is told


@dataclass(frozen=True, slots=True)
class Beam:
    """The power of the cosine beside their axis with which all lamps' light falls off, as the photos alone tell it."""

    narrow: float
    error: float

    @property
    def told(self) -> bool:
        """Whether it is so narrow, and so surely, that it must be allowed for."""
        return self.narrow > max(_TOLD, _SURE * self.error)

    @property
    def sureness(self) -> float:
        """Standard errors by which it differs from none."""
        return self.narrow / self.error


def beam_of(settled: Settled) -> Beam | None:
    """From where it settled while it was expected about 0; None where no shading tells."""
    if not settled.shading:
        return None
    found, variance = settled.values["lamp"][2], settled.covariance["lamp"][2, 2]
    told = 1 / variance - BEAM_HELD**-2.0
    return Beam(float(found / variance / told), float(told**-0.5)) if told > 0 else None


def note_beam(settled: Settled, beam: Beam | None, remarks: Remarks) -> None:
    """What was found, and a warning if the lamps' light was taken as narrow."""
    if beam is None:
        return
    if not beam.told:
        remarks.residuals["lamp_beam"] = {"power": beam.narrow, "error": beam.error}
        return
    power, error = settled.values["lamp"][2], np.sqrt(settled.covariance["lamp"][2, 2])
    remarks.residuals["lamp_beam"] = {"power": float(power), "error": float(error)}
    remarks.tell(
        "lamp-beam",
        f"the lamps do not shine alike in all directions: beside the way to the sample their light falls off as the "
        f"cosine to the power {power:.2f}, allowed for where patch and paper tell how strong they are",
        amount=float(power),
        error=float(error),
        least=_TOLD,
        sigmas=_SURE,
        allowed=True,
    )
