"""Models fitted on cells and judged on what they were not shown: what a test of symmetry compares.

All models of one trial share cells, weights, folds and the views' errors of scale, so that nothing but the model makes
the difference.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtr

from photogonio.reconstruct.estimate.folded_design import Common, FoldedDesign
from photogonio.reconstruct.estimate.lobe_search import common_error, search_lobes, thinned
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model, shape_slopes
from photogonio.reconstruct.estimate.model_selection import LEAST_VIEWS, PRIORS, blocks_of, folds_of
from photogonio.reconstruct.estimate.normal_equations import Factors, Statistics, solve
from photogonio.reconstruct.estimate.pilot import PILOT_PRIOR, Cleaned
from photogonio.reconstruct.estimate.weights import independence, level
from photogonio.reconstruct.symmetry.columns import Columns, swapped_modes, turning_modes
from photogonio.reconstruct.table.cells import Cells

VIEW_WORTH = 3.0  # independent values that a view's residuals count for
SHUFFLES = 7  # sets with their rotations dealt out anew
ADEQUATE = 1.8  # squared residual, in robust standard deviations, of what left-out values miss on the mean
REST = 0.25  # of the squared misfit of the isotropic model
LEAST_SPREAD = 1.0  # of the odds of shuffled sets
MATERIAL = 0.01  # rms by which two models differ where data lie, of f: less is calibration
TOLD = 1.5  # ratio of roughnesses that must have shown, where isotropy is said to have been tested
TOLD_SHARE = 0.1  # of f, where there is no lobe: a part that turns
ORDERS = (0, 2, 4)  # of the isotropic modes in the test
TURNING_ORDER = 2  # of the modes that turn
SHAPE_DOUBT = 0.3  # of a shape's logarithm, from fold to fold
FREE = 1e-6  # penalty of what is free


def turned(lobes: LobeSet) -> LobeSet:
    """The same with two roughnesses of the first lobe, which start equal; a peak about a direction has none."""
    if not lobes.families or lobes.families[0].peak:
        return lobes
    first = replace(lobes.families[0], name=f"anisotropic {lobes.families[0].name}", turning=True)
    shape = np.array([*lobes.shapes[0], 1.0, 1.0])
    return LobeSet((first, *lobes.families[1:]), (shape, *lobes.shapes[1:]))


@dataclass(frozen=True, slots=True)
class Tried:
    """A model, and what it misses of views that it has not seen."""

    model: Model  # the pilot: its lobes
    columns: Columns  # beside the isotropic modes
    order: int
    penalty: np.ndarray  # (c, m) of modes and columns
    loss: float  # weighted squared residual of all folds
    predicted: np.ndarray  # (n, c) by all data, 1/sr


@dataclass(frozen=True, slots=True)
class Trial:
    """Cells, with the weights and the folds that all models share."""

    cells: Cells
    deviation: np.ndarray  # (n, c)
    weight: np.ndarray  # (n, c)
    fold: np.ndarray  # (n,)
    common: Common | None
    errors: np.ndarray  # (g,) of the views' scales
    turned: tuple[LobeSet, ...]
    values: float  # independent ones

    @classmethod
    def of(cls, work: Cleaned) -> Trial:
        """On cells that were cleaned by a model that may turn: it holds the isotropic one."""
        cells, pilot, errors = work.cells, work.reference.model, work.scales.error
        again = search_lobes(
            cells,
            work.deviation,
            pilot.basis,
            PILOT_PRIOR,
            pilot.lobes,
            free=0,
            refine=False,
            view_errors=errors,
        )
        weight = independence(cells) * again.weight / (work.deviation * again.scale) ** 2
        fold = folds_of(cells)
        common = common_error(cells, cells.value - again.residual, errors)
        if common is not None:  # folds of blocks cut views apart
            unit = np.unique(np.column_stack([fold, common.unit]), axis=0, return_inverse=True)[1].ravel()
            common = Common(unit, common.pattern)
        turned = tuple(one.model.lobes for one in work.pilots)
        values = VIEW_WORTH * len(np.unique(units_of(cells)))
        return cls(cells, work.deviation, weight, fold, common, errors, turned, values)

    def fitted(
        self, lobes: LobeSet, *, turning: bool = False, swapped: bool = False, anew: bool = False
    ) -> Tried:
        """The model with ``lobes`` that predicts best, of those of all orders and priors.

        Lobes with two roughnesses are taken as they are unless they are to be searched for ``anew``.
        """
        keep = lobes.turning and not anew
        few, deviation = thinned(self.cells, self.deviation)
        basis = Basis("isotropic", max(ORDERS))
        pilot = search_lobes(
            few,
            deviation,
            basis,
            PILOT_PRIOR,
            lobes,
            free=0 if keep else None,
            refine=not keep,
            view_errors=self.errors,
        )
        further = [Columns.none(self.cells)]
        if turning:
            further.append(turning_modes(self.cells, TURNING_ORDER))
        if swapped:
            further = [swapped_modes(self.cells)]
        tried = [self._tried(pilot.model, columns) for columns in further]
        return min(tried, key=lambda one: one.loss)

    def _tried(self, model: Model, columns: Columns) -> Tried:
        basis = Basis("isotropic", max(ORDERS))
        slopes = shape_slopes(model, self.cells).mean(2)  # what the folds know of the shapes, to first order
        fixed, lobes = model.lobes.columns(self.cells)
        design = np.hstack([slopes, columns.values, basis.design(self.cells)])
        folded = FoldedDesign(design, self.weight, self.fold, self.common)
        sums = folded.statistics(self.cells.value - fixed[:, None], lobes)
        upper, size = model.lobes.upper_bounds(), level(self.cells)

        def tries() -> Iterator[tuple[float, int, np.ndarray, int, Statistics]]:
            for order in ORDERS:
                degree = np.concatenate([columns.degree, Basis("isotropic", order).degree()])
                part = sums.prefix(slopes.shape[1] + len(degree))
                rest, whole = part.without_each(), part.total()
                for prior in PRIORS:
                    known = np.full((len(size), slopes.shape[1]), SHAPE_DOUBT**-2)
                    penalty = np.hstack([known, prior.precision(degree, size)])
                    solution = solve(rest, Factors(rest.modes_gram, penalty), upper)
                    yield float(part.residual(solution).sum()), order, penalty, part.modes, whole

        loss, order, penalty, modes, whole = min(tries(), key=lambda one: one[0])
        own = solve(whole, Factors(whole.modes_gram, penalty), upper)[0]
        predicted = fixed[:, None] + design[:, :modes] @ own[:, :modes].T + lobes @ own[:, modes:].T
        return Tried(model, columns, order, penalty, loss, predicted)

    def chance(self, still: Tried, turns: Tried) -> float:
        """Probability of odds as high if the rotations of the views mean nothing.

        By Student's distribution for a further draw, from the odds of sets whose rotations were dealt out anew.
        """
        rng = np.random.default_rng(0)
        lobes, turning = turns.model.lobes, len(turns.columns.degree) > 0
        draws = []
        for _ in range(SHUFFLES):
            trial = replace(self, cells=shuffled(self.cells, rng))
            odds = self.log_odds(still, trial.fitted(lobes, turning=turning, anew=True))
            draws.append(max(odds, 0.0))  # a model that may turn need not
        spread = max(float(np.std(draws, ddof=1)), LEAST_SPREAD) * np.sqrt(1.0 + 1.0 / SHUFFLES)
        excess = (self.log_odds(still, turns) - np.mean(draws)) / spread
        return float(stdtr(SHUFFLES - 1, -excess))

    def accounts(self, still: Tried, turns: Tried) -> bool:
        """Whether ``turns`` misses no more than errors do, or little of what ``still`` misses.

        Of two models that are both far off the better one proves nothing: a peak of an odd shape gives such pairs.
        """
        errors = float(independence(self.cells).sum()) * self.weight.shape[1]
        return turns.loss <= max(ADEQUATE * errors, REST * still.loss)

    def log_odds(self, one: Tried, other: Tried) -> float:
        """Natural logarithm of the odds for ``other`` against ``one``."""
        return 0.5 * self.values * float(np.log(one.loss / other.loss))

    def could_show(self, still: Tried) -> float:
        """Least log odds, over the azimuths of its axes, that a surface like ``still`` but turning would have had."""
        model = still.model
        slopes, (_, lobes) = shape_slopes(model, self.cells).mean(2), model.lobes.columns(self.cells)
        design = np.hstack(
            [slopes, still.columns.values, Basis("isotropic", still.order).design(self.cells), lobes]
        )
        free = np.full((len(still.penalty), lobes.shape[1]), FREE)
        penalty = np.hstack([still.penalty, free])
        folded = FoldedDesign(design, self.weight, np.zeros(len(self.cells), int), self.common)
        factors = Factors(folded.modes_gram, penalty)
        rises = []
        for part in _turning_parts(model, self.cells):
            sums = folded.statistics(part, np.empty((len(self.cells), 0)))
            rises.append(float(sums.residual(solve(sums, factors, np.empty(0))).sum()))
        return 0.5 * self.values * float(np.log1p(min(rises) / still.loss))


def shuffled(cells: Cells, rng: np.random.Generator) -> Cells:
    """The same views of an isotropic surface, with the rotations at which they saw it dealt out anew."""
    _, unit = np.unique(cells.group, return_inverse=True) if cells.binned else (None, np.arange(len(cells)))
    unit = unit.ravel()
    toward = np.sin(cells.theta_r) * np.exp(1j * cells.phi_r)
    rotation = np.angle(np.bincount(unit, toward.real) + 1j * np.bincount(unit, toward.imag))
    turn = (rng.permutation(rotation) - rotation)[unit]
    return replace(cells, phi_i=cells.phi_i + turn, phi_r=cells.phi_r + turn)


def units_of(cells: Cells) -> np.ndarray:
    """(n,) what hangs together: a view where there are several, else a block of neighbouring directions."""
    return cells.group if len(np.unique(cells.group)) >= LEAST_VIEWS else blocks_of(cells)


def _turning_parts(model: Model, cells: Cells) -> list[np.ndarray]:
    """What would turn, (n, c) each, if the roughnesses had the ratio :data:`TOLD` along several axes.

    Without a lobe that shows: :data:`TOLD_SHARE` of the model in the broadest waves that turn.
    """
    azimuths = 0.5 * np.pi * np.arange(4)
    value = model.evaluate(cells)
    if not glossy(model, cells):
        both = np.sin(cells.theta_i) * np.sin(cells.theta_r)
        psi = cells.phi_i + cells.phi_r
        return [TOLD_SHARE * value * (both * np.cos(psi - azimuth))[:, None] for azimuth in azimuths]
    return _stretched(model, cells)


def glossy(model: Model, cells: Cells) -> bool:
    """Whether there is a gloss whose roughness matters where data lie."""
    if not model.lobes.families:
        return False
    changed = _stretched(model, cells)[0]
    return bool(np.mean(changed**2) >= MATERIAL**2 * np.mean(model.evaluate(cells) ** 2))


def _stretched(model: Model, cells: Cells) -> list[np.ndarray]:
    """The first lobe's change, (n, c) each, where its roughnesses have the ratio :data:`TOLD` along several axes."""
    size, plain = 0.5 * np.log(TOLD), turned(model.lobes)
    parts, value = [], model.evaluate(cells)
    for azimuth in 0.5 * np.pi * np.arange(4):
        turn = np.exp(size * np.array([np.cos(azimuth), np.sin(azimuth)]))
        shape = np.array([*plain.shapes[0][:-2], *turn])
        lobes = LobeSet(plain.families, (shape, *plain.shapes[1:]))
        parts.append(replace(model, lobes=lobes).evaluate(cells) - value)
    return parts


def difference(one: Tried, other: Tried) -> float:
    """Rms by which two models differ where data lie, of f."""
    return float(np.sqrt(np.mean((one.predicted - other.predicted) ** 2) / np.mean(one.predicted**2)))
