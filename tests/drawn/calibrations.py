"""Drawn set-ups, which a test may spoil before they are calibrated by the real solvers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogonio.calib.adjust.alternate import settle
from photogonio.calib.adjust.camera_model import CameraModel
from photogonio.calib.adjust.lamps import Lamp, block_name
from photogonio.calib.adjust.state import Settled, State
from photogonio.calib.camera_poses import find_poses, scale_corners
from photogonio.calib.detect.first_look import Photos
from photogonio.calib.detect.observation import FIXED_POSE, Observation
from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.detect.photo_reader import Reader, Seen
from photogonio.calib.diagnose.procedure import ask
from photogonio.calib.diagnose.registry import Stage, asked_at
from photogonio.calib.first_camera import fitted_camera
from photogonio.calib.remarks import Remarks
from photogonio.calib.report.summary import account
from tests.drawn.boards import quiet
from tests.drawn.setups import (
    SIZE,
    World,
    draw_corners,
    draw_patch,
    draw_world,
    observe,
    photoset_of,
    scene_of,
)


class Drawn:
    """A set-up as it is drawn, which a test may spoil before it is calibrated."""

    def __init__(self, seed: int, *, fixed: bool = False, views: int = 6):
        self.rng = np.random.default_rng(seed)
        self.world = replace(draw_world(self.rng, fixed=fixed, views=views), corner_noise=0.03)
        self.photoset = photoset_of(self.world, fixed=fixed)
        self.boards = [draw_corners(self.world, p, self.rng, things=False) for p in self.world.boards]
        self.samples = [draw_corners(self.world, p, self.rng, things=True) for p in self.world.views]
        self.remarks = Remarks()

    def camera(self) -> State:
        pairs = (("sample", self.samples), ("calibration", self.boards))
        seen = [
            [Seen(v, c, SIZE) for v, c in zip(self.photoset.views(role), corners, strict=False)]
            for role, corners in pairs
        ]
        camera, model, photos = fitted_camera(Photos(seen[0], [], seen[1]), SIZE, self.remarks)
        boards, observations = find_poses(self.photoset, camera, photos, self.remarks)
        reader = Reader(self.photoset, lambda _, view: draw_patch(self.world, int(view.name[1:]), self.rng))
        state = State(
            self.photoset, reader, camera, model, tuple(boards), tuple(observations), self.remarks, quiet
        )
        return ask(scale_corners(state), asked_at(Stage.CAMERA))

    def watched(self, *, balls: tuple[int, ...] = (0, 1), paper: bool = False) -> State:
        """With what its photos show of lamp, sample and paper."""
        state = self.camera()
        for observation in state.observations:
            observe(self.world, observation, int(observation.view.name[1:]), 0.0, self.rng, paper=paper)
            observation.highlights = [h for h in observation.highlights if h.ball in balls]
        return state

    def settled(self, *, balls: tuple[int, ...] = (0, 1), paper: bool = False) -> State:
        state = settle(self.watched(balls=balls, paper=paper))
        account(state)
        ask(state, asked_at(Stage.PLACES))
        return state

    def said(self, text: str) -> bool:
        return any(text in warning for warning in self.remarks.warnings)

    def told(self, code: str) -> bool:
        return code in self.remarks.codes()


def at_rest(world: World, readings: list[PaperReading], seed: int = 0) -> State:
    """A calibration that has settled on the truth, with errors of its own size: nothing is solved for."""
    rng, photoset = np.random.default_rng(seed), photoset_of(world, fixed=True)
    model = CameraModel(SIZE, world.camera.distortion, ())
    names = [f"s{k}" for k in range(len(readings))]
    lamps = {n: Lamp(n, None, "point", world.lamps[k], "board") for k, n in enumerate(names)}
    values = {block_name(n): world.lamps[k] for k, n in enumerate(names)}
    values |= {f"ball {k}": np.append(b.center, b.radius) for k, b in enumerate(world.balls)}
    values["sample"] = np.append(world.sample.center, world.sample.radius)
    covariance = {block_name(n): 0.04 * np.eye(3) for n in names} | {"sample": 0.01 * np.eye(4)}
    rest = Settled(world.camera, model, values, covariance, lamps, {}, {}, scene_of(world), 1.0, 1.0)
    observations = []
    for k, view in enumerate(photoset.views("sample")):
        corners = draw_corners(world, world.views[k], rng, things=True)
        one = Observation(view, names[k], corners, world.views[k], FIXED_POSE, 0.1)
        one.reading = readings[k]
        one.shading = np.array([*world.lamps[k], 0.0, *world.thrown[:2], 0.0, 0.0, 0.0, world.thrown[3]])
        observations.append(one)
    boards = [
        (f"pose c{k}", draw_corners(world, p, rng, things=False), p) for k, p in enumerate(world.boards)
    ]
    reader = Reader(photoset, lambda _, view: draw_patch(world, int(view.name[1:]), rng, bounced=True))
    return State(
        photoset,
        reader,
        world.camera,
        model,
        tuple(boards),
        tuple(observations),
        Remarks(),
        quiet,
        settled_or_none=rest,
    )
