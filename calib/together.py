"""Lamps, mirror balls, sample, poses and camera settled together, in a few rounds of shading and adjustment."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from calib.board import Corners, board_size
from calib.bundle import (
    Adjusted,
    Model,
    Part,
    Sighting,
    Term,
    Values,
    adjust,
    block_pose,
    camera_term,
    corner_term,
    highlight_term,
    limb_term,
    pose_block,
    prior_term,
    quadratic_term,
)
from calib.camera import Camera, Pose
from calib.highlights import find_highlight
from calib.lights import MirroredRay, meet, mirrored_ray
from calib.looking import Progress, Reader
from calib.sample import Limb, focal, place_ball
from calib.shading import LOCAL, SHARED, Ball, Scene, ShadingFit, fit_shading
from calib.sight import Sight
from calib.starts import black_over_white, first_fit
from capture.photoset import LightEntry, MirrorBall, PhotoSet, Sphere

ROUNDS = 4
_STEPS = (8, 3, 3, 3)  # of each view's own fit in each round: the adjustment does the rest
_BALL_PLACE = 0.02  # of a mirror ball's radius: how well the manifest places it
_BALL_RADIUS = 0.003
_SAMPLE_PLACE = 0.03  # of the sample's radius
_SAMPLE_RADIUS = 0.004
_STANDS = 0.002  # of its radius: how well a ball that stands on the paper touches it
_LIMB_BIAS = 0.1  # pixels
_FAR = 25.0  # board diagonals beyond which a lamp counts as distant
_WILD = 6.0  # standard errors at which a highlight is taken for something else
_WILD_PIXELS = 2.5


@dataclass(frozen=True, slots=True)
class Lamp:
    """One light id while it is being settled."""

    name: str
    entry: LightEntry | None
    kind: str  # "point" | "directional"
    block: np.ndarray  # (3,) place, direction, or place in the camera's frame if attached
    source: str
    fixed: bool = False

    @property
    def attached(self) -> bool:
        return self.entry is not None and self.entry.attached_to == "camera"


@dataclass(frozen=True, slots=True)
class Settled:
    """Where everything came to rest."""

    camera: Camera
    model: Model
    values: Values
    covariance: dict[str, np.ndarray]
    lamps: dict[str, Lamp]
    misses: dict[str, np.ndarray]  # (k, 2) highlight residuals by light, pixels
    shading: dict[str, ShadingFit]  # by view
    scene: Scene | None
    corner_z: float  # rms residual of corners, standard errors
    highlight_sigma: float  # pixels, as found


def settle(
    photoset: PhotoSet,
    reader: Reader,
    model: Model,
    camera: Camera,
    boards: list[tuple[str, Corners, Pose]],
    sights: list[Sight],
    lamps: dict[str, Lamp],
    scene: Scene | None,
    sample: np.ndarray | None,
    tell: Progress,
) -> Settled:
    """Rounds of: fit every view's shading; adjust all together; look at the highlights again."""
    values = _first_values(photoset, model, camera, boards, sights, lamps, scene, sample)
    fixed = _fixed(photoset, lamps)
    scale, fits, done = 1.0, {}, None
    for round_ in range(ROUNDS):
        fits = _shade(sights, values, lamps, scene, _STEPS[round_]) if scene is not None else {}
        if fits:
            scene = scene.moved(_shared(values, scene))
        sightings = _sightings(sights, lamps, scale)
        terms = _terms(photoset, model, boards, sights, lamps, values, fits, sightings)
        done = adjust(values, terms, fixed)
        values = done.values
        _update(values, sights, scene)
        scale = _review(photoset, reader, model, values, sights, lamps, scale, bool(fits))
        tell("settling", round_ + 1, ROUNDS)
    if scene is not None:
        scene = scene.moved(_shared(values, scene))
    misses = _misses(model, values, sights, lamps)
    return Settled(
        model.camera(values["camera"]),
        model,
        values,
        done.covariance,
        lamps,
        misses,
        fits,
        scene,
        _corner_z(done, len(boards) + len(sights)),
        scale,
    )


def _first_values(
    photoset: PhotoSet,
    model: Model,
    camera: Camera,
    boards: list[tuple[str, Corners, Pose]],
    sights: list[Sight],
    lamps: dict[str, Lamp],
    scene: Scene | None,
    sample: np.ndarray | None,
) -> Values:
    values: Values = {"camera": model.block(camera)}
    for name, _, pose in boards:
        values[name] = pose_block(pose)
    for sight in sights:
        values[sight.pose_block] = pose_block(sight.pose)
    for name, lamp in lamps.items():
        values[f"light {name}"] = np.asarray(lamp.block, float)
    for k, ball in enumerate(photoset.mirror_balls):
        values[f"ball {k}"] = np.append(np.asarray(ball.center, float), ball.radius)
    if sample is not None:
        values["sample"] = sample
        values["limb offset"] = np.zeros(1)
    if scene is not None:
        values["lamp"] = np.array([np.log(scene.lamp_radius), np.log(scene.black)])
    return values


