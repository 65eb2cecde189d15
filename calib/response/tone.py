"""The tone curve of a set that names none, as its print tells it, and what its error does to the result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from photogonio.calib.response.curve import ANCHOR
from photogonio.calib.response.fit import FittedResponse, fit_response
from photogonio.calib.response.paper_codes import CodeReader, PaperCodes, middle_white, paper_codes
from photogonio.calib.setup import PrintTone, Setup
from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.photoset import PhotoSet

_PHOTOS = 2  # that tell a curve, at least
_SIZE = 511  # of its table: codes of 8 bits are among them
_DOUBTED = 103  # codes at which its errors are kept
_PLACES = 1.5  # times that lamps' places are less sure than squares, each by itself, let them seem
_UNKNOWN = 0.05  # relative error where the sample's codes cannot be read

_UNSURE = 0.02  # relative: of that, what is told
# of codes that hang on what lies round about: what white print misses, and its slope by that, at least
_MISFIT, _LOCAL = 0.006, 0.005


def tone_of_print(photoset: PhotoSet, setup: Setup, read: CodeReader) -> PrintTone:
    """The curve by a set that was calibrated with another, which places cameras and lamps nearly enough.

    Raises:
        ValueError: its photos show too little print. The message says so.
    """
    told = paper_codes(photoset, setup, read)
    if len(told) < _PHOTOS:
        raise ValueError(
            f"{len(told)} photos show enough white and black print under a near lamp, {_PHOTOS} or more are needed"
        )
    photos, samples = zip(*told, strict=True)
    fitted = fit_response(photos)
    codes = np.linspace(0.0, 1.0, _SIZE)
    anchor = np.full(_SIZE, ANCHOR)
    curves = fitted.curves
    return PrintTone(
        table=curves.table(_SIZE),
        error=np.column_stack([curves.error_between(codes, anchor, c) for c in range(curves.channels)]),
        seen=np.array(curves.seen),
        ink=fitted.ink,
        misfit=fitted.misfit,
        photos=len(photos),
        scale_error=_scale_error(fitted, photos, samples),
        surround=fitted.surround,
        lamps=tuple(fitted.places),
        places=np.array(list(fitted.places.values())),
        covariance=_PLACES**2 * fitted.covariance,
        doubts=curves.doubts(np.linspace(0.0, 1.0, _DOUBTED)),
    )


def _scale_error(
    fitted: FittedResponse, photos: Sequence[PaperCodes], samples: Sequence[np.ndarray]
) -> float:
    """Relative, of what the sample sends over what white paper does, all photos and channels alike: their errors are
    the curve's, and go together."""
    white = np.array(middle_white(photos))
    seen = np.array(samples)
    known = np.isfinite(seen)
    if not known.any():
        return _UNKNOWN
    squares = [
        fitted.curves.error_between(seen[known[:, c], c], white[known[:, c], c], c) ** 2
        for c in range(seen.shape[1])
    ]
    return float(np.sqrt(np.mean(np.concatenate(squares))))


def with_tone(setup: Setup, tone: PrintTone, exposures: Mapping[str, float] | None = None) -> Setup:
    """A setup that was found with it: what it leaves unsure all strengths share. ``exposures`` of its views, by name,
    are light over radiance: they tell at which code a radiance was read."""
    tone = replace(tone, exposures=dict(exposures or {}))
    found = tuple(one for one in (tone_doubt(tone), tone_local(tone)) if one is not None)
    error = float(np.hypot(setup.scale_error, tone.scale_error))
    return replace(setup, tone=tone, scale_error=error, diagnoses=setup.diagnoses + found)


def tone_doubt(tone: PrintTone) -> Diagnosis | None:
    """What there is to say where it leaves much unsure."""
    if tone.scale_error <= _UNSURE:
        return None
    message = (
        f"the tone curve that print and paper tell leaves the sample's light over the paper's unsure by "
        f"{tone.scale_error:.1%}, which the stated errors hold; RAW photos or brackets would not"
    )
    return Diagnosis("tone-curve-unsure", message, tone.scale_error, least=_UNSURE, allowed=True)


def tone_local(tone: PrintTone) -> Diagnosis | None:
    """What there is to say where codes hang on what lies round about."""
    if tone.misfit <= _MISFIT or tone.surround >= -_LOCAL:
        return None
    message = (
        f"the photos were toned locally: white paper misses its lamp's light by {tone.misfit:.1%}, and is the dimmer "
        f"the brighter it is round about (to the power {tone.surround:.2f}); no one curve undoes that, and the result "
        "may be off by more than is stated; take RAW photos, or turn HDR and scene optimisation off"
    )
    return Diagnosis("tone-not-global", message, -tone.surround, least=_LOCAL)


def tone_note(tone: PrintTone) -> str:
    """What was found, in words."""
    return (
        f"tone curve recovered from print and paper of {tone.photos} photos: white paper lies within "
        f"{tone.misfit:.2%} of its lamp's light, ink sends on {float(tone.ink.mean()):.1%} of it; the sample "
        f"against the paper is known to {tone.scale_error:.1%} by it"
    )
