"""First guesses of a lamp's place, from mirrored rays or from the board's shading alone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from photogonio.calib.detect.mirror_rays import MirroredRay, meet
from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.shading.fit import fit_local
from photogonio.calib.shading.kernel import misfits
from photogonio.calib.shading.model import LitPaper, ShadingScene
from photogonio.calib.shading.sights import Sights
from photogonio.capture import robust

_RANGES = (0.8, 1.3, 2.0, 3.2, 5.0)  # of the board's diagonal: how far lamps may stand
_AFAR = (
    20.0,
    90.0,
)  # and where they are as good as infinitely far: from nearer starts fits end in wrong directions
_HEIGHTS = (12.0, 25.0, 40.0, 58.0, 78.0)  # degrees above the board
_AROUND = 12
_COARSE = 700  # samples for trying many places
_MIDDLING = 3000  # samples for a first fit
_TOLERANCE = 0.1  # relative misfit counted as no fit at all
_GOOD = 0.06  # mean misfit of a first fit that needs no second
_DOUBTFUL = 0.15  # mean misfit beyond which the rays are not trusted alone
_ON_RAY = 5.0  # standard errors by which a ray may pass the lamp
_ELSEWHERE = 0.1  # of a lamp's distance
_FEW = 2  # samples of a tone in a square that say too little
_EVEN = 0.7  # of a square's bright white, that its dark white is where no shadow's edge crosses it
_SOFT = 0.015  # of the diagonal: the edges of shadows at first

Shares = tuple[np.ndarray, np.ndarray, np.ndarray]  # of :func:`square_ratios`


def thinned(reading: PaperReading, count: int) -> PaperReading:
    """About ``count`` of the samples, evenly taken, and nothing close to balls."""
    return replace(reading, close=None).thinned(count)


def black_over_white(readings: Iterable[PaperReading]) -> float:
    """Radiance of black print over white, from evenly lit squares that show both; the median over squares and views."""
    ratios = np.concatenate([square_ratios(reading)[0] for reading in readings])
    return float(np.clip(np.median(ratios), 1e-3, 0.9)) if len(ratios) else 0.05


def square_ratios(reading: PaperReading) -> Shares:
    """The same of each square (k,), its standard error by noise (k,), and the square's place (k, 2): no shadow's edge
    runs through its white, so that both tones are lit alike."""
    ratios, errors, places = [], [], []
    for square in np.unique(reading.samples.square):
        here = reading.samples.square == square
        white = reading.level[here & reading.samples.white]
        ink = here & ~reading.samples.white
        black = reading.level[ink]
        if len(white) > _FEW and len(black) > _FEW:
            low, middle, high = np.percentile(white, [10, 50, 90])
            if low > _EVEN * high:
                ratios.append(robust.median(black) / max(middle, 1e-300))
                noise = np.sqrt(robust.median(reading.noise[ink]) / len(black))
                errors.append(robust.OF_MEDIAN * noise / max(middle, 1e-300))
                places.append(reading.samples.points[ink, :2].mean(0))
    return np.array(ratios, float), np.array(errors, float), np.array(places, float).reshape(-1, 2)


def white_level(reading: PaperReading) -> float:
    """Radiance of the white print, in the middle; 0 if none is seen."""
    white = reading.level[reading.samples.white]
    return float(np.median(white)) if len(white) else 0.0


def first_fit(
    reading: PaperReading, scene: ShadingScene, rays: list[MirroredRay], middle: np.ndarray, diagonal: float
) -> np.ndarray:
    """Local values (LOCAL,) of the fit started where the rays make the shading agree; if that is not good, of the best
    of further starts, also from a scan of the sky. Where it ends on the rays of several balls, a rough fit from the
    sky's likeliest place must show a better one elsewhere before all that is done: much bounce makes even the right
    place fit badly."""
    alone = _by_lamp_alone(reading, scene)
    coarse, fine = thinned(alone, _COARSE), thinned(alone, _MIDDLING)
    board = LitPaper.of(fine, Sights.of(rays))
    soft = replace(scene, lamp_radius=2 * scene.lamp_radius, soft=_SOFT * diagonal)

    def fitted(place: np.ndarray) -> tuple[float, np.ndarray]:
        """Shadows first with wide edges, which reach farther, then as they are."""
        local = fit_local(board, scene, fit_local(board, soft, place))
        return misfit(fine, scene, local[:3]), local

    found: list[tuple[float, np.ndarray]] = []
    for place in _best(ray_places(rays, diagonal), coarse, soft, 2):
        if not found or not (found[0][0] <= _GOOD or _on_rays(found[0][1][:3], rays)):
            found.append(fitted(place))
    least, best = min(found, key=lambda one: one[0]) if found else (1.0, None)
    if least > _DOUBTFUL:
        places = _best(sky_places(middle, diagonal), coarse, soft, 3)
        if best is None or not _on_rays(best[:3], rays) or _beaten(best[:3], coarse, soft, places[0]):
            found += [fitted(place) for place in places]
    return min(found, key=lambda one: one[0])[1]


def _by_lamp_alone(reading: PaperReading, scene: ShadingScene) -> PaperReading:
    """Without the light that is there anyway, where that is known."""
    beside, error = reading.beside
    room = beside * np.where(reading.samples.white, 1.0, scene.black)
    return replace(reading, level=np.maximum(reading.level - room, 0.0), beside=(0.0, error))


def _on_rays(place: np.ndarray, rays: list[MirroredRay]) -> bool:
    """Whether the rays of two or more balls pass ``place`` by no more than their errors."""
    return len({ray.ball for ray in rays}) > 1 and all(
        (place - ray.origin) @ ray.direction > 0
        and np.linalg.norm(np.cross(place - ray.origin, ray.direction))
        < _ON_RAY * ray.spread * np.linalg.norm(place - ray.origin)
        for ray in rays
    )


def _beaten(place: np.ndarray, reading: PaperReading, scene: ShadingScene, start: np.ndarray) -> bool:
    """Whether a fit from ``start`` ends far from ``place``, where the light agrees better."""
    other = fit_local(LitPaper.of(reading), scene, start)[:3]
    far = np.linalg.norm(other - place) > _ELSEWHERE * np.linalg.norm(place)
    return bool(far and misfit(reading, scene, other) < misfit(reading, scene, place))


def ray_places(rays: list[MirroredRay], diagonal: float) -> list[np.ndarray]:
    """Where the rays meet, and places along each of them."""
    places = [r.origin + k * diagonal * r.direction for r in rays for k in _RANGES + _AFAR]
    if len(rays) > 1:
        met = meet(rays, "point", diagonal)
        places.append(met.place)
    return [p for p in places if p[2] > 0.02 * diagonal]


def sky_places(middle: np.ndarray, diagonal: float) -> list[np.ndarray]:
    """Places over the board, all around it and at several distances."""
    places = []
    for height in np.radians(_HEIGHTS):
        for turn in np.arange(_AROUND) * 2 * np.pi / _AROUND:
            toward = np.array([np.cos(height) * np.cos(turn), np.cos(height) * np.sin(turn), np.sin(height)])
            places += [middle + k * diagonal * toward for k in (*_RANGES[1:4], _AFAR[-1])]
    return places


def misfit(reading: PaperReading, scene: ShadingScene, place: np.ndarray) -> float:
    """Between 0 and 1: how badly falloff and shadows agree with a lamp at ``place``, its strength fitted."""
    return float(_misfits([place], reading, scene)[0])


def _misfits(places: list[np.ndarray], reading: PaperReading, scene: ShadingScene) -> np.ndarray:
    tone = np.where(reading.samples.white, 1.0, scene.black)
    result, blur = np.empty(len(places)), scene.blur**2 + scene.soft**2
    level, points = np.ascontiguousarray(reading.level, float), np.ascontiguousarray(reading.samples.points)
    misfits(
        points,
        tone,
        level,
        np.array(places),
        scene.lamp_radius,
        scene.table,
        blur / 4,
        _TOLERANCE,
        result,
    )
    return result


def _best(
    places: list[np.ndarray], reading: PaperReading, scene: ShadingScene, count: int
) -> list[np.ndarray]:
    if not places:
        return []
    scores = _misfits(places, reading, scene)
    return [places[k] for k in np.argsort(scores)[:count]]
