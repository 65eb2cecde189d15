"""Light that lies over a whole picture: veiling glare of the lens, or a black level that is not the sensor's own.

It adds as much to black print as to white, which no light on the board does: of that the black sends on a fixed share
of what the white beside it does. Where the board is lit unevenly, in shadows above all, black print against the white
next to it is a straight line, whose offset tells the veil. Evenly lit, as by a lamp far away, it is no line: the ink's
own reflectance and a veil look alike there, and only the darkest print says how much there can be at the most.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from photogonio.calib.adjust.state import State
from photogonio.calib.detect.paper import PaperSamples
from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.diagnose.base import Departure, Stage
from photogonio.calib.diagnose.photos.glossy_print import shining
from photogonio.calib.diagnose.photos.plane_kernel import planes_at
from photogonio.calib.parallel import abreast
from photogonio.calib.shading.correction import NO_CORRECTION, PhotometricCorrection
from photogonio.calib.shading.initial import square_ratios
from photogonio.capture import robust
from photogonio.capture.diagnosis import Diagnosis, Entry

_NEIGHBOURS = 24  # samples of white paper that tell how a black one is lit
_EVEN = 0.03  # relative scatter of theirs about a plane, beyond which an edge of a shadow runs between them
_RIDGE = 1e-6  # of the normal equations: places in a row tell no plane
_FEWEST, _MOST = 200, 1500  # samples of black print that tell a line, and about as many as are asked at first
_WELL = 6e-4  # of white paper: error to which some may tell it, else all are asked
_DIM = 0.1  # of the middle white: radiance at which black print is no longer told to the same share
_ROUNDS, _WILD = 6, 3.0
_ASTRAY = 3e-4  # of white paper: what path-traced sets without a veil show in single photos, 1e-4 to 4e-4
_UNEQUAL = (
    1e-3  # relative: by which black's share of white goes with the light there, 5e-4 to 1e-3 in the same sets
)
# relative: white that scatters less tells no line, for edges of shadows that pass as even light would make one; and
# of how it scatters, a share that is noise beyond which it tells none
_SCATTER, _NOISY = 0.02, 0.5
_LEAST = 1e-3  # of white paper: a veil that is told, if by
_SURE = 4.0  # standard errors
_FEW, _FAR = 4, 4.0  # photos whose scatter tells nothing, and standard errors at which one has no say
_CLEAN = 2e-3  # of white paper: a veil that a clean lens has unseen, where nothing tells more of it
_DARKEST, _ABOVE = 0.01, 2.0  # of black print, and standard deviations of its noise: no veil is brighter


@dataclass(frozen=True, slots=True)
class Veil:
    """What lies over one photo, radiance."""

    level: np.ndarray  # (c,)
    error: np.ndarray  # (c,) standard error
    white: np.ndarray  # (c,) of the middle white paper, as it was read
    told: bool = False  # whether there surely is any; else its level is 0
    most: float = np.inf  # share of the white that it cannot exceed: the darkest print's


def find_veils(readings: Iterable[tuple[str, PaperReading]], workers: int = 1) -> dict[str, Veil]:
    """By photo, as the photos together tell it; where they tell none, what there may be unseen is its error.

    It is as white as the paper, as far as can be told: compression mixes the colours of black print and white. Photos
    share it as a part of how bright their paper is; each has its own as far as they are surely apart. ``workers``
    photos are looked at side by side.
    """
    found = abreast(lambda one: (one[0], photo_veil(one[1].samples)), readings, workers)
    seen = {name: one for name, one in found if one is not None}
    telling = [one for one in seen.values() if np.isfinite(one.level).all()]
    most = min((one.most for one in seen.values()), default=np.inf)
    if not telling:
        return _unseen(seen, 0.0, np.inf, most)
    share = np.array([one.level / one.white for one in telling])
    error = np.hypot([one.error / one.white for one in telling], _ASTRAY)
    channels, each, _ = _in_common(share, error)
    weight = each**-2.0 / (each**-2.0).sum()
    spare = 1.0 - weight @ weight  # 0 for one channel, which tells nothing of what others would have
    colour = np.sqrt(weight @ (channels - weight @ channels) ** 2 * (1.0 / spare - 1.0)) if spare > 0 else 0.0
    # channels of one photo err together
    common, sure, apart = (
        float(one[0]) for one in _in_common((share @ weight)[:, None], (error @ weight)[:, None])
    )
    sure = float(np.hypot(sure, colour))
    if abs(common) < max(_LEAST, _SURE * sure) or common > most + _SURE * sure:
        return _unseen(seen, common, sure, most)
    return {name: _own(one, weight, common, apart, sure) for name, one in seen.items()}


def _unseen(seen: Mapping[str, Veil], common: float, sure: float, most: float) -> dict[str, Veil]:
    """What there may be of a veil that is not told, as an error: ``common`` to ``sure`` as far as lines tell it, at the
    ``most`` what the darkest print shows, and little before a clean lens. All are shares of white."""
    if not seen:
        return {}
    believed = 1 / (1 + (sure / _CLEAN) ** 2)
    doubt = min(float(np.hypot(believed * common, np.sqrt(believed) * sure if believed else _CLEAN)), most)
    if doubt < _LEAST:
        return {}
    return {name: replace(one, level=0.0 * one.white, error=doubt * one.white) for name, one in seen.items()}


def _own(seen: Veil, weight: np.ndarray, common: float, apart: float, sure: float) -> Veil:
    """A photo's veil: what all have in ``common``, to ``sure``, and its own as far as photos are ``apart``."""
    if not np.isfinite(seen.level).all():
        level, left = common, float(np.hypot(sure, apart))
    else:
        share, error = (
            weight @ (seen.level / seen.white),
            np.hypot(weight @ (seen.error / seen.white), _ASTRAY),
        )
        believed = apart**2 / (error**2 + apart**2)
        level = common + believed * np.clip(share - common, -_WILD * apart, _WILD * apart)
        left = np.sqrt(believed * error**2 + sure**2)
    return Veil(level * seen.white, left * seen.white, seen.white, told=True)


