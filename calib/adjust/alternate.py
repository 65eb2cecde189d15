"""Lamps, mirror balls, sample, poses and camera settled together, in a few rounds of shading and adjustment."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from photogonio.calib.adjust.bundle import Adjusted, CameraModel, Values, adjust, block_pose
from photogonio.calib.adjust.lamps import Lamp, block_name, expected_pixel, place_in_world, sight_rays
from photogonio.calib.adjust.terms import all_terms, first_values, fixed_blocks
from photogonio.calib.detect.highlights import Highlight, ball_box, find_highlight
from photogonio.calib.detect.limb import place_ball
from photogonio.calib.detect.mirror_rays import meet
from photogonio.calib.detect.observation import Observation, Posed
from photogonio.calib.detect.photo_reader import Progress, Reader
from photogonio.calib.geometry.board import board_size
from photogonio.calib.geometry.camera import Camera, focal
from photogonio.calib.shading.fit import ShadingFit, fit_shading, fits_better
from photogonio.calib.shading.initial import black_over_white
from photogonio.calib.shading.model import Ball, ShadingScene
from photogonio.calib.shading.model_error import pooled
from photogonio.capture.photoset import MirrorBall, PhotoSet, Sphere

_STEPS = (8, 3, 3, 3)  # of each view's own shading fit in each round: the adjustment does the rest
# of a lamp's distance: where balls and shading differ as much, a fit is tried from where the balls show it
_ELSEWHERE = 0.02
_WILD = 6.0  # standard errors at which a highlight is taken for something else
_WILD_PIXELS = 2.5
_LOOK_AGAIN = 4.0  # pixels around the place where a highlight must be
_ENOUGH = 8  # highlights' coordinates that tell how large their errors are
_LAMP_SIZE = 0.02  # of the board's diagonal: a lamp's radius, where nothing is known of it
_EDGE_BLUR = 0.7  # pixels by which lens and pixels soften a shadow's edge


@dataclass(frozen=True, slots=True)
class Settled:
    """Where everything came to rest."""

    camera: Camera
    model: CameraModel
    values: Values
    covariance: dict[str, np.ndarray]
    lamps: dict[str, Lamp]
    misses: dict[str, np.ndarray]  # (k, 2) highlight residuals by light, pixels
    shading: dict[str, ShadingFit]  # by view
    scene: ShadingScene | None
    corner_rms: float  # of the corners' residuals, in their standard errors
    highlight_scale: float  # what the highlights' stated errors had to be multiplied with


def settle(
    photoset: PhotoSet,
    reader: Reader,
    model: CameraModel,
    camera: Camera,
    boards: list[Posed],
    observations: list[Observation],
    lamps: dict[str, Lamp],
    scene: ShadingScene | None,
    sample: np.ndarray | None,
    tell: Progress,
) -> Settled:
    """Rounds of: fit every view's shading; adjust all together; look at the highlights again."""
    values = first_values(photoset, model, camera, boards, observations, lamps, scene, sample)
    fixed = fixed_blocks(photoset, lamps)
    scale, beam = 1.0, scene is not None and scene.narrow != 0.0
    lens = scene is not None and any(scene.falloff)
    asked: dict[str, np.ndarray] = {}  # where views' fits were last tried from besides
    first = {observation.view.name: tuple(observation.highlights) for observation in observations}
    for round_, steps in enumerate(_STEPS):
        fits: dict[str, ShadingFit] = {}
        if scene is not None:
            shown = _by_highlights(photoset, model.camera(values["camera"]), values, observations, first)
            new = {k: v for k, v in shown.items() if k not in asked or _apart(v, asked[k])}
            fits, tried = _shade(reader, observations, values, lamps, scene, steps, new)
            asked |= {name: shown[name] for name in tried}
            scene = replace(scene, error=pooled(fit.shown for fit in fits.values()))
        terms = all_terms(photoset, model, boards, observations, lamps, values, fits, scale, beam, lens)
        done = adjust(values, terms, fixed)
        values = done.values
        for observation in observations:
            observation.pose = block_pose(values[observation.pose_block])
        scale = _review(photoset, reader, model, values, observations, lamps, scale, bool(fits))
        tell("settling", round_ + 1, len(_STEPS))
    photos = len(boards) + sum(s.corners is not None for s in observations)
    return Settled(
        model.camera(values["camera"]),
        model,
        values,
        done.covariance,
        lamps,
        _misses(model, values, observations, lamps),
        fits,
        None if scene is None else _as_taken(_present(scene, values), beam, lens),
        _corner_rms(done, photos),
        scale,
    )


