"""The terms of the adjustment that the photos and the manifest of a set give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from photogonio.calib.adjust.bearing import Bearing
from photogonio.calib.adjust.bundle import (
    Derivatives,
    Part,
    Term,
    Values,
    expected_term,
    prior_term,
    quadratic_term,
)
from photogonio.calib.adjust.camera_model import CameraModel, block_pose, camera_term, pose_block
from photogonio.calib.adjust.lamps import Lamp, block_name, middle_of
from photogonio.calib.adjust.sightings import Sighting, corner_term, highlight_term, limb_term
from photogonio.calib.adjust.state import State
from photogonio.calib.detect.observation import FIXED_POSE, Observation, Posed
from photogonio.calib.geometry.board import millimetre
from photogonio.calib.rig.gaussian import RigPrior
from photogonio.calib.rig.values import BALL as MIRROR
from photogonio.calib.rig.values import LAMP
from photogonio.calib.setup import PrintTone
from photogonio.calib.shading.fit import ShadingFit
from photogonio.calib.shading.model import ShadingScene
from photogonio.calib.shading.parameters import BALL, LOCAL, SHARED
from photogonio.capture.photoset import PhotoSet, Sphere

BALL_PLACE = 0.02  # of a mirror ball's radius: how well the manifest places it
BALL_RADIUS = 0.003
SAMPLE_PLACE = 0.03  # of the sample's radius
_SAMPLE_RADIUS = 0.004
_STANDS = 0.002  # of its radius: how well a ball that stands on the paper touches it
_LIMB_BIAS = 0.1  # pixels
LAMP_SPREAD = (0.7, 0.3)  # of the logarithms of the lamp's radius, and of black print over white
# millimetres beside the lens, and before it or behind: a telephone's flash; a camera's may stand elsewhere: robust
BESIDE_LENS = (20.0, 20.0, 6.0)
BEAM_HELD, FREE_BEAM = 0.02, 1.5  # of the power of the cosine with which lamps shine: taken as none, and free
FALLOFF_HELD, FALLOFF = 0.002, (0.5, 0.1)  # of the terms of how a lens darkens its pictures, likewise


def first_values(
    state: State,
    observations: list[Observation],
    lamps: dict[str, Lamp],
    scene: ShadingScene | None,
    sample: np.ndarray | None,
) -> Values:
    """All blocks where the stages before have put them."""
    values: Values = {"camera": state.model.block(state.camera)}
    values |= {name: pose_block(pose) for name, _, pose in state.boards}
    values |= {observation.pose_block: pose_block(observation.pose) for observation in observations}
    values |= {block_name(name): np.asarray(lamp.block, float) for name, lamp in lamps.items()}
    for k, ball in enumerate(state.photoset.mirror_balls):
        values[f"ball {k}"] = np.append(np.asarray(ball.center, float), ball.radius)
    if sample is not None:
        values["sample"] = sample
    values["limb offset"] = np.zeros(1)
    if scene is not None:
        values["lamp"] = scene.shared[4:SHARED]
    return values


def fixed_blocks(photoset: PhotoSet, lamps: dict[str, Lamp]) -> frozenset[str]:
    """Blocks that the manifest states."""
    fixed = {block_name(n) for n, lamp in lamps.items() if lamp.fixed}
    if photoset.camera.matrix is not None:
        fixed.add("camera")
    if photoset.camera.rotation is not None:
        fixed.add(FIXED_POSE)
    return frozenset(fixed)


def sightings(observations: list[Observation], lamps: dict[str, Lamp], scale: float) -> list[Sighting]:
    """Every highlight, its stated error times ``scale``."""
    return [
        Sighting(
            s.pose_block,
            block_name(s.light),
            f"ball {h.ball}",
            lamps[s.light].kind == "directional",
            lamps[s.light].attached,
            h.pixel,
            scale * h.sigma,
        )
        for s in observations
        if s.light in lamps
        for h in s.highlights
    ]


def corner_terms(
    model: CameraModel, boards: Sequence[Posed], observations: list[Observation]
) -> list[tuple[Term, bool]]:
    """The board's corners in all photos."""
    terms = [(corner_term(model, name, corners), True) for name, corners, _ in boards]
    return terms + [
        (corner_term(model, s.pose_block, s.corners), True) for s in observations if s.corners is not None
    ]


