"""How sure a fit is, in the coefficient file's terms: covariance of what the file lists, and what is beyond it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.errors import Uncertain
from photogonio.reconstruct.brdf.parameters import mode_names
from photogonio.reconstruct.estimate.model import Model
from photogonio.reconstruct.estimate.model_discrepancy import Misfit
from photogonio.reconstruct.represent.as_found import lobe_jacobian, lobe_parameters
from photogonio.reconstruct.uncertainty.beyond import tables_of
from photogonio.reconstruct.uncertainty.budget import Uncertainty
from photogonio.reconstruct.uncertainty.lobe_weight import covers_of

DIGITS = 6  # of standard errors and covariances


def in_file(brdf: Brdf, model: Model, spread: Uncertainty, misfit: Misfit, known: float) -> Brdf:
    """``brdf``, which lists all modes of ``spread``, with those alone that the model has or physics asked for, and with
    how sure it is. ``known`` departures are a standard error."""
    own = np.arange(spread.modes) < len(model.coefficients)
    rows = np.flatnonzero(own | brdf.coefficients.any(1))
    covariance = _covariance(model, spread, rows)
    errors = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0.0)).T
    own_errors = Uncertain(
        parameters=(*mode_names(brdf.symmetry, brdf.modes[rows]), *lobe_parameters(model)),
        standard_errors=rounded(errors),
        covariance=rounded(covariance),
        scale=rounded(np.array(spread.scale_error)).item(),
    )
    orders = brdf.modes[rows][:, [0] if brdf.symmetry == "isotropic" else [0, 2]]
    found = replace(
        brdf,
        order=max(model.basis.order, int(orders.max(initial=0))),
        modes=brdf.modes[rows],
        coefficients=brdf.coefficients[rows],
        standard_errors=own_errors.standard_errors[: len(rows)],
        uncertainty=own_errors,
    )
    missed, unseen = tables_of(found, model, spread, misfit, known)
    return replace(found, uncertainty=replace(own_errors, misfit=missed, unseen=unseen))


def _covariance(model: Model, spread: Uncertainty, rows: np.ndarray) -> np.ndarray:
    """(c, p, p) of the modes at ``rows`` of the fit's and of the lobes' numbers."""
    kept = np.concatenate([rows, np.arange(spread.modes, spread.covariance.shape[1])])
    own = spread.covariance[:, kept[:, None], kept]
    lobes, modes = lobe_jacobian(model, covers_of(model)), len(rows)
    change = np.zeros((len(own), modes + lobes.shape[1], own.shape[1]))
    change[:, np.arange(modes), np.arange(modes)] = 1.0
    change[:, modes:, modes:] = lobes
    return change @ own @ np.swapaxes(change, 1, 2)


def rounded(values: np.ndarray, digits: int = DIGITS) -> np.ndarray:
    """The same to so many significant digits: what is written is what is held."""
    size = np.where(values == 0.0, 1.0, np.abs(values))
    scale = 10.0 ** (digits - 1 - np.floor(np.log10(size)))
    return np.round(values * scale) / scale