def _present(scene: ShadingScene, values: Values) -> ShadingScene:
    """The scene at the present values."""
    sphere = values["sample"] if scene.sample is not None else scene.shared[:4]
    balls = [values[f"ball {k}"] for k in range(len(scene.polished))]
    return scene.moved(np.concatenate([sphere, values["lamp"], *balls]))


def _as_taken(scene: ShadingScene, beam: bool, lens: bool) -> ShadingScene:
    """Without what was held about none: a lamp's beam, a lens that darkens its pictures."""
    return replace(scene, narrow=scene.narrow if beam else 0.0, falloff=scene.falloff if lens else (0.0, 0.0))


def _by_highlights(
    photoset: PhotoSet,
    camera: Camera,
    values: Values,
    observations: list[Observation],
    first: dict[str, tuple[Highlight, ...]],
) -> dict[str, np.ndarray]:
    """Places (3,) of the lamps by view, where the mirror balls as they now stand tell by themselves: by the highlights
    seen at ``first`` where they were dropped since, which a lamp that went astray does to the right ones."""
    blocks = [values[f"ball {k}"] for k in range(len(photoset.mirror_balls))]
    now = replace(photoset, mirror_balls=tuple(MirrorBall(b[:3], float(b[3])) for b in blocks))
    found = {}
    for observation in observations:
        seen = max(
            observation.highlights, first[observation.view.name], key=lambda one: len({h.ball for h in one})
        )
        rays = sight_rays(now, camera, replace(observation, highlights=list(seen)))
        if len({h.ball for h in seen}) > 1 and len(rays) > 1:
            found[observation.view.name] = meet(rays, "point", 1.0).place
    return found


def _shade(
    reader: Reader,
    observations: list[Observation],
    values: Values,
    lamps: dict[str, Lamp],
    scene: ShadingScene,
    steps: int,
    shown: dict[str, np.ndarray],
) -> tuple[dict[str, ShadingFit], list[str]]:
    """Every near view's shading at the present values, and the views that were tried from where the balls show it.

    Where the mirror balls show (``shown``) a lamp elsewhere the fit is tried from there too: robust weights can settle
    on a place whose shadows fall beside those in the photo, and take the difference for dirt.
    """
    scene = _present(scene, values)

    def fit(observation: Observation) -> tuple[ShadingFit | None, bool]:
        lamp = lamps.get(observation.light)
        if not observation.has_paper or lamp is None or lamp.kind != "point" or lamp.fixed:
            return None, False
        pose = block_pose(values[observation.pose_block])
        place = place_in_world(lamp, values[block_name(lamp.name)], pose)
        if place[2] <= 0 and observation.shading is not None:  # under the board: nothing is lit from there
            place = observation.shading[:3]
        if place[2] <= 0:
            return None, False
        start = place if observation.shading is None else np.concatenate([place, observation.shading[3:]])
        reading = observation.reading
        found, other = fit_shading(reading, scene, start, steps), shown.get(observation.view.name)
        if other is None or other[2] <= 0 or lamp.attached or not _apart(other, found.place):
            return found, False
        again = fit_shading(reading, scene, other, max(steps, _STEPS[0]))
        return (again if fits_better(reading, scene, again, found) else found), True

    fits, tried = {}, []
    for observation, (found, again) in zip(observations, reader.abreast(fit, observations), strict=True):
        if found is not None:
            observation.shading = found.local
            fits[observation.view.name] = found
        if again:
            tried.append(observation.view.name)
    return fits, tried


def _apart(one: np.ndarray, other: np.ndarray) -> bool:
    return bool(np.linalg.norm(one - other) >= _ELSEWHERE * np.linalg.norm(other))


def _review(
    photoset: PhotoSet,
    reader: Reader,
    model: CameraModel,
    values: Values,
    observations: list[Observation],
    lamps: dict[str, Lamp],
    scale: float,
    sure: bool,
) -> float:
    """Drop highlights that are something else, look again where a lamp must be seen; the new scale of errors.

    Only where lamps are ``sure`` without the highlights, by shading.
    """
    if not sure:
        return scale
    camera = model.camera(values["camera"])
    ratios: list[float] = []
    for observation in observations:
        lamp = lamps.get(observation.light)
        if lamp is None:
            continue
        kept = []
        for k in range(len(photoset.mirror_balls)):
            found = next((h for h in observation.highlights if h.ball == k), None)
            expected = expected_pixel(camera, observation, lamp, values, k)
            if found is None or _wild(found, expected, scale):
                found = _look_again(reader, camera, observation, values[f"ball {k}"], k, expected, scale)
            if found is not None:
                kept.append(found)
                ratios += list(np.abs(found.pixel - expected) / found.sigma)
        observation.highlights = kept
    if len(ratios) < _ENOUGH:
        return scale
    return float(np.clip(1.4826 * np.median(ratios), 0.3, 10.0))


