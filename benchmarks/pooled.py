"""Sets of 5 photos of one rig, alone and with what the other sets say: the error of f that calibration makes.

Set-ups of ``tests.drawn.setups`` share camera, lens, mirror balls' radii and lamp; sample, poses and what stands where
are each set's own, lamps are carried by hand or stand still. Nothing is rendered or fitted, and no paper is read: two
mirror balls tell lamps, a patch their strength. Every point of the ball that a photo shows is given the f that its
calibration makes of the true radiance, and compared with the true f of the directions that it is filed under, below 70
degrees. What a fit adds (directions that were not seen) no pool changes.

python -m benchmarks.pooled [--sets 20] [--seeds 1] [--case N] [--quick]
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from photogonio.batch.ledger import SetEntry
from photogonio.batch.rigs import expectations, rigs_of
from photogonio.calib.adjust.alternate import settle
from photogonio.calib.adjust.rig_values import model_of_rig, refined_camera, told_by, with_rig
from photogonio.calib.adjust.state import State
from photogonio.calib.camera_poses import find_poses, scale_corners
from photogonio.calib.detect.first_look import Photos
from photogonio.calib.detect.photo_reader import Reader, Seen
from photogonio.calib.first_camera import fitted_camera
from photogonio.calib.geometry.pose import Pose
from photogonio.calib.radiometry.readings import read_view
from photogonio.calib.radiometry.scale import tie
from photogonio.calib.remarks import Remarks
from photogonio.calib.rig.gaussian import NOTHING, RigPrior
from photogonio.calib.rig.values import CAMERA
from photogonio.calib.shading.model import Ball
from photogonio.calib.views import light_of
from photogonio.capture.photoset import PhotoSet
from photogonio.evaluate.suite import MATERIALS
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.setups import SIZE, World, draw_corners, draw_patch, draw_world, observe, photoset_of

PHOTOS = 5
KINDS = (
    "lambert",
    "satin-30",
    "oren-nayar-50",
    "plastic-25",
    "metal-30",
    "minnaert",
    "satin-60",
    "schlick-30",
)
LIMIT = np.cos(np.radians(70.0))
POINTS = 400  # on the ball


@dataclass(frozen=True, slots=True)
class Case:
    """How sets of a rig are taken."""

    name: str
    fixed: bool  # the camera does not move within a set
    stands: bool  # lamps stand where they stood in the other sets
    boards: int  # photos of the bare board


CASES = (
    Case("moving camera, lamps by hand", fixed=False, stands=False, boards=0),
    Case("camera still in a set, lamps by hand", fixed=True, stands=False, boards=0),
    Case("camera still in a set, lamps on stands", fixed=True, stands=True, boards=0),
    Case("moving camera, 8 board photos", fixed=False, stands=False, boards=8),
)


def world_of(case: Case, rig: World, seed: Sequence[int]) -> World:
    """One set of a rig."""
    own = draw_world(np.random.default_rng(seed), fixed=case.fixed, views=PHOTOS, boards=max(case.boards, 1))
    balls = tuple(
        Ball(np.append(b.center[:2], b.center[2] + r.radius - b.radius), r.radius)
        for b, r in zip(own.balls, rig.balls, strict=True)
    )
    return replace(
        own,
        camera=rig.camera,
        boards=own.boards[: case.boards],
        lamps=rig.lamps if case.stands else own.lamps,
        strengths=np.full(PHOTOS, rig.strengths[0]),
        balls=balls,
        lamp_radius=rig.lamp_radius,
        corner_noise=rig.corner_noise,
    )


def settled_state(case: Case, world: World, seed: Sequence[int], prior: RigPrior) -> tuple[State, Reader]:
    """The set calibrated, by itself or with what is expected of its rig; the same photos for the same seed."""
    rng = np.random.default_rng([*seed, 1])
    photoset = photoset_of(world, fixed=case.fixed)
    seen = [_seen(photoset, world, role, rng) for role in ("sample", "calibration")]
    photos, remarks = Photos(seen[0], [], seen[1]), Remarks()
    reader = Reader(
        photoset, lambda _, view: draw_patch(world, int(view.name[1:]), np.random.default_rng([*seed, 2]))
    )
    expected = prior.starting(CAMERA)
    if expected is None:
        camera, model, photos = fitted_camera(photos, SIZE, remarks)
    else:
        camera, model = model_of_rig(expected, SIZE)
        camera = refined_camera(
            camera, model, {s.view.name: s.corners for s in seen[0] + seen[1] if s.corners is not None}
        )
    posed, observations = find_poses(photoset, camera, photos, remarks)
    state = State(
        photoset, reader, camera, model, tuple(posed), tuple(observations), remarks, _quiet, rig=prior
    )
    state = scale_corners(with_rig(state))
    drawn = np.random.default_rng([*seed, 3])
    bias = 0.1 * drawn.normal()
    for one in state.observations:
        number = int(one.view.name[1:])
        observe(world, one, number, bias, np.random.default_rng([*seed, 4, number]), paper=False)
    return settle(state), reader


def _quiet(label: str, done: int, total: int) -> None: ...


def _seen(photoset: PhotoSet, world: World, role: str, rng: np.random.Generator) -> list[Seen]:
    poses: Sequence[Pose] = world.views if role == "sample" else world.boards
    things = role == "sample"
    return [
        Seen(view, draw_corners(world, pose, rng, things=things), SIZE)
        for view, pose in zip(photoset.views(role), poses, strict=True)
    ]


def error_of(world: World, state: State, reader: Reader, kind: str) -> float:
    """Relative rms error of f, all photos together."""
    brdf = make_brdf(**_described(kind))
    settled, off, size = state.settled, list[np.ndarray](), list[np.ndarray]()
    lights = {s.view.name: light_of(settled, s) for s in state.observations}
    readings = {
        s.view.name: read_view(state.photoset, reader(s.view), settled, s, lights[s.view.name])
        for s in state.observations
    }
    tied, _ = tie(state.photoset, readings, lights, {n: np.ones(1) for n in readings}, state.remarks)
    sphere = settled.values["sample"]
    for one in state.observations:
        number, light = int(one.view.name[1:]), lights[one.view.name]
        pose, lamp = world.views[number], world.lamps[number]
        place, normal = _points(world.sample)
        i, r, cos_i, cos_r, near = _directions(place, normal, lamp, pose.center)
        rays = settled.camera.world_rays(one.pose, world.camera.project(pose, place))
        there, turned = _on_ball(one.pose.center, rays, sphere)
        i2, r2, cos_i2, cos_r2, near2 = _directions(there, turned, light.place, one.pose.center)
        kept = (cos_i > LIMIT) & (cos_r > LIMIT) & (cos_i2 > LIMIT) & (cos_r2 > LIMIT)
        light_there = world.strengths[number] * near * cos_i / (tied[one.view.name].value[0] * near2 * cos_i2)
        true, filed = (brdf(a[kept], b[kept]).mean(1) for a, b in ((i, r), (i2, r2)))
        weight = np.sqrt((cos_i * cos_r)[kept])
        off.append(weight * (true * light_there[kept] - filed))
        size.append(weight * true)
    return float(np.linalg.norm(np.concatenate(off)) / np.linalg.norm(np.concatenate(size)))


def _described(kind: str) -> dict[str, object]:
    described = dict(MATERIALS[kind])
    return {"model": str(described.pop("model")), "parameters": described, "where": kind}


def _points(ball: Ball) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 3) spread over a ball, and normals."""
    k = np.arange(POINTS) + 0.5
    z, turn = 1.0 - 2.0 * k / POINTS, np.pi * (1.0 + np.sqrt(5.0)) * k
    normal = np.column_stack([np.sqrt(1.0 - z**2) * np.cos(turn), np.sqrt(1.0 - z**2) * np.sin(turn), z])
    return ball.center + ball.radius * normal, normal


