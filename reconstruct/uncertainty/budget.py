"""How sure a fit is: covariance of all its parameters, standard error and interval of f anywhere.

Three things leave a fit unsure: the noise of the data, of which a view's cells share a part (its scale, its stray
light, its geometry), the prior, which speaks where the data do not, and the choice of the model.
:mod:`reconstruct.uncertainty.covariance` says how each is measured, and
:mod:`reconstruct.estimate.model_averaging` what other models weigh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit

from photogonio.reconstruct.estimate.lobe_search import Fitted, common_error
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import Model, shape_slopes
from photogonio.reconstruct.estimate.model_selection import Candidate, blocks_of
from photogonio.reconstruct.estimate.weights import independence, level
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.covariance import Alternative, Problem, covariance
from photogonio.reconstruct.uncertainty.lobe_weight import cover_slopes

LEAST_UNITS = 8  # views; fewer are cut into blocks of directions
MOST_UNITS = 40  # to leave out one by one
MOST_VIEWS = 50  # to leave out one by one; of more, several together


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Covariance of the parameters of a model: modes, then lobe coefficients, then logarithms of lobe shapes, then of
    weights (:mod:`reconstruct.uncertainty.lobe_weight`), in their standard deviations.

    The modes may be more than the model has, since models that predict as well have them.
    """

    basis: Basis
    covariance: np.ndarray  # (c, p, p)
    coefficients: int  # lobe coefficients among the parameters
    freedom: float  # degrees of freedom of the covariance
    scale_error: float = 0.0  # relative standard error of everything at once: the white reference's
    rivals: tuple[Rival, ...] = ()

    @property
    def modes(self) -> int:
        return len(self.basis.modes)

    def of_modes_alone(self) -> np.ndarray:
        """(c, m, m) covariance of the modes with everything about the lobes held as it is."""
        m = self.modes
        own, across, rest = (
            self.covariance[:, :m, :m],
            self.covariance[:, :m, m:],
            self.covariance[:, m:, m:],
        )
        taken = (
            across @ np.linalg.pinv(rest, hermitian=True) @ np.swapaxes(across, 1, 2) if rest.size else 0.0
        )
        return own - taken

    def standard_error(self, model: Model, cells: Cells, said: np.ndarray | None = None) -> np.ndarray:
        """Of ``model`` (n, c) at the directions of ``cells``, 1/sr; ``said`` (n, c) is what it says there, if known."""
        common = np.hstack([self.basis.design(cells), model.lobes.columns(cells)[1]])
        p = common.shape[1]
        if self.covariance[:, p:, p:].any():
            slopes = _shared_slopes(model, cells)
        else:  # shapes that are held, as an average's
            slopes = np.zeros((len(cells), self.covariance.shape[1] - p, len(self.covariance)))
        own = [_spread(np.hstack([common, slopes[:, :, c]]), cov) for c, cov in enumerate(self.covariance)]
        variance = np.stack(own, axis=1) ** 2
        if self.scale_error or self.rivals:
            said = model.evaluate(cells) if said is None else said
            variance += (self.scale_error * said) ** 2
            for rival in self.rivals:
                variance += rival.weight * rival.variance(cells, said)
        return np.sqrt(variance)

    def half_width(self, error: np.ndarray, level: float = 0.95) -> np.ndarray:
        """Half the width of the interval that holds the truth with probability ``level``, from standard errors."""
        return error * float(stdtrit(self.freedom, 0.5 + 0.5 * level))


@dataclass(frozen=True, slots=True)
class Rival:
    """A model with other lobes that predicts as well as the one chosen."""

    model: Model
    weight: float  # how much it is believed
    spread: Uncertainty | None = None  # its own; None: as that of the chosen

    def variance(self, cells: Cells, said: np.ndarray) -> np.ndarray:
        """(n, c) of f about what the chosen one has ``said`` at the directions of ``cells``, if this one is right."""
        departed = (self.model.evaluate(cells) - said) ** 2
        if self.spread is None:
            return departed
        return departed + self.spread.standard_error(self.model, cells) ** 2