def _fixed(photoset: PhotoSet, lamps: dict[str, Lamp]) -> frozenset[str]:
    fixed = {f"light {n}" for n, lamp in lamps.items() if lamp.fixed}
    if photoset.camera.matrix is not None:
        fixed.add("camera")
    if photoset.camera.rotation is not None:
        fixed.add("pose fixed")
    return frozenset(fixed)


def _shared(values: Values, scene: Scene) -> np.ndarray:
    sphere = values["sample"] if scene.sample is not None else scene.shared[:4]
    return np.concatenate([sphere, values["lamp"]])


def place_in_world(lamp: Lamp, block: np.ndarray, pose: Pose) -> np.ndarray:
    """A lamp's place (or direction) in the world frame, seen from the camera's ``pose``."""
    return pose.inverse().apply(block) if lamp.attached else block


def _shade(
    sights: list[Sight], values: Values, lamps: dict[str, Lamp], scene: Scene, steps: int
) -> dict[str, ShadingFit]:
    """Every near view's shading at the present values."""
    scene = _with_balls(scene.moved(_shared(values, scene)), values)
    fits = {}
    for sight in sights:
        lamp = lamps.get(sight.light)
        if sight.reading is None or lamp is None or lamp.kind != "point" or lamp.fixed:
            continue
        place = place_in_world(lamp, values[f"light {lamp.name}"], block_pose(values[sight.pose_block]))
        start = place if sight.shading is None else np.concatenate([place, sight.shading[3:]])
        fit = fit_shading(sight.reading, scene, start, steps)
        sight.shading = fit.local
        fits[sight.view.name] = fit
    return fits


def _with_balls(scene: Scene, values: Values) -> Scene:
    balls = tuple(
        Ball(values[f"ball {k}"][:3], float(values[f"ball {k}"][3])) for k in range(len(scene.polished))
    )
    return replace(scene, polished=balls)


def _sightings(sights: list[Sight], lamps: dict[str, Lamp], scale: float) -> list[Sighting]:
    return [
        Sighting(
            s.pose_block,
            f"light {s.light}",
            f"ball {h.ball}",
            lamps[s.light].kind == "directional",
            lamps[s.light].attached,
            h.pixel,
            scale * h.sigma,
        )
        for s in sights
        if s.light in lamps
        for h in s.highlights
    ]


def _terms(
    photoset: PhotoSet,
    model: Model,
    boards: list[tuple[str, Corners, Pose]],
    sights: list[Sight],
    lamps: dict[str, Lamp],
    values: Values,
    fits: dict[str, ShadingFit],
    sightings: list[Sighting],
) -> list[tuple[Term, bool]]:
    terms = [(corner_term(model, name, corners), True) for name, corners, _ in boards]
    terms += [(corner_term(model, s.pose_block, s.corners), True) for s in sights if s.corners is not None]
    if sightings:
        terms.append((highlight_term(model, sightings), True))
    for s in sights:
        if s.limb is not None and len(s.limb):
            terms.append((limb_term(model, s.pose_block, "sample", s.limb.pixels, s.limb.sigma), True))
        if s.view.name in fits:
            terms.append((_shading_term(fits[s.view.name], s, lamps[s.light], values), False))
    if model.square or model.centred:
        terms.append((camera_term(model), False))
    return terms + _priors(photoset, lamps, values)


def _shading_term(fit: ShadingFit, sight: Sight, lamp: Lamp, values: Values) -> Term:
    """What one view's shading says of lamp, sample and print, its own values eliminated."""
    own, kept = slice(3, LOCAL), np.r_[0:3, LOCAL : LOCAL + SHARED]
    if "sample" not in values:
        kept = np.r_[0:3, LOCAL + 4 : LOCAL + SHARED]
    cross = np.linalg.solve(fit.normal[own, own], fit.normal[own][:, kept])
    normal = fit.normal[np.ix_(kept, kept)] - fit.normal[kept][:, own] @ cross
    slope = fit.gradient[kept] - cross.T @ fit.gradient[own]
    light = Part(f"light {sight.light}", slice(0, 3))
    if lamp.attached:
        pose = block_pose(values[sight.pose_block]).inverse()
        light = replace(light, turn=pose.rotation, shift=pose.translation)
    parts = (
        [light] + ([Part("sample", slice(0, 4))] if "sample" in values else []) + [Part("lamp", slice(0, 2))]
    )
    at = np.concatenate([fit.place] + [values[p.block][p.where] for p in parts[1:]])
    return quadratic_term(parts, at, normal, slope)


