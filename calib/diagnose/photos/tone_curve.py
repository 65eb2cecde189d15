"""Pictures whose codes stand for light otherwise than they were read: the print tells it by itself.

Ink sends on a few hundredths of what paper does. Coded as sRGB and read as if in proportion to light, it seems to send
on a quarter; in proportion and read as sRGB, a hundredth or so. And white paper grows with the light on it by a power
that is 1 if codes are read rightly, about 0.45 and 2.2 if not. That shows where mirror balls or the manifest tell the
lamp's place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from photogonio.calib.adjust.lamps import sight_rays
from photogonio.calib.adjust.state import State
from photogonio.calib.detect.mirror_rays import meet
from photogonio.calib.detect.observation import Observation, light_entry
from photogonio.calib.detect.paper import PaperSamples, paper_places, sample_paper
from photogonio.calib.detect.photo_reader import Reader
from photogonio.calib.diagnose.base import Departure, Stage
from photogonio.calib.diagnose.photos.veiling_glare import enough_print, evenly_lit
from photogonio.calib.geometry.board import board_size
from photogonio.calib.geometry.camera import Camera
from photogonio.capture import robust
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.photoset import PhotoSet

# powers by which white grows with light, and shares of black in white, of pictures read with no curve though they have
# one, and with one though they have none; the narrower shares where nothing tells the power
_NO_CURVE_READ, _CURVE_READ = (0.25, 0.85), (1.5, 5.0)  # mirror balls tell distances, and so powers, poorly
_COMMON_INK, _PALE, _DEEP = (0.14, 0.03), (0.17, 0.45), 0.018
_PHOTOS = 3  # that tell a power together, and
_SURE = 2.0  # its standard errors that it must lie off 1: the ink has to say the same
_SPREAD = 0.06  # standard deviation of the logarithm of light over the paper that tells a power
_SAMPLES = 300
_ROUNDS, _WILD = 30, 3.0
# samples of a small print along the board, pixels between white or black and its edges, radii of mirror balls away, and
# white samples beside a black one
_ACROSS, _CLOSE, _APART, _BESIDE, _LOOKED_AT = 180, (1.0, 2.0), 3.0, 8, 6
_CLEAR = 0.3  # of the paper's clearest part: a power that fits less of it is none


@dataclass(frozen=True, slots=True)
class ToneDoubt:
    """Evidence that codes were read wrongly."""

    coded: bool  # they have a curve and were read as if in proportion to light; else the other way round
    black: float  # share of black print in white
    power: float  # by which white grows with light; NaN where that is not known
    error: float  # standard error of it

    def to_dict(self) -> dict[str, object]:
        """Plain JSON values; null where nothing is known."""
        numbers = {"black_share": self.black, "power": self.power, "power_error": self.error}
        known = {name: value if np.isfinite(value) else None for name, value in numbers.items()}
        return {"looks": "coded" if self.coded else "linear", **known}


def tone_doubt(
    photoset: PhotoSet, camera: Camera, observations: Sequence[Observation], reader: Reader | None = None
) -> ToneDoubt | None:
    """What the print says against the way in which codes were read; None if nothing, or nothing surely. Where it is too
    small in the photos to be read clear of all edges, ``reader`` shows it close to them."""
    papers = [s for s in observations if s.has_paper and not s.dark]
    told = [_told_clear_of_edges(photoset, camera, one) for one in papers]  # one paper in memory at a time
    if reader is not None and not any(np.isfinite(share) for share, _ in told):
        some = papers[:: max(1, len(papers) // _LOOKED_AT)]
        told = [_told_close_to_edges(photoset, camera, one, reader) for one in some]
    shares = [share for share, _ in told if np.isfinite(share)]
    powers = [power for _, power in told if power is not None]
    return judged(float(np.median(shares)) if shares else float("nan"), np.array(powers))


def _told_clear_of_edges(photoset: PhotoSet, camera: Camera, one: Observation) -> tuple[float, float | None]:
    """Share of black in white, NaN where no black is seen, and the power by which white grows with light."""
    if (reading := one.reading) is None:
        return float("nan"), None
    power = _power(photoset, camera, one, reading.samples, reading.level)
    return black_share(reading.samples), power


def _told_close_to_edges(
    photoset: PhotoSet, camera: Camera, one: Observation, reader: Reader
) -> tuple[float, float | None]:
    """The same of a small print."""
    samples = close_print(photoset, camera, one, reader)
    if samples is None:
        return float("nan"), None
    power = _power(photoset, camera, one, samples, samples.value.mean(1))
    return share_of_brightest(samples), power


def _power(
    photoset: PhotoSet, camera: Camera, one: Observation, samples: PaperSamples, level: np.ndarray
) -> float | None:
    place = lamp_place(photoset, camera, one)
    white = samples.white
    return None if place is None else power_of_light(samples.points[white], level[white], place)


def black_share(samples: PaperSamples) -> float:
    """Radiance of black print over that of the white beside it, the median; NaN where they cannot be compared."""
    if not enough_print(samples):
        return float("nan")
    dark, beside, _ = evenly_lit(samples)
    lit = beside.mean(1) > 0
    if not lit.any():
        return float("nan")
    return float(np.median(samples.value[dark][lit].mean(1) / beside[lit].mean(1)))


def close_print(photoset: PhotoSet, camera: Camera, one: Observation, reader: Reader) -> PaperSamples | None:
    """White and black of a small print, however close to edges; None if it shows too little. Blurred, white is a tenth
    darker at the most."""
    if photoset.board is None:
        return None
    step = float(board_size(photoset.board).max()) / _ACROSS
    places = paper_places(photoset, camera, one.pose, step=step, apart=_APART, clear_of_edges=_CLOSE)
    samples = None if places is None else sample_paper(places, partial(reader.near, one.view))
    if samples is None or samples.white.sum() < _BESIDE or samples.white.all():
        return None
    return samples


def share_of_brightest(samples: PaperSamples) -> float:
    """Radiance of black print over that of the brightest white beside it, the median."""
    lit, dark = samples.keep(samples.white), samples.keep(~samples.white)
    _, near = cKDTree(lit.points[:, :2]).query(dark.points[:, :2], k=_BESIDE)
    beside = lit.value.mean(1)[near].max(1)
    return float(np.median(dark.value.mean(1) / np.maximum(beside, np.finfo(float).tiny)))


def judged(black: float, powers: np.ndarray) -> ToneDoubt | None:
    """The doubt by a share of black in white, NaN where no black is seen, and the powers (k,) of photos."""
    if not np.isfinite(black):
        return None
    if len(powers) < _PHOTOS:
        if not (_PALE[0] < black < _PALE[1] or black < _DEEP):
            return None
        return ToneDoubt(black > _DEEP, black, float("nan"), float("nan"))
    power = float(np.median(powers))
    error = float(robust.median_error(robust.deviation(powers - power), len(powers)))
    if abs(power - 1.0) < _SURE * error:
        return None
    coded = _NO_CURVE_READ[0] < power < _NO_CURVE_READ[1] and black > _COMMON_INK[0]
    decoded = _CURVE_READ[0] < power < _CURVE_READ[1] and black < _COMMON_INK[1]
    return ToneDoubt(coded, black, power, error) if coded or decoded else None


def lamp_place(photoset: PhotoSet, camera: Camera, observation: Observation) -> np.ndarray | None:
    """Where a photo's lamp is (3,), by the manifest or by two mirror balls or more, whatever its paper says."""
    entry = light_entry(photoset, observation.view)
    if entry is not None and entry.position is not None:
        place = np.asarray(entry.position, float)
        return observation.pose.inverse().apply(place) if entry.attached_to == "camera" else place
    if entry is not None and (entry.direction is not None or entry.kind == "directional"):
        return None
    rays = sight_rays(photoset, camera, observation)
    if len({ray.ball for ray in rays}) < 2:
        return None
    span = max(float(np.linalg.norm(ball.center)) for ball in photoset.mirror_balls) + 1.0
    met = meet(rays, None, span)
    return met.place if met.kind == "point" else None