def _in_common(share: np.ndarray, error: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What photos (v, c) with such errors have in common, its error, and the standard deviation by which they are
    apart, (c,) each; those that lie far off the others have no say."""
    middle = np.median(share, axis=0)
    scatter = robust.deviation(share - middle, axis=0) if len(share) >= _FEW else 0.0
    apart = np.sqrt(np.maximum(scatter**2 - np.median(error**2, axis=0), 0.0))
    expected = error**2 + apart**2
    weight = np.where((share - middle) ** 2 <= _FAR**2 * expected, 1 / expected, 0.0)
    total = np.maximum(weight.sum(0), np.finfo(float).tiny)
    return (weight * share).sum(0) / total, 1 / np.sqrt(total), apart


def photo_veil(samples: PaperSamples) -> Veil | None:
    """As one photo's paper has it, NaN if it shows too little; None without white paper. Errors within a square of the
    print go together."""
    white = samples.white
    middle = np.median(samples.value[white], axis=0) if white.any() else np.zeros(1)
    if middle.min() <= 0:
        return None
    untold = Veil(np.full_like(middle, np.nan), np.full_like(middle, np.nan), middle)
    if not enough_print(samples):
        return untold
    untold = replace(untold, most=_darkest(samples, middle))
    for most in (_MOST, len(white)):  # all of them, where some do not tell it well
        dark, beside, noise = evenly_lit(samples, most)
        if len(dark) < _FEWEST:
            continue
        black, square = samples.value[dark], samples.square[dark]
        lines = [_line(beside[:, c], black[:, c], noise[:, c], square) for c in range(len(middle))]
        slope, offset, error = np.array(lines).T
        if (error < _WELL * middle).all():
            break
    if len(dark) < _FEWEST or not np.isfinite(error).all() or slope.max() >= 1:
        return untold
    # the white beside has the veil too: black = slope (white - veil) + veil
    return replace(untold, level=offset / (1 - slope), error=error / (1 - slope))


def enough_print(samples: PaperSamples) -> bool:
    """Whether black and white are seen often enough to be compared."""
    return samples.white.sum() >= _NEIGHBOURS and (~samples.white).sum() >= _FEWEST


def _darkest(samples: PaperSamples, middle: np.ndarray) -> float:
    """Share of the ``middle`` white (c,) that no veil exceeds: what the darkest of black print sends."""
    black, noise = (one[~samples.white].mean(1) for one in (samples.value, samples.variance))
    level = np.quantile(black, _DARKEST)
    noise = np.median(noise[black <= level]) / samples.value.shape[1]  # of the mean of the channels
    return max(float(level + _ABOVE * np.sqrt(noise)), 0.0) / float(middle.mean())


def evenly_lit(samples: PaperSamples, most: int = _MOST) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which of about ``most`` samples of black print no shadow's edge is near, the white beside and the variance of its
    noise, (n, c) each."""
    white = samples.white
    dark = np.flatnonzero(~white)
    dark = dark[:: max(1, len(dark) // most)]
    places, lit_places = (np.ascontiguousarray(samples.points[k, :2], float) for k in (dark, white))
    distance, near = cKDTree(lit_places).query(places, k=_NEIGHBOURS)
    lit = np.ascontiguousarray(samples.value[white], float)
    beside, noise = np.empty((2, len(dark), lit.shape[1]))
    scatter = np.empty(len(dark))
    planes_at(places, lit_places, lit, near, _RIDGE, beside, noise, scatter)
    good = (scatter < _EVEN) & (distance.max(1) < 2 * np.median(distance.max(1)))
    return dark[good], beside[good], noise[good]


def _line(x: np.ndarray, y: np.ndarray, noise: np.ndarray, cluster: np.ndarray) -> tuple[float, float, float]:
    """Slope, offset and the latter's standard error of a line through (n,) points whose errors are a share of ``x``,
    and hang together within a ``cluster``; without what lies far off it. The error is infinite where ``x`` is too even.

    ``noise`` is the variance of ``x``: of how it scatters it takes a share for which slopes come out too small, and
    offsets too large. That is undone, and may be wrong by as much.
    """
    size = x + _DIM * np.median(x)
    design, target = np.column_stack([x, np.ones(len(x))]) / size[:, None], y / size
    keep = np.ones(len(x), bool)
    for _ in range(_ROUNDS):
        found = np.linalg.lstsq(design[keep], target[keep], rcond=None)[0]
        miss = target - design @ found
        keep = np.abs(miss) <= _WILD * robust.deviation(miss[keep]) + 1e-15
    part, inverse = np.unique(cluster[keep], return_inverse=True)
    pulls = np.zeros((len(part), 2))
    np.add.at(pulls, inverse, design[keep] * miss[keep, None])
    normal = np.linalg.pinv(design[keep].T @ design[keep])
    weight = size[keep] ** -2.0
    middle = weight @ x[keep] / weight.sum()
    scatter, false = weight @ (x[keep] - middle) ** 2 / weight.sum(), weight @ noise[keep] / weight.sum()
    if not max(false / _NOISY, (_SCATTER * middle) ** 2) < scatter:
        return float(found[0]), float(found[1]), np.inf
    slope, lost = found[0] / (1 - false / scatter), false / scatter
    own = (normal @ pulls.T @ pulls @ normal)[1, 1] / (1 - lost) ** 2
    unequal = _UNEQUAL * (found[0] * middle + found[1]) * middle / np.sqrt(scatter)
    error = np.sqrt(own + (slope * lost * middle) ** 2 + unequal**2)
    return float(slope), float(found[1] - lost * slope * middle), float(error)


def lifted(reading: PaperReading, veil: Veil | None) -> PaperReading:
    """A photo's paper without it, and as unsure as it is: to black print that is much, to white next to nothing."""
    if veil is None:
        return reading
    reading, doubt = correction_of(veil).of_reading(reading), float(veil.error.mean()) ** 2
    close = None if reading.close is None else replace(reading.close, noise=reading.close.noise + doubt)
    patches = reading.patches
    patches = None if patches is None else replace(patches, noise=patches.noise + doubt)
    return replace(reading, noise=reading.noise + doubt, close=close, patches=patches)


def correction_of(veil: Veil) -> PhotometricCorrection:
    """What takes it off a photo, if it is told."""
    return PhotometricCorrection(veil.level, veil.error) if veil.told else NO_CORRECTION


class VeilingGlare(Departure):
    """Light over whole pictures, taken off."""

    stage = Stage.PHOTO
    entries = (
        Entry(
            "veiling-glare",
            "Light lies over whole pictures, as much on black print as on white: the lens's glare, or a "
            "black level that "
            "is not the sensor's. Black print against the white beside it tells it where the board is lit unevenly, "
            "and it is taken off; lamps far away, without shadows on the print, leave up to 0.2 % of white "
            "untold, as an error.",
            "Keep lamps and bright table tops out of the picture and off the lens, clean the lens, and check "
            "`black_level`.",
            least=1e-3,
            sigmas=4.0,
            source="of white paper; path-traced sets without a veil show 1e-4 to 4e-4 in single photos",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        veils = find_veils(state.papers(), state.reader.workers)
        # it makes black print an uneven share of the white, as shine does, but one that it explains
        off = {name: correction_of(veil) for name, veil in veils.items()}
        papers = ((name, off.get(name, NO_CORRECTION).of_reading(one)) for name, one in state.papers())
        if not veils or shining({name: square_ratios(one) for name, one in papers}):
            return []
        told = [one for one in veils.values() if one.told]
        if not told:
            return [Diagnosis("veiling-glare", amount=0.0, least=_LEAST, sigmas=_SURE, grounds=veils)]
        share = float(np.median([(one.level / one.white).mean() for one in told]))
        error = float(np.median([(one.error / one.white).mean() for one in told]))
        message, detail = _in_words(share, error), {"share": share}
        return [
            Diagnosis(
                "veiling-glare",
                message,
                abs(share),
                error,
                _LEAST,
                _SURE,
                allowed=True,
                detail=detail,
                grounds=veils,
            )
        ]

    def remedy(self, state: State, found: Sequence[Diagnosis]) -> State:
        (one,), veils = found, found[0].grounds
        if one.message:
            state.remarks.residuals["veil"] = {"share_of_white": one.detail["share"], "error": one.error}
        state = state.with_paper(lambda one, reading: lifted(reading, veils.get(one.view.name)))
        return replace(state, corrections={name: correction_of(veil) for name, veil in veils.items()})


def _in_words(share: float, error: float) -> str:
    what = (
        "light lies over the pictures, as much on black print as on white"
        if share > 0
        else "the pictures' black is too low"
    )
    return (
        f"{what}: {share:+.2%} (+- {error:.2%}) of white paper. It is taken off: a lens that spreads light (glare; "
        "keep lamps off it, and clean it) does it, and a wrong [radiometry] black_level"
    )
