"""What a set's photos alone say of its rig, once all has settled; and what is expected of it, as all starts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from photogonio.calib.adjust.bundle import adjust
from photogonio.calib.adjust.camera_model import CameraModel, camera_term, pose_block
from photogonio.calib.adjust.lamps import block_name
from photogonio.calib.adjust.sightings import corner_term
from photogonio.calib.adjust.state import Settled, State
from photogonio.calib.adjust.terms import (
    BALL_RADIUS,
    BEAM_HELD,
    FALLOFF,
    FALLOFF_HELD,
    FREE_BEAM,
    LAMP_SPREAD,
    one_ray_reach,
)
from photogonio.calib.geometry.board import Corners
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.geometry.pose import fit_pose
from photogonio.calib.rig.gaussian import RigExpected, RigPrior, RigTold, told_beside
from photogonio.calib.rig.values import BALL, LAMP, PAPER, TERMS, camera_name, camera_terms, held

BEAM, LENS = 2, slice(3, 5)  # places among the lamp's values
_SURE, _MUCH = 5.0, 0.2  # standard errors, and power of the cosine, at which a rig's lamps have a beam
_ANY_TERM, _ANY_CENTRE = 10.0, 0.25  # of natural size, of the picture's width: what a lens may be at all
_APART = 1e-12  # least eigenvalue of correlations: a thousand times what rounding makes of none
_WHITE, _WHITES = 0.8, 0.3  # reflectance of paper, and error of its logarithm


def told_by(state: State) -> tuple[RigTold, ...]:
    """What the photos of a set that settled say of its rig; nothing of what the manifest states."""
    settled, told = state.settled, list[RigTold]()
    for make in (_camera, _lamp, _balls, _lights, _paper):
        told += make(state, settled)
    return tuple(told)


def _camera(state: State, settled: Settled) -> Iterator[RigTold]:
    covariance = settled.covariance.get("camera")
    if covariance is None or not _proper(covariance):
        return
    model, value = settled.model, settled.values["camera"]
    _, slopes = camera_term(model)(settled.values)
    prior = slopes["camera"].T @ slopes["camera"]
    width = model.size[0]
    mean = np.concatenate([[value[0]] * 2, (np.array(model.size) - 1) / 2, np.zeros(len(model.free))])
    any_lens = [value[0], value[0], *[_ANY_CENTRE * width] * 2, *(_ANY_TERM * TERMS[list(model.free)])]
    told = told_beside(camera_name(model.free), value, covariance, mean, prior)
    yield replace(told, usual=prior + np.diag(np.array(any_lens) ** -2.0))


def _lamp(state: State, settled: Settled) -> Iterator[RigTold]:
    covariance = settled.covariance.get("lamp")
    if not settled.shading or covariance is None or not _proper(covariance):
        return
    value, free = settled.values["lamp"], np.array([*LAMP_SPREAD, FREE_BEAM, *FALLOFF])
    lens = FALLOFF if any(state.falloff) else (FALLOFF_HELD, FALLOFF_HELD)
    sigma = np.array([*LAMP_SPREAD, BEAM_HELD if state.narrow == 0.0 else FREE_BEAM, *lens])
    mean = np.append(value[:2], np.zeros(3))
    told = told_beside(LAMP, value, covariance, mean, np.diag(sigma**-2.0))
    yield replace(told, usual=np.diag(free**-2.0))


def _balls(state: State, settled: Settled) -> Iterator[RigTold]:
    for k, ball in enumerate(state.photoset.mirror_balls):
        covariance = settled.covariance.get(f"{BALL} {k}")
        if covariance is None or not _proper(covariance):
            continue
        radius = float(settled.values[f"{BALL} {k}"][3])
        variance = covariance[3:, 3:] / radius**2
        mean, prior = np.log([ball.radius]), np.array([[BALL_RADIUS**-2.0]])
        yield told_beside(f"{BALL} {k}", np.log([radius]), variance, mean, prior)


def _lights(state: State, settled: Settled) -> Iterator[RigTold]:
    for name, lamp in settled.lamps.items():
        block = block_name(name)
        covariance = settled.covariance.get(block)
        if covariance is None or lamp.kind != "point" or lamp.fixed or lamp.attached or lamp.place_sigma > 0:
            continue
        if not _proper(covariance):
            continue
        reach = one_ray_reach(lamp)
        prior = np.eye(3) * (reach**-2.0 if lamp.one_ray else 0.0)
        told = told_beside(block, settled.values[block], covariance, np.asarray(lamp.block, float), prior)
        yield replace(told, usual=np.eye(3) / (10.0 * reach) ** 2)


def _paper(state: State, settled: Settled) -> Iterator[RigTold]:
    white = np.array(state.remarks.residuals.get("paper_reflectance", []), float)
    if not len(white) or (white <= 0).any():
        return
    error = np.array(state.remarks.residuals["paper_reflectance_error"], float) / white
    one = np.eye(len(white))
    prior = np.log(np.full(len(white), _WHITE)), one / _WHITES**2
    yield RigTold(PAPER, np.log(white), np.diag(error**-2.0), *prior)


def _proper(covariance: np.ndarray) -> bool:
    """Whether it can be inverted: lens terms that stand for one another leave sums of them untold but for rounding."""
    variance = np.diag(covariance)
    if not np.isfinite(covariance).all() or not (variance > 0.0).all():
        return False
    return bool(np.linalg.eigvalsh(covariance / np.sqrt(np.outer(variance, variance)))[0] > _APART)


def with_rig(state: State) -> State:
    """The state as its rig is expected to be: the lens darkens its pictures as those of other sets, and the lamps have
    a beam if theirs surely have one."""
    lamp = state.rig.get(LAMP)
    if lamp is None:
        return state
    error = float(np.sqrt(lamp.covariance[BEAM, BEAM]))
    if abs(lamp.value[BEAM]) < max(_MUCH, _SURE * error):
        lamp = held(lamp, [BEAM], BEAM_HELD)
        lamp = replace(lamp, value=np.where(np.arange(5) == BEAM, 0.0, lamp.value))
    if state.photoset.radiometry.vignetting != "auto":
        lamp = held(lamp, [3, 4], FALLOFF_HELD)
        lamp = replace(lamp, value=np.where(np.arange(5) >= LENS.start, 0.0, lamp.value))
    others = tuple(one for one in state.rig.expected if one.name != LAMP)
    first, second = lamp.value[LENS].tolist()
    return replace(
        state, rig=RigPrior((*others, lamp)), narrow=float(lamp.value[BEAM]), falloff=(first, second)
    )


def model_of_rig(expected: RigExpected, size: tuple[int, int]) -> tuple[Camera, CameraModel]:
    """The camera that other sets lead one to expect, and how sure it is."""
    free = camera_terms(expected.name)
    lens = np.zeros(8 if max(free, default=0) > 4 else 5)
    model = CameraModel(size, lens, free, expected=expected)
    camera = model.camera(expected.value)
    return camera, replace(model, distortion=camera.distortion)


def refined_camera(camera: Camera, model: CameraModel, photos: Mapping[str, Corners]) -> Camera:
    """The camera that is expected, as far as the photos' corners change it."""
    posed = {name: (corners, fit) for name, corners in photos.items() if (fit := fit_pose(camera, corners))}
    values = {"camera": model.block(camera)} | {n: pose_block(fit.pose) for n, (_, fit) in posed.items()}
    terms = [(corner_term(model, n, corners.keep(fit.inlier)), True) for n, (corners, fit) in posed.items()]
    return model.camera(adjust(values, [*terms, (camera_term(model), False)]).values["camera"])
