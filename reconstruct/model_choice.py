"""Which model a table is fitted by: orders, priors and lobes are tried on folds, and what predicts as well is kept.

A model is chosen by what it predicts of data left out; those that predict as well say how unsure the choice is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.estimate.lobe_search import common_error, search_lobes, thinned
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model_averaging import believed, rivals_of
from photogonio.reconstruct.estimate.model_selection import (
    NO_PRIOR,
    PRIORS,
    Candidate,
    Prior,
    choose,
    crosses,
    try_all,
)
from photogonio.reconstruct.estimate.pilot import PILOT_PRIOR, Cleaned
from photogonio.reconstruct.estimate.weights import independence, level
from photogonio.reconstruct.rows.row_average import Average
from photogonio.reconstruct.rows.row_models import beats, loss_of, losses_of
from photogonio.reconstruct.rows.well_determined import close_to_rows
from photogonio.reconstruct.table.cells import Cells, few_of
from photogonio.reconstruct.uncertainty.budget import Rival, uncertainty_of

HIGHEST_AUTO = 8  # order that is tried on photos: the paper's own limit for practical work
HIGHEST_AUTO_TABLE = 12
HIGHER_AUTO_TABLE = (16, 20, 24)  # on, while the one before predicts best: for odd glosses
HIGHEST_AUTO_TURNING = 4  # of a surface that is not isotropic: 120 modes
HIGHEST_ASKED, HIGHEST_ASKED_TURNING = 48, 16  # 5525 modes; of others, more than MOST_MODES from 8 on
MOST_MODES = 1300  # of those asked for
TOLERATED = 0.0015  # relative misfit of photos that buys no finer model
ROWS_A_MODE = 1.9  # so many tell orders beyond those of averages
ORDERS_BESIDE = (2, 6, 12, 16, 20, 24)  # of single models that are held against an average
PRIORS_BESIDE = tuple(Prior(strength, 1.0) for strength in (0.01, 0.1, 1.0))
MOST_CHANNELS = 6  # of more each order tried costs seconds, and each beyond the usual ones gigabytes
ORDERS_OF_SPECTRA = (0, 2, 4, 8)
FEWEST_ROWS = 20  # of a table, for an average of models


@dataclass(frozen=True, slots=True)
class FitOptions:
    """What the user asks for; None leaves the choice to the data."""

    order: int | None = None
    symmetry: str = "auto"
    lobes: int | None = None
    theta_max: float = np.radians(80.0)  # cells beyond are not used
    absolute: bool = True  # the table's scale
    physics: str = "auto"  # "auto": where the plain fit is unphysical by more than its error | "on" | "off"
    robust: bool = True  # single cells that contradict the others lose their say
    smooth: bool = True  # a prior of smooth modes; False: least squares alone
    quantity: str = "brdf"  # another: the paper's own fit of it (photogonio.reconstruct.paper_fit)

    def asked(self) -> list[str]:
        """What of the model was asked for, by its names in diagnostics."""
        told = {
            "order": self.order is not None,
            "lobes": self.lobes is not None,
            "prior strength": not self.smooth,
        }
        return [name for name, given in told.items() if given]


AUTOMATIC = FitOptions()  # everything is chosen from the data


def asks_for_average(seen: Cells, options: FitOptions) -> bool:
    """Whether an average of models may be the result: of measured rows, with everything automatic."""
    auto = options.order is None and options.lobes is None and options.smooth
    return auto and not seen.binned and len(seen) >= FEWEST_ROWS and options.symmetry in ("auto", "isotropic")


def beaten(average: Average, work: Cleaned) -> bool:
    """Whether lobes of searched shapes, beside modes of some order, predict rows left out much better: on those of
    which the average is, of a spectrum in some channels."""
    pilot = work.reference
    few = np.arange(0, len(work.cells), -(-len(work.cells) // len(average.fold)))
    some = few_of(len(work.cells.channels), MOST_CHANNELS)
    cells, weight = work.cells.take(few).of_channels(some), (work.deviation[few] * pilot.scale) ** -2.0
    weight, left_out = weight[:, some], average.left_out[:, some]
    for order in ORDERS_BESIDE:
        if order > average.model.basis.order and len(weight) < ROWS_A_MODE * len(
            Basis("isotropic", order).modes
        ):
            break
        lobes = [one.model.lobes for one in work.pilots]
        tried = try_all(cells, weight, "isotropic", (order,), lobes, priors=PRIORS_BESIDE)
        best = min(tried, key=lambda one: one.mean)
        own = losses_of(best, cells, average.fold, pilot.scale)
        if beats(own, loss_of(cells, left_out, average.fold)):
            return True
    return False


def select(work: Cleaned, options: FitOptions, symmetry: str) -> tuple[list[Candidate], Candidate, Candidate]:
    """All candidates, the chosen and the best, all weighed with the likeliest pilot's robust weights."""
    cells, pilot = work.cells, work.reference.model
    errors = work.scales.error
    again = search_lobes(
        cells, work.deviation, pilot.basis, PILOT_PRIOR, pilot.lobes, free=0, refine=False, view_errors=errors
    )
    weight = independence(cells) * again.weight / (work.deviation * again.scale) ** 2
    common = common_error(cells, cells.value - again.residual, errors)
    wanted = [p.model.lobes for p in work.pilots if options.lobes in (None, len(p.model.lobes.families))]
    tolerated, thrifty = _tolerated(cells, work.deviation * again.scale), crosses(cells)
    alone = options.order is not None and options.lobes == 0 and not cells.binned
    priors = (*(PRIORS if options.smooth else ()), *((NO_PRIOR,) if alone or not options.smooth else ()))
    tried = try_all(cells, weight, symmetry, _orders(options, cells, symmetry), wanted, common, priors)
    if alone:
        tried = close_to_rows(tried, cells, weight, symmetry)
    chosen, best = choose(tried, tolerated, thrifty=thrifty)
    for order in HIGHER_AUTO_TABLE if _may_be_finer(options, cells, symmetry) else ():
        tried += try_all(cells, weight, symmetry, (order,), wanted, common, priors)
        chosen, best = choose(tried, tolerated, thrifty=thrifty)
        if best.order < order:
            break
    return tried, chosen, best


