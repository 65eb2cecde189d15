"""Do the stated 95 % intervals of a calibration hold the truth 95 times in a hundred?

Set-ups of ``tests.drawn.setups`` go through the solvers of ``calib`` from the first camera to the lamps' strengths, and
``python -m benchmarks.coverage`` counts how often each quantity's interval holds the truth.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from photogonio.calib.adjust.alternate import settle
from photogonio.calib.adjust.camera_model import pose_block
from photogonio.calib.adjust.lamps import block_name
from photogonio.calib.adjust.state import State
from photogonio.calib.camera_poses import find_poses, scale_corners
from photogonio.calib.detect.first_look import Photos
from photogonio.calib.detect.observation import Observation
from photogonio.calib.detect.photo_reader import Reader, Seen
from photogonio.calib.first_camera import fitted_camera
from photogonio.calib.geometry.camera import Pose
from photogonio.calib.radiometry.readings import read_view
from photogonio.calib.radiometry.scale import tie
from photogonio.calib.remarks import Remarks
from photogonio.calib.views import light_of
from photogonio.capture.photoset import PhotoSet, View
from photogonio.evaluate.scenes import spread_over_processes
from tests.drawn.setups import SAMPLE, SIZE, World, draw_corners, draw_patch, draw_world, observe, photoset_of

LEVEL = 0.95
WIDE = 1.959964  # standard errors on either side


@dataclass(frozen=True, slots=True)
class Deviation:
    """How far one stated quantity is off, in its stated standard errors."""

    what: str
    z: float


def deviations(seed: int, *, paper: bool = False, views: int = 8) -> list[Deviation]:
    """One set-up drawn, calibrated, and compared with the truth."""
    rng = np.random.default_rng(seed)
    fixed = bool(seed % 2)
    world = draw_world(rng, fixed=fixed, views=views)
    photoset = photoset_of(world, fixed=fixed)
    samples = [
        (v, draw_corners(world, p, rng, things=True)) for v, p in _paired(photoset, "sample", world.views)
    ]
    boards = [
        (v, draw_corners(world, p, rng, things=False))
        for v, p in _paired(photoset, "calibration", world.boards)
    ]
    photos = Photos([Seen(v, c, SIZE) for v, c in samples], [], [Seen(v, c, SIZE) for v, c in boards])
    remarks, reader = (
        Remarks(),
        Reader(photoset, lambda _, view: draw_patch(world, int(view.name[1:]), rng, bounced=paper)),
    )
    camera, model, photos = fitted_camera(photos, SIZE, remarks)
    posed, observations = find_poses(photoset, camera, photos, remarks)
    quiet = lambda label, done, total: None  # noqa: E731
    state = scale_corners(
        State(photoset, reader, camera, model, tuple(posed), tuple(observations), remarks, quiet)
    )
    bias = 0.1 * rng.normal()
    for observation in state.observations:
        observe(world, observation, int(observation.view.name[1:]), bias, rng, paper=paper)
    state = settle(state)
    settled, observations = state.settled, list(state.observations)
    found = [
        *_camera_z(world, settled),
        *_pose_z(world, settled, observations),
        *_light_z(world, settled, observations),
    ]
    return [
        *found,
        *_sample_z(world, settled),
        *_strength_z(world, photoset, settled, observations, reader, remarks),
    ]


def _paired(photoset: PhotoSet, role: str, poses: Sequence[Pose]) -> list[tuple[View, Pose]]:
    return list(zip(photoset.views(role), poses, strict=True))


def _z(what: str, off: np.ndarray, covariance: np.ndarray) -> Iterator[Deviation]:
    for value, variance in zip(np.atleast_1d(off), np.diag(np.atleast_2d(covariance)), strict=True):
        yield Deviation(what, float(value / np.sqrt(max(variance, 1e-300))))


def _camera_z(world: World, settled) -> Iterator[Deviation]:
    truth = world.camera.matrix[[0, 1, 0, 1], [0, 1, 2, 2]]
    yield from _z("camera", settled.values["camera"][:4] - truth, settled.covariance["camera"][:4, :4])


def _pose_z(world: World, settled, observations: list[Observation]) -> Iterator[Deviation]:
    for block in dict.fromkeys(s.pose_block for s in observations):
        number = next(int(s.view.name[1:]) for s in observations if s.pose_block == block)
        near = pose_block(world.views[number])
        if near[:3] @ settled.values[block][:3] < 0:  # the same rotation by the other way round
            near[:3] *= 1 - 2 * np.pi / np.linalg.norm(near[:3])
        yield from _z("pose", settled.values[block] - near, settled.covariance[block])


def _light_z(world: World, settled, observations: list[Observation]) -> Iterator[Deviation]:
    for observation in observations:
        light = light_of(settled, observation)
        off = light.place - world.lamps[int(observation.view.name[1:])]
        if block_name(observation.light) in settled.values:
            yield from _z("light", off, light.covariance)


def _sample_z(world: World, settled) -> Iterator[Deviation]:
    off = settled.values["sample"] - np.append(world.sample.center, world.sample.radius)
    yield from _z("sample", off, settled.covariance["sample"])


def _strength_z(world, photoset, settled, observations, reader, remarks) -> Iterator[Deviation]:
    lights = {s.view.name: light_of(settled, s) for s in observations}
    readings = {
        s.view.name: read_view(photoset, reader(s.view), settled, s, lights[s.view.name])
        for s in observations
    }
    tied, _ = tie(photoset, readings, lights, {n: np.ones(1) for n in readings}, remarks)
    for name, one in tied.items():
        number = int(name[1:])
        # as it falls on the sample: the strength and the lamp's distance are found together
        reach = np.linalg.norm(world.lamps[number] - SAMPLE.center)
        here = np.linalg.norm(lights[name].place - SAMPLE.center)
        found, truth = one.value / here**2, world.strengths[number] / reach**2
        yield from _z("radiance", found - truth, (one.error / here**2)[:, None] ** 2)


def coverage(found: Sequence[Deviation]) -> dict[str, tuple[int, float, float]]:
    """By quantity: how many, the share within the interval, and the rms of the deviations (cut at 6)."""
    result = {}
    for what in dict.fromkeys(d.what for d in found):
        z = np.array([d.z for d in found if d.what == what])
        result[what] = (
            len(z),
            float(np.mean(np.abs(z) < WIDE)),
            float(np.sqrt(np.mean(np.minimum(z**2, 36)))),
        )
    return result


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="coverage of calibration's stated 95 % intervals")
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument(
        "--paper", action="store_true", help="the photos show the board's paper, and shading is fitted"
    )
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--quick", action="store_true", help="four sets")
    asked = parser.parse_args(arguments)
    count = 4 if asked.quick else asked.sets
    parts = list(spread_over_processes(_one, [(k, asked.paper) for k in range(count)], asked.workers))
    print(
        f"{count} set-ups, {'with' if asked.paper else 'without'} paper: share of truths within 95 % intervals"
    )
    print(f"{'quantity':12}{'numbers':>9}{'within':>10}{'rms z':>8}")
    for what, (number, share, rms) in coverage([d for part in parts for d in part]).items():
        print(f"{what:12}{number:9}{100 * share:9.1f}%{rms:8.2f}")


def _one(task: tuple[int, bool]) -> list[Deviation]:
    return deviations(task[0], paper=task[1])


if __name__ == "__main__":
    main()
