"""Lamps, mirror balls, sample, poses and camera settled together, in a few rounds of shading and adjustment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from photogonio.calib.adjust.bundle import Adjusted, Values, adjust
from photogonio.calib.adjust.camera_model import block_pose
from photogonio.calib.adjust.lamp_steps import as_moved, within_reach
from photogonio.calib.adjust.lamps import (
    Lamp,
    as_distant,
    block_name,
    expected_pixel,
    middle_of,
    place_in_world,
    sight_rays,
    start_lamps,
    told_lamps,
)
from photogonio.calib.adjust.start import start_sample, start_scene
from photogonio.calib.adjust.state import Settled, State
from photogonio.calib.adjust.terms import all_terms, first_values, fixed_blocks
from photogonio.calib.detect.highlights import Highlight, ball_box, find_highlight, pixels_near
from photogonio.calib.detect.mirror_rays import MirroredRay, meet
from photogonio.calib.detect.observation import Observation
from photogonio.calib.geometry.board import board_size
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.rig.values import LAMP
from photogonio.calib.shading.correction import NO_FALLOFF
from photogonio.calib.shading.fit import (
    ShadingFit,
    Stand,
    fits_better,
    pooled_ink,
    pooled_patches,
    shading_of,
    stepped,
)
from photogonio.calib.shading.model import USUAL_PATCHES, LitPaper, ShadingScene
from photogonio.calib.shading.model_error import pooled
from photogonio.calib.shading.sights import Sights
from photogonio.capture import robust
from photogonio.capture.photoset import MirrorBall

_STEPS = (8, 3, 3, 3)  # of each view's own shading fit in each round: the adjustment does the rest
_MORE = (3, 3)  # the same, where a view was left astray
_ENOUGH_STEPS = 8  # in which fits come near enough to their ends to be compared, mostly
_ROUGH = 3000  # samples for the way there
# of a lamp's distance: where balls and shading differ as much, a fit is tried from where the balls show it
_ELSEWHERE = 0.02
_PARALLEL = 10.0  # of the board's size: from where rays of two balls on it are as good as parallel
_WILD = 6.0  # standard errors at which a highlight is taken for something else
_WILD_PIXELS = 2.5
_LOOK_AGAIN = 4.0  # pixels around the place where a highlight must be
_ENOUGH = 8  # highlights' coordinates that tell how large their errors are


@dataclass(slots=True)
class _Round:
    """What a round of settling starts from, and leaves."""

    state: State
    observations: list[Observation]
    lamps: dict[str, Lamp]
    values: Values
    scene: ShadingScene | None
    scale: float = 1.0  # of the highlights' stated errors
    fits: dict[str, ShadingFit] = field(default_factory=dict)
    sights: dict[str, list[MirroredRay]] = field(default_factory=dict)  # by view: what its highlights say

    @property
    def camera(self) -> Camera:
        return self.state.model.camera(self.values["camera"])


def settle(state: State, longer: bool = False) -> State:
    """Everything settled together, from what observations hold: corners, highlights, limbs and paper.

    Rounds of: fit every view's shading; adjust all together; look at the highlights again. ``longer``: half as many
    more.
    """
    observations = state.started_over()
    first = {one.view.name: tuple(one.highlights) for one in observations}
    now = _started(state, observations)
    fixed = fixed_blocks(state.photoset, now.lamps)
    asked: dict[str, np.ndarray] = {}  # where views' fits were last tried from besides
    rounds = _STEPS + _MORE if longer else _STEPS
    for number, steps in enumerate(rounds):
        if now.scene is not None:
            now.sights = _rays(now, first)
            shown = _by_highlights(now)
            new = {k: v for k, v in shown.items() if k not in asked or _apart(v, asked[k])}
            tried = _shade(now, now.scene, steps, new)
            asked |= {name: shown[name] for name in tried}
            fits = now.fits.values()
            white = pooled_patches(fits, USUAL_PATCHES)
            now.scene = replace(now.scene, error=pooled(fit.shown for fit in fits), patches=white)
            if not now.scene.bent:  # a curve that print told was fitted to black print, and hides its error
                now.scene = replace(now.scene, ink=pooled_ink(fits, now.scene.ink))
        terms = all_terms(state, observations, now.lamps, now.values, now.fits, now.scale)
        middle, shaded = middle_of(state.photoset), _shaded_places(now)
        places = [block_name(n) for n, one in now.lamps.items() if one.kind == "point" and not one.attached]
        done = adjust(now.values | shaded, terms, fixed, middle, places)
        moved = within_reach((now.values, shaded), done.values, now.lamps, middle)
        done = as_moved(done, moved, middle)
        now.values = done.values
        for observation in observations:
            observation.pose = block_pose(now.values[observation.pose_block])
        if now.fits:  # only where lamps are sure without the highlights
            _review(now)
        state.tell("settling", number + 1, len(rounds))
    return replace(
        state,
        observations=tuple(observations),
        settled_or_none=_at_rest(now, done),
        highlights=first if state.highlights is None else state.highlights,
    )


def _started(state: State, observations: list[Observation]) -> _Round:
    """First values of everything."""
    photoset, camera = state.photoset, state.camera
    sample = start_sample(camera, observations, photoset.sample)
    scene = start_scene(photoset, camera, observations, sample)
    if scene is not None:
        scene = replace(scene, narrow=state.narrow, falloff=state.falloff, bent=state.tone is not None)
        if (known := state.rig.get(LAMP)) is not None:
            radius, black = np.exp(known.value[:2]).tolist()
            scene = replace(scene, lamp_radius=radius, black=black)
    groups: dict[str, list[Observation]] = {}
    for observation in observations:
        groups.setdefault(observation.light, []).append(observation)
    wanted = {name: members for name, members in groups.items() if any(not s.probe for s in members)}
    told = told_lamps(photoset, wanted, state.tone)
    untold = {name: members for name, members in wanted.items() if name not in told}
    found = told | start_lamps(photoset, camera, untold, scene, state.tell, state.reader.workers)
    lamps = {name: found[name] for name in wanted if name in found}
    values = first_values(state, observations, lamps, scene, sample)
    return _Round(state, observations, lamps, values, scene)


def _at_rest(now: _Round, done: Adjusted) -> Settled:
    state, camera = now.state, now.camera
    photos = len(state.boards) + sum(s.corners is not None for s in now.observations)
    covariance = _distant_lamps(now, done.covariance)
    return Settled(
        camera,
        state.model,
        now.values,
        covariance,
        now.lamps,
        _misses(now, camera),
        now.fits,
        None if now.scene is None else _as_taken(_present(now.scene, now.values), state),
        _corner_rms(done, photos),
        now.scale,
    )


def _distant_lamps(now: _Round, covariance: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Lamps that turn out to be distant are directions from now on; the covariance of all blocks then."""
    lamps, values, found = dict(now.lamps), dict(now.values), dict(covariance)
    for name, lamp in now.lamps.items():
        block = block_name(name)
        place, error = values[block], covariance.get(block, np.zeros((3, 3)))
        distant = as_distant(now.state.photoset, lamp, place, error)
        if distant is not None:
            lamps[name], values[block], found[block] = distant
    now.lamps, now.values = lamps, values
    return found


