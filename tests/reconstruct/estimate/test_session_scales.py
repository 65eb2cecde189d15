"""Scales of sessions are found by a model of the surface, since none saw it under the other's angles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogonio.reconstruct.estimate.session_scales import session_offsets
from photogonio.reconstruct.table.cells import Cells
from photogonio.synthetic.brdf.library import make_brdf, on_grid

VIEW_ERROR, NOISE = 0.003, 0.002
OFFSET = 0.7


def seen(rng: np.random.Generator, phase: float, cells: int = 60) -> np.ndarray:
    """Angles (n, 3) of a ball whose lamp stands ``phase`` radians from the camera."""
    lamp, camera = np.array([np.sin(phase), 0.0, np.cos(phase)]), np.array([0.0, 0.0, 1.0])
    normal = rng.normal(size=(20 * cells, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    theta_i, theta_r = np.arccos(normal @ lamp), np.arccos(normal @ camera)
    good = np.maximum(theta_i, theta_r) < np.radians(70.0)
    across = [one - (normal @ one)[:, None] * normal for one in (lamp, camera)]
    cosine = np.sum(across[0] * across[1], 1) / np.prod(
        [np.linalg.norm(one, axis=1) for one in across], axis=0
    )
    return np.column_stack([theta_i, theta_r, np.arccos(np.clip(cosine, -1.0, 1.0))])[good][:cells]


def test_offset_of_sessions_at_other_angles_between_lamp_and_camera():
    """Within three of its standard errors, and those are no larger than views and noise allow twice over."""
    rng = np.random.default_rng(5)
    truth = make_brdf("oren-nayar", {"albedo": 0.6, "sigma": 0.5})
    phases = np.radians([10, 40, 55, 75, 25, 60, 85, 95])
    session = np.repeat([0, 1], 4)
    angles = [seen(rng, phase) for phase in phases]
    group = np.repeat(np.arange(8), [len(one) for one in angles])
    value = on_grid(truth, np.vstack(angles))[:, :1]
    value = value * np.exp(OFFSET * session[group] + rng.normal(0.0, VIEW_ERROR, 8)[group])[:, None]
    value *= rng.normal(1.0, NOISE, value.shape)
    cells = replace(
        Cells.of_angles(*np.vstack(angles).T),
        value=value,
        variance=(NOISE * value) ** 2,
        group=group,
        groups=tuple("abcdefgh"),
        channels=("Y",),
        binned=True,
        canonical=True,
    )
    found = session_offsets(cells, session, np.full(8, VIEW_ERROR), absolute=True)
    error = found.error[1, 0]
    assert abs(found.value[1, 0] - OFFSET) < 3.0 * error
    assert error < 3.0 * VIEW_ERROR
    assert not found.value[0].any() and not found.error[0].any()
