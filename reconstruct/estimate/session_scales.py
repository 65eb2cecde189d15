"""How the scales of sessions compare that photographed one sample, each from directions of its own.

Pairs of directions that two sessions share say little by themselves: within a facet one session may see them all at
larger angles between lamp and camera than the other, and f falls with that. So one model is fitted to the cells of all
sessions, with each session's scale and each view's as unknowns beside the modes: what the model has at the same
directions cancels, and where they are different ones the modes' prior says how far they may be compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.estimate.binning_error import blur
from photogonio.reconstruct.estimate.lobe_search import Fitted, search_lobes, starting_shape
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.narrow_gloss import evenly
from photogonio.reconstruct.estimate.pilot import PILOT_ORDER, PILOT_PRIOR, PILOT_TOLERANCE, StrayLightOn
from photogonio.reconstruct.estimate.weights import FREE, error_model, independence, level
from photogonio.reconstruct.lobes.families import families, retro_lobe
from photogonio.reconstruct.table.cells import Cells

MOST_CELLS = 3000
ORDER, ORDER_OF_TURNING = 6, 4  # of modes beside the scales; of surfaces whose azimuth is known
ROUNDS = 6
SETTLED = 1e-4  # of a logarithm of a scale
START = 0.25  # roughness
LEAST_ERROR = 0.003  # of a view's scale
LARGEST_STEP = 1.0  # of a logarithm


@dataclass(frozen=True, slots=True)
class Offsets:
    """Logarithms (k, c) of the sessions' scales over the first's, and their standard errors; 0 for the first."""

    value: np.ndarray
    error: np.ndarray


def session_offsets(
    cells: Cells,
    session: np.ndarray,
    view_errors: np.ndarray,
    *,
    absolute: bool,
    stray: StrayLightOn | None = None,
) -> Offsets:
    """Offsets of the sessions that views (g,) belong to, numbered from 0, each with cells of its own.

    ``view_errors`` (g,) are relative standard errors of the views' scales within their session; ``stray`` is what
    stray light adds to cells, given a model of the surface.
    """
    few = cells.take(evenly(cells, MOST_CELLS))
    of = session[few.group]
    errors = np.maximum(view_errors, LEAST_ERROR)
    middle = np.array([np.median(few.value[of == k], axis=0) for k in range(session.max() + 1)])
    offsets = np.log(np.maximum(middle, np.finfo(float).tiny))
    offsets -= offsets[0]
    kinds: Sequence[LobeSet] = [
        LobeSet(),
        *map(_alone, (*families(absolute=absolute), retro_lobe(absolute=absolute))),
    ]
    added, found = np.zeros_like(few.value), np.zeros_like(offsets)
    for turn in range(ROUNDS):
        seen = few.with_value(few.value / np.exp(offsets)[of] - added)
        fitted = _likeliest(seen, added, np.where(session > 0, FREE, errors), kinds, anew=turn == 0)
        kinds = [fitted.model.lobes]
        step, found = _solved(seen, fitted, added, session, errors)
        offsets = offsets + np.clip(step, -LARGEST_STEP, LARGEST_STEP)
        if np.abs(step).max() < SETTLED:
            break
        added = blur(seen, fitted.model)
        if stray is not None:
            added = added + stray(seen, fitted.model)
    return Offsets(offsets, found)


def _alone(family) -> LobeSet:
    return LobeSet((family,), (starting_shape(family, START),))


def _likeliest(
    seen: Cells, added: np.ndarray, believed: np.ndarray, kinds: Sequence[LobeSet], *, anew: bool
) -> Fitted:
    """The pilot fit that the cells are likeliest under; scales of all views but the first session's are free."""
    deviation = error_model(seen, added)
    pilots = [
        search_lobes(
            seen,
            deviation,
            Basis("isotropic", PILOT_ORDER),
            PILOT_PRIOR,
            lobes,
            free=None if anew else 0,
            tolerance=PILOT_TOLERANCE,
            view_errors=believed,
        )
        for lobes in kinds
    ]
    return min(pilots, key=lambda one: one.cost)


def _solved(
    seen: Cells, fitted: Fitted, added: np.ndarray, session: np.ndarray, errors: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What the sessions' scales (k, c) are still off, and the standard errors of that: by modes, lobe coefficients,
    sessions' scales and views' scales together, to first order. Where views scatter by more than their errors, theirs
    are as much larger."""
    basis = Basis("isotropic", ORDER) if seen.canonical else Basis("reciprocal", ORDER_OF_TURNING)
    fixed, lobes = fitted.model.lobes.columns(seen)
    surface = np.hstack([basis.design(seen), lobes])
    sessions = np.eye(session.max() + 1)[session][:, 1:]  # (g, k - 1)
    precision = independence(seen) * fitted.weight / (error_model(seen, added) * fitted.scale) ** 2
    prior = PILOT_PRIOR.precision(basis.degree(), level(seen))
    step, error = np.zeros((2, sessions.shape[1] + 1, seen.value.shape[1]))
    predicted = _predicted(seen, fitted.model)
    for c in range(seen.value.shape[1]):
        scales = np.hstack([sessions[seen.group], np.eye(len(errors))[seen.group]]) * predicted[:, c, None]
        columns = np.hstack([surface, scales])
        weighted = columns * precision[:, c, None]
        known = np.concatenate([prior[c], np.zeros(lobes.shape[1] + sessions.shape[1]), errors**-2.0])
        normal = weighted.T @ columns + np.diag(known)
        size = np.sqrt(np.maximum(np.diag(normal), np.finfo(float).tiny))
        covariance = np.linalg.pinv(normal / np.outer(size, size), hermitian=True) / np.outer(size, size)
        solution = covariance @ (weighted.T @ (seen.value[:, c] - fixed))
        first = surface.shape[1]
        chosen = slice(first, first + sessions.shape[1])
        scatter = np.sqrt(np.mean((solution[chosen.stop :] / errors) ** 2))
        step[1:, c] = solution[chosen]
        error[1:, c] = np.sqrt(np.diag(covariance)[chosen]) * max(1.0, scatter)
    return step, error


def _predicted(seen: Cells, model: Model) -> np.ndarray:
    """(n, c), and nowhere below 0."""
    return np.maximum(model.evaluate(seen), 0.0)