def _priors(photoset: PhotoSet, lamps: dict[str, Lamp], values: Values) -> list[tuple[Term, bool]]:
    terms = []
    for k, ball in enumerate(photoset.mirror_balls):
        sigma = ball.radius * np.array([_BALL_PLACE] * 3 + [_BALL_RADIUS])
        terms.append((prior_term(f"ball {k}", np.append(ball.center, ball.radius), sigma), True))
    if "sample" in values:
        sample = photoset.sample
        sigma = sample.radius * np.array([_SAMPLE_PLACE] * 3 + [_SAMPLE_RADIUS])
        terms.append((prior_term("sample", np.append(sample.center, sample.radius), sigma), False))
        terms.append((prior_term("limb offset", np.zeros(1), np.array([_LIMB_BIAS])), False))
        if abs(sample.center[2] - sample.radius) < 0.01 * sample.radius:
            terms.append((_standing_term(_STANDS * sample.radius), False))
    if "lamp" in values:
        terms.append((prior_term("lamp", values["lamp"], np.array([0.7, 0.3])), False))
    for name, lamp in lamps.items():
        if lamp.kind == "directional" and not lamp.fixed:
            terms.append((prior_term(f"light {name}", values[f"light {name}"], np.ones(3)), False))
    return terms


def _standing_term(sigma: float) -> Term:
    """The sample ball touches the paper: its centre is as high as its radius."""

    def term(values: Values):
        ball = values["sample"]
        return np.array([(ball[2] - ball[3]) / sigma]), {"sample": np.array([[0, 0, 1, -1]]) / sigma}

    return term


def _update(values: Values, sights: list[Sight], scene: Scene | None) -> None:
    for sight in sights:
        sight.pose = block_pose(values[sight.pose_block])


def _review(
    photoset: PhotoSet,
    reader: Reader,
    model: Model,
    values: Values,
    sights: list[Sight],
    lamps: dict[str, Lamp],
    scale: float,
    sure: bool,
) -> float:
    """Drop highlights that are something else, look again where a lamp must be seen; the new scale of errors."""
    camera = model.camera(values["camera"])
    ratios: list[float] = []
    for sight in sights:
        lamp = lamps.get(sight.light)
        if lamp is None:
            continue
        kept = []
        for k in range(len(photoset.mirror_balls)):
            found = next((h for h in sight.highlights if h.ball == k), None)
            expected = expected_pixel(camera, sight, lamp, values, k)
            if sure and (found is None or _wild(found, expected, scale)):
                found = _look_again(photoset, reader, camera, sight, values, k, expected, scale)
            if found is not None:
                kept.append(found)
                ratios += list(np.abs(found.pixel - expected) / found.sigma)
        sight.highlights = kept
    if len(ratios) < 8 or not sure:
        return scale
    return float(np.clip(1.4826 * np.median(ratios), 0.3, 10.0))


def _wild(found, expected: np.ndarray, scale: float) -> bool:
    miss = float(np.hypot(*(found.pixel - expected)))
    return miss > max(_WILD * scale * found.sigma, _WILD_PIXELS)


def _look_again(photoset, reader, camera, sight, values, number, expected, scale):
    image = reader(sight.view)
    if image is None or not np.isfinite(expected).all():
        return None
    block = values[f"ball {number}"]
    ball = MirrorBall(block[:3], float(block[3]))
    found = find_highlight(image, camera, sight.pose, ball, number, near=expected, within=4.0)
    if found is None or _wild(found, expected, scale):
        return None
    return found


def expected_pixel(camera: Camera, sight: Sight, lamp: Lamp, values: Values, number: int) -> np.ndarray:
    """Where a lamp's highlight in a mirror ball belongs, (2,) pixels."""
    from calib.reflect import mirrored_direction, mirrored_point

    block, pose = values[f"ball {number}"], sight.pose
    place = place_in_world(lamp, values[f"light {lamp.name}"], pose)
    if lamp.kind == "directional":
        toward = place / np.linalg.norm(place)
        point = mirrored_direction(block[:3], block[3], pose.center, toward)
    else:
        point = mirrored_point(block[:3], block[3], pose.center, place)
    return camera.project(pose, point[None])[0]