def uncertainty_of(
    fitted: Fitted,
    cells: Cells,
    deviation: np.ndarray,
    models: Sequence[tuple[Candidate, float]],
    *,
    view_errors: np.ndarray | None = None,
    scale_error: float = 0.0,
    shared: np.ndarray | None = None,
    considered: np.ndarray | None = None,
) -> Uncertainty:
    """Covariance of the fit's parameters on ``cells``, whose error model is ``deviation`` (n, c).

    ``models`` are those that may be as good, with weights that add up to 1; only those with the fit's own lobes are
    heeded. ``view_errors`` (g,) are relative standard errors of the views' scales; ``shared`` (n, k, c), 1/sr, what k
    things that all views have alike may do to the cells, each a standard deviation: the cells may tell them, but for
    those ``considered``, likewise.
    """
    model = fitted.model
    shared = np.zeros((len(cells), 0, deviation.shape[1])) if shared is None else shared
    same = [(one, weight) for one, weight in models if one.lobes.families == model.lobes.families]
    basis = Basis(model.basis.symmetry, max([model.basis.order, *(one.order for one, _ in same)]))
    problem = _problem(fitted, cells, deviation, basis, view_errors, shared)
    problem = replace(problem, considered=considered)
    total = covariance(problem, _alternatives(same, model, level(cells)))
    kept = total.shape[1] - shared.shape[1]  # f does not change with what is shared
    total, units = total[:, :kept, :kept], len(np.unique(problem.unit))
    return Uncertainty(basis, total, len(model.lobe_coefficients), max(units - 1.0, 1.0), scale_error)


def _problem(fitted: Fitted, cells: Cells, deviation, basis: Basis, view_errors, shared) -> Problem:
    model = fitted.model
    fixed, columns = model.lobes.columns(cells)
    slopes = np.concatenate([_shared_slopes(model, cells), shared], axis=1)
    own = model.lobe_coefficients
    center = np.zeros((own.shape[1], len(basis.modes) + len(own) + slopes.shape[1]))
    center[:, : len(model.coefficients)] = model.coefficients.T
    center[:, len(basis.modes) : len(basis.modes) + len(own)] = own.T
    upper = model.lobes.upper_bounds()[:, None]
    return Problem(
        design=basis.design(cells),
        columns=columns,
        slopes=slopes,
        target=cells.value - fixed[:, None],
        weight=independence(cells) * fitted.weight / (deviation * fitted.scale) ** 2,
        unit=_units(cells),
        common=common_error(cells, cells.value - fitted.residual, view_errors),
        center=center,
        fixed=((own <= 0.0) | (own >= upper)).T,
    )


def _alternatives(
    models: Sequence[tuple[Candidate, float]], model: Model, level: np.ndarray
) -> list[Alternative]:
    total = sum(weight for _, weight in models)
    return [
        Alternative(
            one.prior.precision(Basis(model.basis.symmetry, one.order).degree(), level), weight / total
        )
        for one, weight in models
    ]


def _units(cells: Cells) -> np.ndarray:
    """(n,) what is left out as a whole: a view or, of very many, a few; or some blocks of neighbouring directions."""
    names, unit = np.unique(cells.group, return_inverse=True)
    if len(names) >= LEAST_UNITS:
        together = np.random.default_rng(0).permutation(len(names)) % MOST_VIEWS
        return unit.ravel() if len(names) <= MOST_VIEWS else together[unit.ravel()]
    blocks = np.column_stack([unit.ravel(), blocks_of(cells)])
    block = np.unique(blocks, axis=0, return_inverse=True)[1].ravel()
    count = block.max(initial=0) + 1
    return np.random.default_rng(0).permutation(count)[block] % min(MOST_UNITS, count)


def _spread(rows: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    return np.sqrt(np.maximum(np.einsum("np,pq,nq->n", rows, covariance, rows, optimize=True), 0.0))


def _shared_slopes(model: Model, cells: Cells) -> np.ndarray:
    """(n, s, c) derivatives of f by what all channels share: logarithms of the lobes' shapes, and of their weights."""
    return np.concatenate([shape_slopes(model, cells), cover_slopes(model, cells)], axis=1)