def all_terms(
    state: State,
    observations: list[Observation],
    lamps: dict[str, Lamp],
    values: Values,
    fits: dict[str, ShadingFit],
    scale: float,
) -> list[tuple[Term, bool]]:
    """Every term, with whether its loss is robust; the corners' come first, one a photo. Lamps may shine less beside
    their axis, and pictures be darker aside of their middle, where the state says that they do."""
    model = state.model
    terms = corner_terms(model, state.boards, observations)
    seen, middle = sightings(observations, lamps, scale), middle_of(state.photoset)
    if seen:
        terms.append((highlight_term(model, seen), True))
    for s in observations:
        if s.limb is not None and len(s.limb):
            terms.append((limb_term(model, s.pose_block, "sample", s.limb.pixels, s.limb.sigma), True))
        for number, limb in s.ball_limbs.items():
            terms.append((limb_term(model, s.pose_block, f"ball {number}", limb.pixels, limb.sigma), True))
        if s.view.name in fits and not _by_print(state, lamps[s.light]):
            terms.append((shading_term(fits[s.view.name], s, lamps[s.light], values, middle), False))
    terms.append((camera_term(model), False))
    if state.tone is not None and (told := tone_term(state.tone, lamps)) is not None:
        terms.append((told, False))
    terms += _expectations(state.photoset, values, state.rig)
    return (
        terms
        + _shared_lamp(state, values)
        + _lamp_expectations(lamps, values, state.rig, millimetre(state.photoset))
    )