def _directions(place: np.ndarray, normal: np.ndarray, lamp: np.ndarray, eye: np.ndarray):
    """Incident and exit directions (n, 3) in frames of the normals, their cosines, and 1 / distance^2 of the lamp."""
    across = np.cross([0.0, 0.0, 1.0], normal)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    frame = np.stack([across, np.cross(normal, across), normal], axis=1)
    local = []
    for point in (lamp, eye):
        toward = point - place
        local.append(np.einsum("nij,nj->ni", frame, toward / np.linalg.norm(toward, axis=1, keepdims=True)))
    near = 1.0 / ((lamp - place) ** 2).sum(1)
    return local[0], local[1], local[0][:, 2], local[1][:, 2], near


def _on_ball(eye: np.ndarray, rays: np.ndarray, sphere: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where rays meet a ball, and the normals there; beside it, the nearest place."""
    from_middle = eye - sphere[:3]
    along = rays @ from_middle
    depth = -along - np.sqrt(np.maximum(along**2 - (from_middle @ from_middle - sphere[3] ** 2), 0.0))
    place = eye + depth[:, None] * rays
    normal = place - sphere[:3]
    return place, normal / np.linalg.norm(normal, axis=1, keepdims=True)


def compared(case: Case, sets: int, seed: int) -> np.ndarray:
    """Errors (sets, 2) alone and pooled."""
    rig = draw_world(np.random.default_rng([seed, 999]), fixed=case.fixed, views=PHOTOS)
    worlds = [world_of(case, rig, [seed, k]) for k in range(sets)]
    alone = [settled_state(case, world, [seed, k], NOTHING) for k, world in enumerate(worlds)]
    entries = [
        SetEntry(f"{k:03d}", "", "done", "", {"marks": {"rig": 1}, "told": _told(state)})
        for k, (state, _) in enumerate(alone)
    ]
    (found,) = rigs_of(entries)
    told = expectations(found, entries)
    errors = []
    for k, (world, (state, reader)) in enumerate(zip(worlds, alone, strict=True)):
        kind = KINDS[k % len(KINDS)]
        both = settled_state(case, world, [seed, k], told[f"{k:03d}"])
        errors.append((error_of(world, state, reader, kind), error_of(world, *both, kind)))
    return np.array(errors)


def _told(state: State) -> list[dict[str, object]]:
    return [
        {
            "name": one.name,
            **{n: getattr(one, n).tolist() for n in ("value", "information", "before", "usual")},
        }
        for one in told_by(state)
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description="sets of 5 photos alone and pooled over sets of one rig")
    parser.add_argument("--sets", type=int, default=20)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first", type=int, default=1, help="number of the first rig")
    parser.add_argument("--case", type=int, choices=range(len(CASES)), help="one of the cases alone, from 0")
    parser.add_argument("--quick", action="store_true", help="four sets of one rig, lamps on stands")
    asked = parser.parse_args()
    sets, cases = (4, CASES[2:3]) if asked.quick else (asked.sets, CASES)
    cases = cases if asked.case is None else (CASES[asked.case],)
    print(f"{PHOTOS} photos a set, {sets} sets a rig: error of f that calibration makes, below 70 degrees")
    print(f"{'':42}{'alone':>18}{'pooled':>18}{'ratio':>16}\n{'':42}{'median   mean':>18}{'median   mean':>18}"
          f"{'median   mean':>16}")  # fmt: skip
    for case in cases:
        for seed in range(asked.first, asked.first + (1 if asked.quick else asked.seeds)):
            found = compared(case, sets, seed)
            (a, b), (c, d) = 100 * np.median(found, axis=0), 100 * found.mean(0)
            print(
                f"{case.name:40}{seed:2}{a:9.3f} %{c:6.3f} %{b:9.3f} %{d:6.3f} %{b / a:9.2f}{d / c:7.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
