"""Pictures whose codes stand for light otherwise than they were read: the print tells it by itself.

Ink sends on a few hundredths of what paper does, whatever the light. Coded as sRGB and read as if in proportion to
light, it seems to send on a quarter; in proportion and read as sRGB, a hundredth or so; coded as sRGB and read as gamma
2.2, less of dim light than of bright (:mod:`.tone_levels`). And white paper grows with the light on it by a power that
is 1 if codes are read rightly, about 0.45 and 2.2 if not. That shows where mirror balls or the manifest tell the lamp's
place (:mod:`.tone_print`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from photogonio.calib.adjust.state import State
from photogonio.calib.detect.observation import Observation
from photogonio.calib.detect.photo_reader import Reader
from photogonio.calib.diagnose.base import Departure, Stage
from photogonio.calib.diagnose.photos.tone_levels import (
    INK,
    SURE,
    Power,
    PrintLevels,
    ToneVerdict,
    read_curve,
    told_by_levels,
)
from photogonio.calib.diagnose.photos.tone_print import (
    Pairs,
    black_and_brightest,
    black_and_white,
    black_share,
    close_print,
    seen_power,
)
from photogonio.calib.geometry.camera import Camera
from photogonio.capture import robust
from photogonio.capture.containers.tone import LINEAR, SRGB, Curve
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.photoset import PhotoSet

# powers by which white grows with light, and shares of black in white, of pictures read with no curve though they have
# one, and with one though they have none; the narrower shares where nothing tells the power
_NO_CURVE_READ, _CURVE_READ = (0.25, 0.85), (1.5, 5.0)  # mirror balls tell distances, and so powers, poorly
_COMMON_INK, _PALE, _DEEP = (0.14, 0.03), (0.17, 0.45), 0.018
_PHOTOS = 3  # that tell a power together, and
_SURE = 2.0  # its standard errors that it must lie off 1: the ink has to say the same
_LOOKED_AT = 6  # photos of a small print


@dataclass(frozen=True, slots=True)
class ToneDoubt:
    """Evidence that codes were read wrongly."""

    curve: Curve  # that they seem to have
    read: Curve  # by which they were read
    black: float  # share of black print in white
    power: float = float("nan")  # by which white grows with light; NaN where that is not known
    error: float = float("nan")  # standard error of it
    steady: bool = True  # whether black is as large a share of dim white as of bright

    @property
    def coded(self) -> bool:
        """They have a curve and were read as if in proportion to light."""
        return self.read == LINEAR

    def to_dict(self) -> dict[str, object]:
        """Plain JSON values; null where nothing is known."""
        numbers = {"black_share": self.black, "power": self.power, "power_error": self.error}
        known = {name: value if np.isfinite(value) else None for name, value in numbers.items()}
        looks = "linear" if self.curve == LINEAR else "coded"
        return {"looks": looks, "curve": self.curve.name, "read_as": self.read.name, **known}


@dataclass(frozen=True, slots=True)
class _Told:
    """What one photo's print tells."""

    share: float  # of black in white, NaN where no black is seen
    power: float | None  # by which white grows with light
    levels: PrintLevels | None