def _may_be_finer(options: FitOptions, cells: Cells, symmetry: str) -> bool:
    """Whether orders beyond the usual ones may be tried: of measured rows, of an isotropic surface."""
    few = len(cells.channels) <= MOST_CHANNELS
    return options.order is None and not cells.binned and symmetry == "isotropic" and few


def _tolerated(cells: Cells, deviation: np.ndarray) -> float:
    """The loss of a misfit of :data:`TOLERATED` throughout; none for measurements that carry their own errors."""
    if not cells.binned:
        return 0.0
    relative = np.median(deviation / np.maximum(np.abs(cells.value), 1e-3 * level(cells)))
    return float((TOLERATED / relative) ** 2)


def refuse_order(options: FitOptions, symmetry: str) -> None:
    """Raises InputError for an order that was asked for and is too high."""
    if options.order is None:
        return
    highest = HIGHEST_ASKED if symmetry == "isotropic" else HIGHEST_ASKED_TURNING
    if options.order > highest:
        raise InputError(
            f"--order {options.order}", f"{symmetry} modes are fitted to order {highest} at most"
        )
    modes = len(Basis(symmetry, options.order).modes)
    if modes > MOST_MODES and symmetry != "isotropic":
        raise InputError(
            f"--order {options.order}",
            f"{symmetry} modes to that order are {modes}; at most {MOST_MODES} are fitted",
        )


def _orders(options: FitOptions, cells: Cells, symmetry: str) -> tuple[int, ...]:
    refuse_order(options, symmetry)
    if options.order is not None:
        return (options.order,)
    if symmetry != "isotropic":
        return tuple(range(HIGHEST_AUTO_TURNING + 1))
    if len(cells.channels) > MOST_CHANNELS:
        return ORDERS_OF_SPECTRA
    return tuple(range((HIGHEST_AUTO if cells.binned else HIGHEST_AUTO_TABLE) + 1))


def predicting_alike(
    tried: list[Candidate], chosen: Candidate, cells: Cells
) -> list[tuple[Candidate, float]]:
    """Models with the chosen lobes that predict as well, with their weights."""
    same = [one for one in tried if one.lobes is chosen.lobes]
    return believed(same, float(independence(cells).sum()))


def rivals(tried: list[Candidate], chosen: Candidate, work: Cleaned, symmetry: str) -> tuple[Rival, ...]:
    """Models with other lobes that predict as well, on thinned cells; those of more lobes than the chosen with how
    sure they are, which the chosen's own covariance does not tell."""
    cells, deviation = thinned(work.cells, work.deviation)
    errors, rivals = work.scales.error, []
    for one, weight in rivals_of(chosen, tried, float(independence(work.cells).sum())):
        basis = Basis(symmetry, one.order)
        fitted = search_lobes(
            cells, deviation, basis, one.prior, one.lobes, free=0, refine=False, view_errors=errors
        )
        spread = None
        if len(one.lobes.families) > len(chosen.lobes.families):
            spread = uncertainty_of(fitted, cells, deviation, [(one, 1.0)], view_errors=errors)
        rivals.append(Rival(fitted.model, weight, spread))
    return tuple(rivals)
