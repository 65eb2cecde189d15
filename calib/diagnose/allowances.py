"""What lamps and lens do besides what is taken for granted of them, allowed for where the photos tell it surely."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from photogonio.calib.adjust.alternate import Settled
from photogonio.calib.detect.highlights import Highlight
from photogonio.calib.detect.observation import Observation, start_over
from photogonio.calib.diagnose.lamp_beam import Beam, beam_of
from photogonio.calib.diagnose.vignetting import falloff_of, fits_closer, sureness, told
from photogonio.calib.setup import Falloff

NO_FALLOFF = (0.0, 0.0)
Settle = Callable[[float, tuple[float, float]], Settled]


def settle_allowing(
    settle: Settle,
    settled: Settled,
    observations: Sequence[Observation],
    seen: Sequence[list[Highlight]],
    *,
    lens: bool,
) -> tuple[Settled, Beam | None, Falloff | None]:
    """Everything ``settled`` again, with narrow lamps and a lens that darkens its pictures where they are told, the
    surer first: either looks a little like the other. ``settle`` does it from the start, with the highlights ``seen``
    at first, for a beam and a falloff; ``lens``: whether the second may be."""

    def again(narrow: float, falloff: tuple[float, float]) -> Settled:
        start_over(observations, seen)
        return settle(narrow, falloff)

    beam, falloff = beam_of(settled), falloff_of(settled) if lens else None
    if told(falloff) and not (_told(beam) and beam.sureness > sureness(falloff)):
        settled, falloff = _with_lens(again, settled, falloff, 0.0)
        beam = beam_of(settled)
    if _told(beam):
        settled = again(beam.narrow, _terms(falloff))
        found = falloff_of(settled) if lens else None
        if found is not None and not found.allowed and told(found):
            settled, found = _with_lens(again, settled, found, beam.narrow)
        falloff = found
    return settled, beam, falloff


def _with_lens(
    again: Settle, settled: Settled, falloff: Falloff, narrow: float
) -> tuple[Settled, Falloff | None]:
    """With the lens's falloff, if that explains the paper better than without."""
    with_it = again(narrow, tuple(falloff.terms.tolist()))
    if fits_closer(with_it, settled):
        return with_it, falloff_of(with_it)
    return again(narrow, NO_FALLOFF), falloff


def _told(beam: Beam | None) -> bool:
    return beam is not None and beam.told


def _terms(falloff: Falloff | None) -> tuple[float, float]:
    return tuple(falloff.terms.tolist()) if falloff is not None and falloff.allowed else NO_FALLOFF
