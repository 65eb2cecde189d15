"""The paper's own fit: least squares of q on surface scattering modes alone, by the pseudo-inverse, all readings alike.

q is f cos(theta_i), the radiance under a collimated source of constant intensity, or f cos(theta_i) cos(theta_r), which
is as symmetric as the modes are. Nothing is taken off the table, nothing is smoothed, and nothing is held to physics:
what is known of photos besides their cells has no say, but for the scale that all share.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.estimate.lobe_search import Fitted
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.model_selection import NO_PRIOR, Candidate, choose, try_all
from photogonio.reconstruct.estimate.pilot import Cleaned
from photogonio.reconstruct.estimate.weights import (
    NORMAL,
    ViewScales,
    independence,
    level,
    scale_of,
    student_cost,
)
from photogonio.reconstruct.fit_result import FitResult, result_of
from photogonio.reconstruct.model_choice import HIGHEST_AUTO, HIGHEST_AUTO_TURNING, FitOptions, refuse_order
from photogonio.reconstruct.modes.basis import cosines
from photogonio.reconstruct.symmetry.verdict import Verdict, asked, direct
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.budget import Uncertainty

UNTOLD = "modes untold"  # key of the diagnostics: how many, of how many
PART = 16_384  # rows of the design at once
ENOUGH = 20_000  # cells, evenly taken of more, to choose an order by


def fit_as_paper(cells: Cells, options: FitOptions, scale_error: float = 0.0) -> FitResult:
    """The fit of ``options.quantity`` of all ``cells`` whose values are numbers.

    Raises:
        InputError: no cell is left, or what was asked for is no part of this fit.
    """
    if options.lobes or options.physics == "on":
        what = f"--lobes {options.lobes}" if options.lobes else "--physics on"
        raise InputError(what, "the paper's fit of q has modes alone, by least squares")
    cells = cells.take(np.isfinite(cells.value).all(1) & np.isfinite(cells.variance).all(1))
    if not len(cells):
        raise InputError("table", "no cell with samples is left to fit")
    verdict = asked(options.symmetry, cells) or Verdict("isotropic", "assumed: the modes are the paper's")
    if not cells.binned:
        verdict = verdict.beside(direct(cells))
    cosine = cosines(options.quantity, cells.theta_i, cells.theta_r)[:, None]
    refuse_order(options, verdict.symmetry)
    chosen, best = _order(cells.with_value(cells.value * cosine), options, verdict.symmetry)
    basis = Basis(verdict.symmetry, chosen.order, options.quantity)
    coefficients, covariance, untold = pseudo_inverse(cells, basis)
    model = Model(basis, coefficients, LobeSet(), np.empty((0, coefficients.shape[1])))
    residual = cells.value - model.evaluate(cells)
    counts = max(float(independence(cells).sum()) - len(coefficients), 1.0)
    squares = np.sum((cosine * residual) ** 2, axis=0)
    spread = Uncertainty(basis, covariance * (squares / counts)[:, None, None], 0, counts, scale_error)
    deviation = level(cells.with_value(cells.value * cosine)) / cosine
    scale = scale_of(residual / deviation, cells)
    ones, none = np.ones_like(residual), np.zeros_like(residual)
    final = Fitted(model, residual, none, ones, scale, student_cost(residual / deviation, scale, NORMAL))
    work = Cleaned(cells, deviation, none, ViewScales.none(np.zeros(len(cells.groups))), ())
    verdict = _with_what_is_lost(verdict, options.quantity, squares, cells.value * cosine)
    found = result_of(work, final, spread, verdict, (chosen, best), replace(options, physics="off"))
    exact = replace(found.brdf, coefficients=coefficients)  # to the last digit
    told = {"choices": _choices(verdict, options, chosen), UNTOLD: [untold, len(coefficients)]}
    return replace(found, brdf=exact, diagnostics=found.diagnostics | told)


def pseudo_inverse(cells: Cells, basis: Basis) -> tuple[np.ndarray, np.ndarray, int]:
    """(m, c) coefficients of least squares of the basis's quantity, of least norm where ``cells`` leave some untold,
    (1, m, m) the pseudo-inverse of the Gram matrix, and how many combinations of modes are untold. Rows are brought to
    a triangle part by part."""
    m, channels = len(basis.modes), cells.value.shape[1]
    triangle = np.zeros((0, m + channels))
    for start in range(0, len(cells), PART):
        part = cells.take(np.arange(start, min(start + PART, len(cells))))
        cosine = cosines(basis.quantity, part.theta_i, part.theta_r)[:, None]
        rows = cosine * np.hstack([basis.design(part), part.value])
        triangle = np.asarray(np.linalg.qr(np.vstack([triangle, rows]), mode="r"))
    left, values, right = np.linalg.svd(triangle[:, :m], full_matrices=False)
    told = values > np.finfo(float).eps * max(len(cells), m) * values.max(initial=0.0)
    inverse = (right[told].T / values[told]) @ left[:, told].T
    return inverse @ triangle[:, m:], (inverse @ inverse.T)[None], m - int(told.sum())


def _order(q: Cells, options: FitOptions, symmetry: str) -> tuple[Candidate, Candidate]:
    """The order asked for, or that which predicts neighbourhoods left out best, of no more modes than half the rows;
    ``q`` are cells of that quantity."""
    if options.order is not None:
        one = Candidate(options.order, NO_PRIOR, LobeSet(), np.zeros(1))
        return one, one
    highest = HIGHEST_AUTO if symmetry == "isotropic" else HIGHEST_AUTO_TURNING
    few = q.take(np.arange(0, len(q), -(-len(q) // ENOUGH)))
    orders = [k for k in range(highest + 1) if k == 0 or 2 * len(Basis(symmetry, k).modes) <= len(few)]
    weight = np.repeat(independence(few), few.value.shape[1], axis=1) / level(few) ** 2
    return choose(try_all(few, weight, symmetry, orders, [LobeSet()], priors=(NO_PRIOR,)))


def _with_what_is_lost(verdict: Verdict, quantity: str, squares: np.ndarray, q: np.ndarray) -> Verdict:
    """The verdict with what symmetric modes miss of f cos(theta_i), which is not."""
    if quantity != "brdf_cos" or verdict.symmetry == "general":
        return verdict
    lost = float(np.sqrt(np.max(squares / np.maximum(np.sum(q**2, axis=0), np.finfo(float).tiny))))
    told = (
        f"these modes are symmetric, which f cos(theta_i) is not: they miss {lost:.1%} of it, rms (f cos cos, "
        "--quantity brdf-cos-cos, is; --symmetry general need not be)"
    )
    return replace(verdict, reason=f"{verdict.reason}; {told}")


def _choices(verdict: Verdict, options: FitOptions, chosen: Candidate) -> list[dict[str, object]]:
    """What was chosen, and why."""
    why = "asked for" if options.order is not None else "predicts neighbourhoods left out best"
    told = (
        ("symmetry", verdict.symmetry, verdict.reason),
        ("reciprocity", verdict.reciprocity, verdict.exchanged),
        ("order", chosen.order, why),
        (
            "modes of",
            options.quantity,
            "asked for: the paper's own fit, least squares of it, all readings alike",
        ),
    )
    return [{"what": what, "value": value, "reason": reason} for what, value, reason in told]
