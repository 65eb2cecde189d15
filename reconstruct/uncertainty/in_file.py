"""How sure a fit is, in the coefficient file's terms: covariance of what the file lists, and what is beyond it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import ndtri

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.errors import Uncertain
from photogonio.reconstruct.brdf.parameters import (
    FULL,
    is_shared,
    lobe_numbers,
    mode_names,
    number_of,
    rounded,
    with_number,
)
from photogonio.reconstruct.estimate.model import Model
from photogonio.reconstruct.estimate.model_discrepancy import Misfit
from photogonio.reconstruct.represent.as_found import lobe_jacobian, lobe_parameters
from photogonio.reconstruct.uncertainty.beyond import Sampled, tables_of
from photogonio.reconstruct.uncertainty.budget import Uncertainty
from photogonio.reconstruct.uncertainty.lobe_weight import covers_of

CONDITION = 1e-4  # of the directions in which listed parameters are told apart: a mode and a ground hardly
LEAST = 1e-4  # relative error of f: a smaller one weighs no more
FEWEST, UNTOLD = 5, 1e-3  # digits of what is found; of f's standard error, what more of them would change


def in_file(brdf: Brdf, model: Model, spread: Uncertainty, misfit: Misfit, known: float) -> Brdf:
    """``brdf``, which lists all modes of ``spread``, with those alone that the model has or physics asked for, and with
    how sure it is. ``known`` departures are a standard error.

    Errors that were judged from few independent parts of the data are widened, so that as many of them hold the truth
    as of a normal distribution.
    """
    own = np.arange(spread.modes) < len(model.coefficients)
    rows = np.flatnonzero(own | brdf.coefficients.any(1))
    orders = brdf.modes[rows][:, [0] if brdf.symmetry == "isotropic" else [0, 2]]
    found = replace(
        brdf,
        order=max(model.basis.order, int(orders.max(initial=0))),
        modes=brdf.modes[rows],
        coefficients=brdf.coefficients[rows],
        standard_errors=np.zeros_like(brdf.coefficients[rows]),
    )
    names = (*mode_names(brdf.symmetry, found.modes), *lobe_parameters(model))
    at = Sampled.of(found, names, model, spread, misfit, known)
    found = _shortest(found, at)
    wider = float(spread.half_width(np.ones(1))[0]) / float(ndtri(0.975))
    covariance = wider**2 * _covariance(found, model, spread, rows, at)
    errors = rounded(np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0.0)).T)
    missed, unseen = tables_of(at, covariance, wider)
    scale = rounded(np.array(spread.scale_error)).item()
    uncertain = Uncertain(names, errors, rounded(covariance, FULL), scale, missed, unseen)
    return replace(found, standard_errors=errors[: len(rows)], uncertainty=uncertain)


def _covariance(found: Brdf, model: Model, spread: Uncertainty, rows: np.ndarray, at: Sampled) -> np.ndarray:
    """(c, p, p) of the modes at ``rows`` of the fit's and of the lobes' numbers.

    Modes that models have which predict as well, and that the file does not list, go together with those that it
    lists: what they do to f counts as what the channel's own listed parameters would do that come nearest to it. Shapes
    belong to all channels, and have one error.
    """
    lobes, modes = lobe_jacobian(model, covers_of(model)), len(rows)
    channels, listed = lobes.shape[0], modes + lobes.shape[1]
    change = np.zeros((channels, listed, spread.covariance.shape[1]))
    change[:, np.arange(modes), rows] = 1.0
    change[:, modes:, spread.modes :] = lobes
    other = np.setdiff1d(np.arange(spread.modes), rows)
    if len(other):
        design = spread.basis.design(at.cells)[:, other]
        names = [*mode_names(found.symmetry, found.modes), *lobe_parameters(model)]
        own = np.flatnonzero([not is_shared(name, found.lobes) for name in names])
        for c in range(channels):
            weight = 1.0 / np.maximum(at.total[:, [c]], LEAST * at.size[:, [c]])
            slopes = weight * at.change[:, own, c]
            scale = np.maximum(np.linalg.norm(slopes, axis=0), np.finfo(float).tiny)
            nearest = np.linalg.lstsq(slopes / scale, weight * design, rcond=CONDITION)[0]
            change[c][np.ix_(own, other)] = nearest / scale[:, None]
    return change @ spread.covariance @ np.swapaxes(change, 1, 2)


def _shortest(brdf: Brdf, at: Sampled) -> Brdf:
    """``brdf`` with no more digits than mean something, beside its error."""
    angles = at.cells.theta_i, at.cells.phi_i, at.cells.theta_r, at.cells.phi_r
    for digits in range(FEWEST, FULL):
        said = _written(brdf, digits)
        if (np.abs(said.evaluate(*angles) - at.value) <= UNTOLD * at.whole).all():
            return said
    return _written(brdf, FULL)


def _written(brdf: Brdf, digits: int) -> Brdf:
    lobes = []
    for lobe in brdf.lobes:
        for what in lobe_numbers(lobe):
            lobe = with_number(lobe, what, rounded(number_of(lobe, what), digits))
        lobes.append(lobe)
    return replace(brdf, coefficients=rounded(brdf.coefficients, digits), lobes=tuple(lobes))