def _shaded_places(now: _Round) -> Values:
    """Where this round's fits of shading ended, by block, in the mean of a lamp's views."""
    found: dict[str, list[np.ndarray]] = {}
    told = () if now.state.tone is None else now.state.tone.lamps  # by print, better than by paper's falloff
    for one in now.observations:
        if one.view.name in now.fits and one.light not in told:
            place, lamp = now.fits[one.view.name].place, now.lamps[one.light]
            found.setdefault(block_name(one.light), []).append(
                one.pose.apply(place) if lamp.attached else place
            )
    return {block: np.mean(places, axis=0) for block, places in found.items()}


def _present(scene: ShadingScene, values: Values) -> ShadingScene:
    """The scene at the present values."""
    sphere = values["sample"] if scene.sample is not None else scene.shared[:4]
    balls = [values[f"ball {k}"] for k in range(len(scene.polished))]
    return scene.moved(np.concatenate([sphere, values["lamp"], *balls]))


def _as_taken(scene: ShadingScene, state: State) -> ShadingScene:
    """Without what was held about none: a lamp's beam, a lens that darkens its pictures."""
    narrow = scene.narrow if state.narrow != 0.0 else 0.0
    return replace(scene, narrow=narrow, falloff=scene.falloff if any(state.falloff) else NO_FALLOFF)