def shading_term(
    fit: ShadingFit, observation: Observation, lamp: Lamp, values: Values, middle: np.ndarray
) -> Term:
    """What one view's shading says of lamp, sample, print and polished balls, its own values eliminated. Of the lamp it
    tells how it is seen from the ``middle`` (3,) of the board."""
    has_sample = "sample" in values
    own = slice(3, LOCAL)
    kept = np.r_[0:3, (LOCAL if has_sample else LOCAL + BALL) : len(fit.normal)]
    balls = [f"ball {k}" for k in range((len(fit.normal) - LOCAL - SHARED) // BALL)]
    cross = np.linalg.solve(fit.normal[own, own], fit.normal[own][:, kept])
    normal = fit.normal[np.ix_(kept, kept)] - fit.normal[kept][:, own] @ cross
    slope = fit.gradient[kept] - cross.T @ fit.gradient[own]
    light = Part(block_name(observation.light), slice(0, 3), bearing=Bearing(middle, fit.place))
    if lamp.attached:
        pose = block_pose(values[observation.pose_block]).inverse()
        light = replace(light, turn=pose.rotation, shift=pose.translation)
    parts = (
        [light] + ([Part("sample", slice(0, 4))] if has_sample else []) + [Part("lamp", slice(0, SHARED - 4))]
    )
    parts += [Part(ball, slice(0, BALL)) for ball in balls]
    at = np.concatenate([fit.place] + [values[p.block][p.where] for p in parts[1:]])
    return quadratic_term(parts, at, normal, slope)


def _by_print(state: State, lamp: Lamp) -> bool:
    """Whether print told a lamp that moves with the camera with its tone curve: the little of its shadows that a camera
    beside it sees lies along the ball's edge, where such photos are sharpened."""
    return state.tone is not None and lamp.attached and lamp.name in state.tone.lamps


def tone_term(tone: PrintTone, lamps: dict[str, Lamp]) -> Term | None:
    """What print told of lamps with a tone curve: of those that are still sought as points. None: of none."""
    free = {name for name, lamp in lamps.items() if lamp.kind == "point" and not lamp.fixed}
    sought = [k for k, name in enumerate(tone.lamps) if name in free]
    if not sought:
        return None
    kept = np.concatenate([3 * k + np.arange(3) for k in sought])
    mean, blocks = tone.places[sought].ravel(), [block_name(tone.lamps[k]) for k in sought]
    root = np.linalg.inv(np.linalg.cholesky(tone.covariance[np.ix_(kept, kept)]))

    def term(values: Values) -> tuple[np.ndarray, Derivatives]:
        now = np.concatenate([values[name] for name in blocks])
        return root @ (now - mean), {name: root[:, 3 * k : 3 * k + 3] for k, name in enumerate(blocks)}

    return term


def _expectations(photoset: PhotoSet, values: Values, rig: RigPrior) -> list[tuple[Term, bool]]:
    """What the manifest, and other sets of the rig, lead one to expect of balls and sample."""
    terms: list[tuple[Term, bool]] = [(prior_term("limb offset", np.zeros(1), np.array([_LIMB_BIAS])), False)]
    for k, ball in enumerate(photoset.mirror_balls):
        radius, error = float(ball.radius), BALL_RADIUS
        if (known := rig.get(f"{MIRROR} {k}")) is not None:
            radius, error = float(np.exp(known.value[0])), float(np.sqrt(known.covariance[0, 0]))
        sigma = radius * np.array([BALL_PLACE] * 3 + [error])
        terms.append((prior_term(f"ball {k}", np.append(ball.center, radius), sigma), True))
    sample = photoset.sample
    if "sample" in values and isinstance(sample, Sphere):
        sigma = sample.radius * np.array([SAMPLE_PLACE] * 3 + [_SAMPLE_RADIUS])
        terms.append((prior_term("sample", np.append(sample.center, sample.radius), sigma), False))
        if photoset.board is not None and abs(sample.center[2] - sample.radius) < 0.01 * sample.radius:
            terms.append((_standing_term(_STANDS * sample.radius), False))
    return terms


def _shared_lamp(state: State, values: Values) -> list[tuple[Term, bool]]:
    """What is expected of what all lamps share, of print and lens."""
    if "lamp" not in values:
        return []
    if (known := state.rig.get(LAMP)) is not None:
        return [(expected_term("lamp", known.value, known.root), False)]
    lens = FALLOFF if any(state.falloff) else (FALLOFF_HELD, FALLOFF_HELD)
    spread = [*LAMP_SPREAD, FREE_BEAM if state.narrow != 0.0 else BEAM_HELD, *lens]
    mean = np.append(values["lamp"][:2], np.zeros(3))
    return [(prior_term("lamp", mean, np.array(spread)), False)]


def _lamp_expectations(
    lamps: dict[str, Lamp], values: Values, rig: RigPrior, unit: float = 1.0
) -> list[tuple[Term, bool]]:
    """What is expected of each lamp's place; ``unit``: one millimetre."""
    terms: list[tuple[Term, bool]] = []
    for name, lamp in lamps.items():
        block = block_name(name)
        if lamp.fixed:
            continue
        if lamp.kind == "directional":
            terms.append((prior_term(block, values[block], np.ones(3)), False))
        elif lamp.place_sigma > 0:
            terms.append((prior_term(block, lamp.block, np.full(3, lamp.place_sigma)), False))
        elif (known := rig.get(block)) is not None and not lamp.attached:
            terms.append((expected_term(block, known.value, known.root), False))
        elif lamp.attached:
            terms.append((prior_term(block, np.zeros(3), unit * np.array(BESIDE_LENS)), True))
        elif lamp.one_ray:
            terms.append((prior_term(block, lamp.block, np.full(3, one_ray_reach(lamp))), False))
    return terms


def one_ray_reach(lamp: Lamp) -> float:
    """Standard error of the place of a lamp of which one ray alone is known."""
    return 0.3 * float(np.linalg.norm(lamp.block))


def _standing_term(sigma: float) -> Term:
    """The sample ball touches the paper: its centre is as high as its radius."""

    def term(values: Values) -> tuple[np.ndarray, Derivatives]:
        ball = values["sample"]
        return np.array([(ball[2] - ball[3]) / sigma]), {"sample": np.array([[0, 0, 1, -1]]) / sigma}

    return term
