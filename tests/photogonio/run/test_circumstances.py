"""What a pixel of a ball sees of it; and what all of f shares is said once: a curve that cells tell is left out."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.calib.response.tone import with_tone
from photogonio.capture.photoset import Sphere
from photogonio.reconstruct.table.cells import Cells
from photogonio.run.circumstances import PIXEL_BLUR, SCALE_ERROR, footprints, scale_error
from tests.reconstruct.lighting.test_tone_errors import setup_and_cells

DISTANCE, FOCAL, RADIUS = 600.0, 900.0, 20.0
OTHERS, OF_TONE = 0.01, 0.03


def seen_at(theta_r: np.ndarray, dphi: float) -> np.ndarray:
    """(n, 2) variances of the turns about the tangent axes, where the ball's normal is ``theta_r`` from the way to the
    camera."""
    camera = SimpleNamespace(matrix=np.diag([FOCAL, FOCAL, 1.0]))
    view = SimpleNamespace(name="a", pose=SimpleNamespace(center=np.array([0.0, 0.0, DISTANCE])))
    setup = SimpleNamespace(views=(view,), camera=camera, sample=Sphere(np.zeros(3), RADIUS))
    cells = Cells.of_angles(np.full(len(theta_r), 0.3), theta_r, np.full(len(theta_r), dphi))
    return footprints(setup, SimpleNamespace(groups=("a",)))(cells)


def test_in_the_middle_of_a_ball_a_pixel_turns_the_normal_by_its_width_over_the_radius():
    turn = np.sqrt(seen_at(np.array([0.0]), 0.4))
    np.testing.assert_allclose(turn, PIXEL_BLUR * DISTANCE / FOCAL / RADIUS, rtol=1e-12)


def test_toward_the_limb_it_grows_along_the_plane_of_exit_and_stays_within_what_can_be_seen():
    theta_r = np.radians([0.0, 30.0, 60.0, 80.0, 85.0, 89.9])
    across, along = np.sqrt(
        seen_at(theta_r, 0.0)
    ).T  # turns about the axis in the plane of incidence, and across it
    np.testing.assert_allclose(across, across[0])
    np.testing.assert_allclose(along[:3] * np.cos(theta_r[:3]), across[:3], rtol=1e-12)
    assert (along <= 0.5 * (0.5 * np.pi - theta_r) + 1e-12).all()


def test_the_scale_leaves_out_a_curve_that_cells_tell():
    setup, cells = setup_and_cells()
    tone, table = replace(setup.tone, scale_error=OF_TONE), SimpleNamespace(groups=cells.groups)
    bare = replace(setup, tone=None, scale_error=OTHERS)
    told, untold = with_tone(bare, tone, setup.tone.exposures), with_tone(bare, tone)
    assert scale_error(told, table) == pytest.approx((OTHERS**2 + SCALE_ERROR**2) ** 0.5)
    assert scale_error(untold, table) == pytest.approx((OTHERS**2 + OF_TONE**2 + SCALE_ERROR**2) ** 0.5)
    assert scale_error(bare, table) == pytest.approx(scale_error(told, table))