def tone_doubt(
    photoset: PhotoSet, camera: Camera, observations: Sequence[Observation], reader: Reader | None = None
) -> ToneDoubt | None:
    """What the print says against the way in which codes were read; None if nothing, or nothing surely. Where it is too
    small in the photos to be read clear of all edges, ``reader`` shows it close to them."""
    papers = [s for s in observations if s.has_paper and not s.dark]
    told = [_told_clear_of_edges(photoset, camera, one, reader) for one in papers]  # one in memory at a time
    if reader is not None and sum(np.isfinite(one.share) for one in told) < min(_PHOTOS, len(papers)):
        some = papers[:: max(1, len(papers) // _LOOKED_AT)]
        told = [_told_close_to_edges(photoset, camera, one, reader) for one in some]
    shares = [one.share for one in told if np.isfinite(one.share)]
    powers = np.array([one.power for one in told if one.power is not None])
    black = float(np.median(shares)) if shares else float("nan")
    levels = [one.levels for one in told if one.levels is not None]
    verdict = verdict_of(levels, power_of(powers))
    if verdict is not None and believed(verdict, black):
        return weighed(verdict, black, power_of(powers))
    doubt = judged(black, powers)
    return doubt if doubt is None or not levels else replace(doubt, read=_most_read(levels))


def verdict_of(levels: Sequence[PrintLevels], power: Power | None) -> ToneVerdict | None:
    """By how steady a share of white black print is in most photos that were read by one curve; None of too few."""
    most = _most_read(levels)
    alike = [one for one in levels if read_curve(one.encoding) == most]
    return told_by_levels(alike, power) if len(alike) >= _PHOTOS else None


def _most_read(levels: Sequence[PrintLevels]) -> Curve:
    """The curve by which most of them were read."""
    curves = [read_curve(one.encoding) for one in levels]
    return max(curves, key=curves.count, default=LINEAR)


def believed(verdict: ToneVerdict, black: float) -> bool:
    """Whether a verdict contradicts the way in which codes were read: not by an odd ink alone, where ``black`` as it
    is seen is none. Under lamps far away a veil may pass for the ink."""
    return verdict.contradicted and (verdict.unsteady or black < _DEEP or black > _COMMON_INK[0])


def weighed(verdict: ToneVerdict, black: float, power: Power | None) -> ToneDoubt:
    """The doubt that a verdict is."""
    value, error = (np.nan, np.nan) if power is None else (power.value, power.error)
    return ToneDoubt(
        verdict.curve, verdict.read_curve, black, float(value), float(error), not verdict.unsteady
    )


def power_of(powers: np.ndarray) -> Power | None:
    """What photos (k,) say of it together; None of too few."""
    if len(powers) < _PHOTOS:
        return None
    middle = float(np.median(powers))
    return Power(middle, float(robust.median_error(robust.deviation(powers - middle), len(powers))))


def _told_clear_of_edges(
    photoset: PhotoSet, camera: Camera, one: Observation, reader: Reader | None
) -> _Told:
    """Of black print and white that lie clear of one another."""
    if (reading := one.reading) is None:
        return _Told(float("nan"), None, None)
    power = seen_power(photoset, camera, one, reading.samples, reading.level)
    pairs = black_and_white(reading.samples)
    if pairs is None:
        return _Told(float("nan"), power, None)
    return _Told(black_share(*pairs), power, _levels(one, reader, pairs))


def _told_close_to_edges(photoset: PhotoSet, camera: Camera, one: Observation, reader: Reader) -> _Told:
    """The same of a small print."""
    samples = close_print(photoset, camera, one, reader)
    if samples is None:
        return _Told(float("nan"), None, None)
    power = seen_power(photoset, camera, one, samples, samples.value.mean(1))
    pairs = black_and_brightest(samples)
    return _Told(black_share(*pairs), power, _levels(one, reader, pairs))


def _levels(one: Observation, reader: Reader | None, pairs: Pairs) -> PrintLevels | None:
    """The same as signals, where it is known how codes became them."""
    known = None if reader is None or reader.codes is None else reader.codes(one.view)
    if known is None:
        return None
    black, white = (level * known.exposure for level in pairs)
    return PrintLevels(white, black, known.encoding, known.steps)


def judged(black: float, powers: np.ndarray) -> ToneDoubt | None:
    """The doubt by a share of black in white, NaN where no black is seen, and the powers (k,) of photos."""
    if not np.isfinite(black):
        return None
    if len(powers) < _PHOTOS:
        if not (_PALE[0] < black < _PALE[1] or black < _DEEP):
            return None
        return _doubted(black > _DEEP, black)
    power = float(np.median(powers))
    error = float(robust.median_error(robust.deviation(powers - power), len(powers)))
    if abs(power - 1.0) < _SURE * error:
        return None
    coded = _NO_CURVE_READ[0] < power < _NO_CURVE_READ[1] and black > _COMMON_INK[0]
    decoded = _CURVE_READ[0] < power < _CURVE_READ[1] and black < _COMMON_INK[1]
    return _doubted(coded, black, power, error) if coded or decoded else None


def _doubted(
    coded: bool, black: float, power: float = float("nan"), error: float = float("nan")
) -> ToneDoubt:
    """Read without the curve that they have, or with one that they have not."""
    return ToneDoubt(*((SRGB, LINEAR) if coded else (LINEAR, SRGB)), black, power, error)


def tone_warning(photoset: PhotoSet, doubt: ToneDoubt) -> str:
    """The contradiction, in words."""
    said = photoset.radiometry.encoding
    if doubt.curve == doubt.read or said == doubt.curve.name:
        return _black_warning(photoset, doubt)
    read = 'as the files say, or by their bits (encoding = "auto")' if said == "auto" else f'as "{said}"'
    if said == "gamma":
        read += f" {doubt.read.numbers[0]:.3g}" if doubt.read.numbers else ""
    shown = [f"black is {doubt.black:.2g} of white"] if np.isfinite(doubt.black) else []
    if not doubt.steady:
        shown.append("it is not the same share of dim white as of bright, as ink is")
    if np.isfinite(doubt.power):
        shown.append(
            f"white grows with its light by the power {doubt.power:.2f} (+- {doubt.error:.2f}), which should be 1"
        )
    other = (
        "" if np.isfinite(doubt.power) or not doubt.steady else " (or the print's ink is no ordinary black)"
    )
    return (
        f"[radiometry] encoding: the print contradicts the way in which the photos are read, {read}: "
        f"{' and '.join(shown)}. So it is if {how_to_read(doubt.curve)}{other}"
    )


def _black_warning(photoset: PhotoSet, doubt: ToneDoubt) -> str:
    """The same where the curve by which codes were read is the one that they seem to have."""
    given = photoset.radiometry.black_level
    level = "the black level that the files say" if given is None else f"black_level = {given:g}"
    way = "high" if doubt.black < _COMMON_INK[1] else "low"
    other = " (or the print's ink is no ordinary black)" if doubt.black > 0 else ""
    return (
        f"[radiometry] black_level: the print contradicts how black the photos are read: black is {doubt.black:.2g} of "
        f"white, where ink is about {INK:g}. So it is if {level} is too {way}{other}"
    )


def how_to_read(curve: Curve) -> str:
    """What a manifest says of codes with this curve."""
    if curve == LINEAR:
        return 'their codes are in proportion to light: set encoding = "linear"'
    if curve == SRGB:
        return 'their codes have a curve: set encoding = "srgb"'
    if curve.kind == "gamma":
        power = curve.numbers[0]
        return f'their codes have a curve, a power: set encoding = "gamma" and gamma = {power:.3g}, or what it is'
    return f'their codes have the curve of {curve.name}: write them anew with a profile that says so, encoding = "auto"'


class WrongToneCurve(Departure):
    """Pictures whose codes were read by another curve than they have."""

    stage = Stage.PHOTO
    entries = (
        Entry(
            "print-contradicts-encoding",
            "Black print, as a share of the white, is not the same in dim light as in bright, or no ink's, or white "
            "does not grow with the light on it: codes were read by another curve than they have. Of linear, sRGB, "
            "BT.709, gamma 1.8, 2.2 and 2.4 the one that explains it is named; gammas look alike to black print, told "
            "apart by how white grows.",
            "Set `[radiometry] encoding` as it is said, and see what wrote the files; where `black_level` is named, "
            "correct that; if the ink is no ordinary black, and nothing else is told, nothing.",
            least=SURE,
            source="twice the logarithm of the odds for another curve; path-traced and drawn sets have 0",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        doubt = tone_doubt(state.photoset, state.camera, state.observations, state.reader)
        if doubt is None:
            return []
        message = tone_warning(state.photoset, doubt)
        return [Diagnosis("print-contradicts-encoding", message, detail=doubt.to_dict())]