def _wild(found: Highlight, expected: np.ndarray, scale: float) -> bool:
    miss = float(np.hypot(*(found.pixel - expected)))
    return miss > max(_WILD * scale * found.sigma, _WILD_PIXELS)


def _look_again(
    reader: Reader,
    camera: Camera,
    observation: Observation,
    block: np.ndarray,
    number: int,
    expected: np.ndarray,
    scale: float,
) -> Highlight | None:
    ball = MirrorBall(block[:3], float(block[3]))
    x0, y0, x1, y1 = box = ball_box(camera, observation.pose, ball)
    if not np.isfinite(expected).all() or x0 >= x1 or y0 >= y1:
        return None
    image = reader.part(observation.view, box)
    if image is None:
        return None
    found = find_highlight(image, camera, observation.pose, ball, number, near=expected, within=_LOOK_AGAIN)
    return None if found is None or _wild(found, expected, scale) else found


def _misses(
    model: CameraModel, values: Values, observations: list[Observation], lamps: dict[str, Lamp]
) -> dict[str, np.ndarray]:
    camera = model.camera(values["camera"])
    misses: dict[str, list[np.ndarray]] = {}
    for observation in observations:
        if observation.light in lamps:
            for h in observation.highlights:
                expected = expected_pixel(camera, observation, lamps[observation.light], values, h.ball)
                misses.setdefault(observation.light, []).append(h.pixel - expected)
    return {k: np.array(v) for k, v in misses.items()}


def _corner_rms(done: Adjusted, count: int) -> float:
    """Rms of the first ``count`` terms' residuals, outliers cut."""
    if not count:
        return float("nan")
    z = np.concatenate(done.residuals[:count])
    return float(np.sqrt(np.mean(np.minimum(z**2, 9.0)))) if len(z) else float("nan")


def start_sample(camera: Camera, observations: list[Observation], sample: object) -> np.ndarray | None:
    """Centre and radius (4,) of a sample ball by its limbs; None for a plane."""
    if not isinstance(sample, Sphere):
        return None
    seen = [(s.pose, s.limb) for s in observations if s.limb is not None and len(s.limb) > 20]
    center, radius = np.asarray(sample.center, float), float(sample.radius)
    if seen:
        center, radius = place_ball(camera, [p for p, _ in seen], [limb for _, limb in seen], center, radius)
    return np.append(center, radius)


def start_scene(
    photoset: PhotoSet,
    camera: Camera,
    observations: list[Observation],
    sample: np.ndarray | None,
    narrow: float = 0.0,
    falloff: tuple[float, float] = (0.0, 0.0),
) -> ShadingScene | None:
    """The things on the board as shading sees them, in lamps' light that is ``narrow``; None where no photo shows
    enough paper."""
    first = next((s for s in observations if s.has_paper), None)
    if first is None or photoset.board is None:
        return None
    size = board_size(photoset.board)
    given = [e.radius for e in photoset.lights if e.radius is not None]
    scale = focal(camera) / float(np.linalg.norm(first.pose.apply(np.append(size / 2, 0.0))))
    return ShadingScene(
        tuple(Ball(np.asarray(b.center, float), float(b.radius)) for b in photoset.mirror_balls),
        None if sample is None else Ball(sample[:3], float(sample[3])),
        float(np.median(given)) if given else _LAMP_SIZE * float(np.hypot(*size)),
        black_over_white(s.reading for s in observations if s.has_paper),
        _EDGE_BLUR / scale,
        narrow=narrow,
        aim=_aimed_at(photoset, sample),
        falloff=falloff,
    )


def _aimed_at(photoset: PhotoSet, sample: np.ndarray | None) -> tuple[float, ...]:
    """Where lamps look: the middle of the sample."""
    if sample is not None:
        return tuple(sample[:3].tolist())
    plane = photoset.sample
    return (*np.mean(plane.outline, axis=0).tolist(), float(plane.height))
