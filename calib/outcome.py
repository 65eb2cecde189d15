"""The result of a calibration, once all has settled, and what is to be told of it."""

from __future__ import annotations

import numpy as np

from photogonio.calib.adjust.camera_model import block_pose, pose_block
from photogonio.calib.adjust.rig_values import told_by
from photogonio.calib.adjust.state import State
from photogonio.calib.detect.observation import POSE, Posed, channel_names
from photogonio.calib.diagnose.lights.ambient_light import ambient_known
from photogonio.calib.diagnose.lights.vignetting import falloff_known
from photogonio.calib.diagnose.procedure import ask, doubted, tell_lights
from photogonio.calib.diagnose.registry import LIGHT, Stage, asked_at
from photogonio.calib.report.summary import account, board_marks
from photogonio.calib.setup import BoardSetup, Setup
from photogonio.calib.views import views_of
from photogonio.capture.photoset import MirrorBall

SHARED = ("patches-uneven", "scale-by-kind-of-paper")  # whose amounts are errors of the scale of all photos


def setup_from(state: State) -> Setup:
    """Everything that calibration found.

    Raises:
        InputError: no sample photo can be used.
    """
    views, scale = views_of(ask(state, asked_at(Stage.LAMP)))
    photoset, settled, remarks = state.photoset, state.settled, state.remarks
    ambient = ambient_known(state, views)
    tell_lights(state, LIGHT, {"ambient-light": ambient is not None})
    account(state)
    sample = ask(state, asked_at(Stage.PLACES)).photoset.sample
    kept = {view.name for view in views}
    ask(state.keeping(s for s in state.observations if s.view.name in kept), asked_at(Stage.STRENGTH))
    doubtful, common = doubted(state, LIGHT, views)
    uneven = [one.amount for one in remarks.diagnoses if one.code in SHARED]
    return Setup(
        settled.camera,
        sample,
        doubtful,
        scale,
        channel_names(len(views[0].strength)),
        tuple(remarks.left_out),
        remarks.warnings,
        remarks.residuals,
        mirror_balls=_mirror_balls(state),
        boards=tuple(_board(state, board) for board in state.boards),
        ambient=ambient,
        falloff=falloff_known(state),
        scale_error=float(np.linalg.norm([common, *uneven])),
        diagnoses=tuple(remarks.diagnoses),
        turned=photoset.turned,
        rig=() if state.rig.expected else told_by(state),
    )


def _board(state: State, board: Posed) -> BoardSetup:
    (block, corners, pose), settled = board, state.settled
    pose = block_pose(settled.values.get(block, pose_block(pose)))
    drawn = board_marks(settled, corners, pose)
    rms = float(np.sqrt(np.mean((drawn.corner_misses**2).sum(1))))
    return BoardSetup(block.removeprefix(POSE), pose, rms, settled.covariance.get(block), drawn)


def _mirror_balls(state: State) -> tuple[MirrorBall, ...]:
    blocks = [state.settled.values[f"ball {k}"] for k in range(len(state.photoset.mirror_balls))]
    return tuple(MirrorBall(b[:3].copy(), float(b[3])) for b in blocks)