def _rays(now: _Round, first: dict[str, tuple[Highlight, ...]]) -> dict[str, list[MirroredRay]]:
    """Rays toward the lamps by view, from the mirror balls as they now stand: by the highlights seen at ``first`` where
    they were dropped since, which a lamp that went astray does to the right ones."""
    photoset, camera = now.state.photoset, now.camera
    blocks = [now.values[f"ball {k}"] for k in range(len(photoset.mirror_balls))]
    moved = replace(photoset, mirror_balls=tuple(MirrorBall(b[:3], float(b[3])) for b in blocks))
    found = {}
    for observation in now.observations:
        seen = max(
            observation.highlights, first[observation.view.name], key=lambda one: len({h.ball for h in one})
        )
        found[observation.view.name] = sight_rays(moved, camera, replace(observation, highlights=list(seen)))
    return found


def _by_highlights(now: _Round) -> dict[str, np.ndarray]:
    """Places (3,) of the lamps by view, where two mirror balls or more tell by themselves: where their rays meet, or,
    of lamps far away, whose rays meet anywhere, as far as they are now taken to be."""
    middle, board, found = middle_of(now.state.photoset), now.state.photoset.board, {}
    for observation in now.observations:
        rays, lamp = now.sights[observation.view.name], now.lamps.get(observation.light)
        if len({ray.ball for ray in rays}) < 2:
            continue
        met = meet(rays, "point", 1.0).place
        if board is not None and lamp is not None and lamp.kind == "point" and not lamp.attached:
            reach = float(np.linalg.norm(now.values[block_name(lamp.name)] - middle))
            if reach > _PARALLEL * board_size(board).max():
                met = middle + reach * meet(rays, "directional", 1.0).place
        found[observation.view.name] = met
    return found


def _shade(now: _Round, scene: ShadingScene, steps: int, shown: dict[str, np.ndarray]) -> list[str]:
    """Fit every near view's shading at the present values; the views that were tried from where the balls show it.

    Where the mirror balls show (``shown``) a lamp elsewhere the fit is tried from there too: robust weights can settle
    on a place whose shadows fall beside those in the photo, and take the difference for dirt. So it is from where the
    round before had it, if that is not where the fit ends: the adjustment's step may have been too long for shadows.
    """
    scene, lamps, values = _present(scene, now.values), now.lamps, now.values

    def fit(observation: Observation) -> tuple[ShadingFit | None, bool]:
        lamp, reading = lamps.get(observation.light), observation.reading
        if reading is None or lamp is None or lamp.kind != "point" or lamp.fixed:
            return None, False
        pose = block_pose(values[observation.pose_block])
        place = place_in_world(lamp, values[block_name(lamp.name)], pose)
        if place[2] <= 0 and observation.shading is not None:  # under the board: nothing is lit from there
            place = observation.shading[:3]
        if place[2] <= 0:
            return None, False
        start = place if observation.shading is None else np.concatenate([place, observation.shading[3:]])
        few, last = reading.thinned(_ROUGH), steps
        sights = Sights.of(now.sights.get(observation.view.name, ()), now.scale)
        if steps > _STEPS[-1] and few is not reading:  # while its end is far few samples show where that is
            start, last = stepped(LitPaper.of(few, sights), scene, start, steps).local, _STEPS[-1]
        found = stepped(LitPaper.of(reading, sights), scene, start, last)
        others, other = [], shown.get(observation.view.name)
        if other is not None and other[2] > 0 and not lamp.attached and _apart(other, found.local[:3]):
            others.append(other)
        asked = bool(others)
        if observation.shading is not None and _turned(observation.shading[:3], found.local[:3]):
            others.append(observation.shading[:3])
        return shading_of(_best(found, others) if others else found), asked

    now.fits, tried = {}, []
    found = now.state.reader.abreast(fit, now.observations)
    for observation, (one, again) in zip(now.observations, found, strict=True):
        if one is not None:
            observation.shading = one.local
            now.fits[observation.view.name] = one
        if again:
            tried.append(observation.view.name)
    return tried