def power_of_light(points: np.ndarray, level: np.ndarray, place: np.ndarray) -> float | None:
    """By which power the radiance ``level`` (n,) of white paper at ``points`` (n, 3) grows with the light of a lamp at
    ``place``; None where it is lit too evenly. What lies in shadows has no say."""
    offset = place - points
    light = offset[:, 2] / np.linalg.norm(offset, axis=1) ** 3
    good = (light > 0) & (level > 0)
    if good.sum() < _SAMPLES:
        return None
    x, y = np.log(light[good]), np.log(level[good])
    design = np.column_stack([np.ones(len(x)), x - x.mean()])
    weight, keep = np.ones(len(x)), np.ones(len(x), bool)
    for turn in range(_ROUNDS):  # least absolute misses, then least squares of what lies near
        root = np.sqrt(weight)[:, None]
        found = np.linalg.lstsq(design * root, y * root[:, 0], rcond=None)[0]
        miss = np.abs(y - design @ found)
        middle = float(robust.deviation(miss)) + 1e-12
        keep = miss < _WILD * middle
        weight = keep.astype(float) if turn >= _ROUNDS // 2 else 1.0 / np.maximum(miss, 0.1 * middle)
    if x[keep].std() < _SPREAD or keep.mean() < _CLEAR:
        return None
    return float(found[1])


def tone_warning(photoset: PhotoSet, doubt: ToneDoubt) -> str:
    """The contradiction, in words."""
    said = photoset.radiometry.encoding
    read = 'as the files say, or by their bits (encoding = "auto")' if said == "auto" else f'as "{said}"'
    shown = [f"black is {doubt.black:.2g} of white"] if np.isfinite(doubt.black) else []
    if np.isfinite(doubt.power):
        shown.append(
            f"white grows with its light by the power {doubt.power:.2f} (+- {doubt.error:.2f}), which should be 1"
        )
    so = (
        'their codes have a curve: set encoding = "srgb"'
        if doubt.coded
        else 'their codes are in proportion to light: set encoding = "linear"'
    )
    other = "" if np.isfinite(doubt.power) else " (or the print's ink is no ordinary black)"
    return (
        f"[radiometry] encoding: the print contradicts the way in which the photos are read, {read}: "
        f"{' and '.join(shown)}. So it is if {so}{other}"
    )


class WrongToneCurve(Departure):
    """Pictures whose codes were read by another curve than they have."""

    stage = Stage.PHOTO
    entries = (
        Entry(
            "print-contradicts-encoding",
            "Black print, as a share of the white, and how white grows with the light on it, are those of pictures "
            "whose codes were read by another curve than they have.",
            "Set `[radiometry] encoding` as it is said, and see what wrote the files; if the ink is no ordinary black, "
            "and nothing else is told, nothing.",
            least=0.15,
            sigmas=2.0,
            source="by which the power of growth differs from 1; drawn sets with balls that stand beside their places",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        doubt = tone_doubt(state.photoset, state.camera, state.observations, state.reader)
        if doubt is None:
            return []
        message = tone_warning(state.photoset, doubt)
        return [Diagnosis("print-contradicts-encoding", message, detail=doubt.to_dict())]
