"""The result of a calibration, once all has settled, and what is to be told of it."""

from __future__ import annotations

import numpy as np

from photogonio.calib.adjust.bundle import block_pose, pose_block
from photogonio.calib.adjust.flat_sample import PlaneMove, flat_move
from photogonio.calib.adjust.state import State
from photogonio.calib.detect.observation import POSE, Posed, channel_names
from photogonio.calib.diagnose.lights.ambient_light import ambient_known, room_doubt
from photogonio.calib.diagnose.lights.vignetting import doubted, falloff_known
from photogonio.calib.diagnose.procedure import ask, tell_lights
from photogonio.calib.diagnose.registry import LIGHT, Stage, asked_at
from photogonio.calib.report.summary import account, account_plane, believed, board_marks
from photogonio.calib.setup import BoardSetup, Setup
from photogonio.calib.views import views_of
from photogonio.capture.photoset import MirrorBall, Plane, Sphere


def setup_from(state: State) -> Setup:
    """Everything that calibration found.

    Raises:
        InputError: no sample photo can be used.
    """
    views, scale = views_of(state)
    photoset, settled, remarks = state.photoset, state.settled, state.remarks
    ambient = ambient_known(state, views)
    tell_lights(state, LIGHT, {"ambient-light": ambient is not None})
    account(state)
    kept = {view.name for view in views}
    ask(state.keeping(s for s in state.observations if s.view.name in kept), asked_at(Stage.STRENGTH))
    falloff = falloff_known(state)
    doubtful, common = doubted(photoset, settled.camera, views, falloff)
    move = flat_move(photoset, settled.camera, state.observations)
    account_plane(photoset, move, remarks)
    uneven = [one.amount for one in remarks.diagnoses if one.code == "patches-uneven"]
    return Setup(
        settled.camera,
        _sample(state, move),
        doubtful,
        scale,
        channel_names(len(views[0].strength)),
        tuple(remarks.left_out),
        remarks.warnings,
        remarks.residuals,
        mirror_balls=_mirror_balls(state),
        boards=tuple(_board(state, board) for board in state.boards),
        ambient=ambient,
        falloff=falloff,
        scale_error=float(np.linalg.norm([common, room_doubt(state), *uneven])),
        diagnoses=tuple(remarks.diagnoses),
        turned=photoset.turned,
    )


def _sample(state: State, move: PlaneMove | None) -> Sphere | Plane:
    """The sample where it lies, as far as that is believed."""
    sample = state.photoset.sample
    if isinstance(sample, Plane):
        return sample if move is None else move.applied(sample)
    if not believed(state.photoset, state.settled):
        return sample
    block = state.settled.values["sample"]
    return Sphere(block[:3].copy(), float(block[3]))


def _board(state: State, board: Posed) -> BoardSetup:
    (block, corners, pose), settled = board, state.settled
    pose = block_pose(settled.values.get(block, pose_block(pose)))
    drawn = board_marks(settled, corners, pose)
    rms = float(np.sqrt(np.mean((drawn.corner_misses**2).sum(1))))
    return BoardSetup(block.removeprefix(POSE), pose, rms, settled.covariance.get(block), drawn)


def _mirror_balls(state: State) -> tuple[MirrorBall, ...]:
    blocks = [state.settled.values[f"ball {k}"] for k in range(len(state.photoset.mirror_balls))]
    return tuple(MirrorBall(b[:3].copy(), float(b[3])) for b in blocks)