def _best(found: Stand, starts: Sequence[np.ndarray]) -> Stand:
    """The best of what is ``found`` and fits from ``starts``, by some of the samples, which tell one end from another:
    all with steps enough, for a fit that is under way is no match for one that has ended. One that comes to where the
    best one has ended is no other; the best is fitted to its end by all samples, if that is not what was found."""
    board, scene, few = found.board, found.scene, found.board.reading.thinned(_ROUGH)
    some = few is not board.reading
    board = LitPaper.of(few, board.sights) if some else board
    best = found if found.ended and not some else stepped(board, scene, found.local, _ENOUGH_STEPS)
    for start in starts:
        one = stepped(board, scene, start, _ENOUGH_STEPS, best)
        best = one if not best.reached_by(one.values) and fits_better(one, best) else best
    if best.reached_by(found.values):
        return found
    return stepped(found.board, scene, best.local, _ENOUGH_STEPS) if some else best


def _turned(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two places lie in different directions; far away the distance means little."""
    return _apart(one / np.linalg.norm(one), other / np.linalg.norm(other))


def _apart(one: np.ndarray, other: np.ndarray) -> bool:
    return bool(np.linalg.norm(one - other) >= _ELSEWHERE * np.linalg.norm(other))


def _review(now: _Round) -> None:
    """Drop highlights that are something else, look again where a lamp must be seen; the new scale of errors."""
    camera, scale, ratios = now.camera, now.scale, []
    for observation in now.observations:
        lamp = now.lamps.get(observation.light)
        if lamp is None:
            continue
        kept = []
        for k in range(len(now.state.photoset.mirror_balls)):
            found = next((h for h in observation.highlights if h.ball == k), None)
            expected = expected_pixel(camera, observation, lamp, now.values, k)
            if found is None or _wild(found, expected, scale):
                found = _look_again(now, camera, observation, k, expected)
                found = None if found is None or _wild(found, expected, scale) else found
            if found is not None:
                kept.append(found)
                ratios += list(np.abs(found.pixel - expected) / found.sigma)
        observation.highlights = kept
    if len(ratios) >= _ENOUGH:
        now.scale = float(np.clip(robust.deviation(np.array(ratios)), 0.3, 10.0))


def _wild(found: Highlight, expected: np.ndarray, scale: float) -> bool:
    miss = float(np.hypot(*(found.pixel - expected)))
    return miss > max(_WILD * scale * found.sigma, _WILD_PIXELS)


def _look_again(
    now: _Round, camera: Camera, observation: Observation, number: int, expected: np.ndarray
) -> Highlight | None:
    block = now.values[f"ball {number}"]
    ball = MirrorBall(block[:3], float(block[3]))
    x0, y0, x1, y1 = box = ball_box(camera, observation.pose, ball)
    if not np.isfinite(expected).all() or x0 >= x1 or y0 >= y1:
        return None
    image = now.state.reader.part(observation.view, box)
    if image is None:
        return None
    near = pixels_near(camera, observation.pose, ball, expected, _LOOK_AGAIN)
    return find_highlight(image, camera, observation.pose, ball, number, near)


def _misses(now: _Round, camera: Camera) -> dict[str, np.ndarray]:
    misses: dict[str, list[np.ndarray]] = {}
    for observation in now.observations:
        if observation.light in now.lamps:
            for h in observation.highlights:
                lamp = now.lamps[observation.light]
                expected = expected_pixel(camera, observation, lamp, now.values, h.ball)
                misses.setdefault(observation.light, []).append(h.pixel - expected)
    return {k: np.array(v) for k, v in misses.items()}


def _corner_rms(done: Adjusted, count: int) -> float:
    """Rms of the first ``count`` terms' residuals, outliers cut."""
    if not count:
        return float("nan")
    z = np.concatenate(done.residuals[:count])
    return float(np.sqrt(np.mean(np.minimum(z**2, 9.0)))) if len(z) else float("nan")