def _misses(
    model: Model, values: Values, sights: list[Sight], lamps: dict[str, Lamp]
) -> dict[str, np.ndarray]:
    camera = model.camera(values["camera"])
    misses: dict[str, list[np.ndarray]] = {}
    for sight in sights:
        if sight.light in lamps:
            for h in sight.highlights:
                expected = expected_pixel(camera, sight, lamps[sight.light], values, h.ball)
                misses.setdefault(sight.light, []).append(h.pixel - expected)
    return {k: np.array(v) for k, v in misses.items()}


def _corner_z(done: Adjusted, count: int) -> float:
    z = np.concatenate(done.residuals[:count]) if count else np.zeros(1)
    return float(np.sqrt(np.mean(np.minimum(z**2, 9.0)))) if len(z) else float("nan")


def start_sample(camera: Camera, sights: list[Sight], sample: object) -> np.ndarray | None:
    """Centre and radius (4,) of a sample ball by its limbs; None for a plane."""
    if not isinstance(sample, Sphere):
        return None
    seen = [(s.pose, s.limb) for s in sights if s.limb is not None and len(s.limb) > 20]
    center, radius = np.asarray(sample.center, float), float(sample.radius)
    if seen:
        center, radius = place_ball(camera, [p for p, _ in seen], [limb for _, limb in seen], center, radius)
    return np.append(center, radius)


def start_scene(
    photoset: PhotoSet, camera: Camera, sights: list[Sight], sample: np.ndarray | None
) -> Scene | None:
    """The things on the board as shading sees them; None where no photo shows enough paper."""
    readings = [s.reading for s in sights if s.reading is not None]
    if not readings or photoset.board is None:
        return None
    size = board_size(photoset.board)
    given = [e.radius for e in photoset.lights if e.radius is not None]
    lamp = float(np.median(given)) if given else 0.02 * float(np.hypot(*size))
    first = next(s for s in sights if s.reading is not None)
    middle = np.append(size / 2, 0.0)
    scale = focal(camera) / np.linalg.norm(first.pose.apply(middle))
    return Scene(
        tuple(Ball(np.asarray(b.center, float), float(b.radius)) for b in photoset.mirror_balls),
        None if sample is None else Ball(sample[:3], float(sample[3])),
        lamp,
        black_over_white(readings),
        0.7 / scale,
    )


def start_lamp(
    photoset: PhotoSet,
    camera: Camera,
    name: str,
    entry: LightEntry | None,
    sights: list[Sight],
    scene: Scene | None,
) -> Lamp | None:
    """A first place for one light; None if nothing tells it."""
    if entry is not None and entry.position is not None:
        source = "camera" if entry.attached_to == "camera" else "given"
        return Lamp(name, entry, "point", np.asarray(entry.position, float), source, fixed=True)
    if entry is not None and entry.direction is not None:
        toward = np.asarray(entry.direction, float)
        return Lamp(name, entry, "directional", toward / np.linalg.norm(toward), "given", fixed=True)
    kind = entry.kind if entry is not None else None
    rays = [ray for s in sights for ray in sight_rays(photoset, camera, s)]
    source = "probe" if any(s.probe and s.highlights for s in sights) else "mirror balls"
    reading = next((s for s in sights if s.reading is not None), None)
    attached = entry is not None and entry.attached_to == "camera"
    if attached:
        rays = [r for r in sight_rays(photoset, camera, sights[0])] if reading is None else []
    if scene is not None and reading is not None and kind != "directional":
        size = board_size(photoset.board)
        diagonal = float(np.hypot(*size))
        own = sight_rays(photoset, camera, reading) if attached else rays
        fit = first_fit(reading.reading, scene, own, np.append(size / 2, 0.0), diagonal)
        if np.linalg.norm(fit.place) < _FAR * diagonal or kind == "point" or not rays:
            reading.shading = fit.local
            place = reading.pose.apply(fit.place) if attached else fit.place
            return Lamp(name, entry, "point", place, source if rays else "board")
    if not rays:
        return None
    span = max(float(np.linalg.norm(b.center)) for b in photoset.mirror_balls) + 1.0
    met = meet(rays, kind, span)
    return Lamp(name, entry, met.kind, met.place, source)


def sight_rays(photoset: PhotoSet, camera: Camera, sight: Sight) -> list[MirroredRay]:
    """The mirrored rays of one photo's highlights."""
    rays = [mirrored_ray(camera, sight.pose, photoset.mirror_balls[h.ball], h) for h in sight.highlights]
    return [r for r in rays if r is not None]


def limb_points(sights: list[Sight]) -> list[Limb]:
    return [s.limb for s in sights if s.limb is not None]
