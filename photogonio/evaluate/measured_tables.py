"""Measured tables, which have no known truth: how well rows that are left out are predicted, beside plain smoothers.

Five folds of blocks of neighbouring pairs, reciprocal twins together: each is predicted from the others by a fit with
everything automatic, by least squares on isotropic modes of order 4, by a smooth ridge to order 12, and by a thin plate
spline over what isotropy leaves of the directions.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import RBFInterpolator

from photogonio.capture.errors import InputError
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model_selection import blocks_of, folds_of
from photogonio.reconstruct.estimate.outlier_views import pair_places
from photogonio.reconstruct.fit import fit_table
from photogonio.reconstruct.goniometer.foreign import known_everywhere, of_coefficients
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.goniometer.told import Told
from photogonio.reconstruct.rows.smooth_ridge import ORDER, smooth_ridge
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.reconstruct.table.facet_table import FacetTable
from photogonio.reconstruct.table.goniometer_csv import samples_table
from photogonio.system.progress import Reporter

FOLDS = 5
LEAST_SQUARES = 4  # order
SMOOTHING = (1e-4, 1e-2, 1.0)  # of the spline, which inner folds choose among
NEIGHBOURS = 60  # of the spline
LEAST_HELD, MOST_HELD = 0.9, 0.98  # of left-out rows, that intervals of 95 % do well to hold


@dataclass(frozen=True, slots=True)
class TableScore:
    """Root mean square of what left-out rows are missed by, over their mean; of all channels."""

    table: str
    rows: int
    fit: float
    least_squares: float
    ridge: float
    spline: float
    held: float  # share of left-out rows that lie in the 95 % intervals of the fit that has not seen them
    seconds: float  # of processor, of one fit
    turning: int  # folds whose fit is not isotropic

    def to_dict(self) -> dict[str, object]:
        return {name: getattr(self, name) for name in self.__slots__}


def evaluate_tables(names: Sequence[str], told: Told, reporter: Reporter) -> list[TableScore]:
    """Each table, and each in each folder; what there is no table, or cannot be left out in turn, is told and passed
    over. All are read before the first is fitted.

    Raises:
        InputError: no table is named, or one that is named itself cannot be read or left out in turn.
    """
    tables: dict[Path, FacetTable] = {}
    for name in names:
        path = Path(name)
        for file in sorted(path.glob("*.csv")) if path.is_dir() else [path]:
            try:
                tables.setdefault(file.resolve(), _table_of(file, told))
            except InputError as error:
                if file == path:
                    raise
                reporter.warn(f"passed over: {error}")
    if not tables:
        raise InputError("evaluate --tables", "expected tables (.csv), or folders of them")
    scores = []
    for called, table in zip(names_of(list(tables)), tables.values(), strict=True):
        scores.append(score_of(called, table))
        reporter.say(line_of(scores[-1]))
    reporter.say(summary_of(scores))
    return scores


def _table_of(file: Path, told: Told) -> FacetTable:
    if known_everywhere(file) is not None or of_coefficients(file) is not None:
        raise InputError(file, "says f everywhere: there are no measured rows to leave out")
    table = samples_table(read_samples(file, told))
    _folds_of(str(file), cells_of(table))
    return table


def names_of(files: Sequence[Path]) -> list[str]:
    """The files' names, with as many of their folders' before them as tell each from all others."""
    result = []
    for file in files:
        depth = 1
        while (
            depth < len(file.parts) and [one.parts[-depth:] for one in files].count(file.parts[-depth:]) > 1
        ):
            depth += 1
        result.append("/".join(file.parts[-depth:]))
    return result


def line_of(score: TableScore) -> str:
    turns = f"; turning in {score.turning} of {FOLDS}" if score.turning else ""
    return (
        f"{score.table:20} {score.rows:6} rows: fit {score.fit:.4f}, least squares {score.least_squares:.4f}, "
        f"ridge {score.ridge:.4f}, spline {score.spline:.4f}; intervals of 95 % hold {100 * score.held:.1f} %; "
        f"{score.seconds:.2f} s a fit{turns}"
    )


def summary_of(scores: Sequence[TableScore]) -> str:
    """Median and mean of each way, and how the fit does against the ridge at worst."""
    lines = []
    for name in ("fit", "least_squares", "ridge", "spline"):
        errors = [getattr(score, name) for score in scores]
        lines.append(f"{name.replace('_', ' ')}: median {np.median(errors):.4f}, mean {np.mean(errors):.4f}")
    worst = max(score.fit / score.ridge for score in scores)
    well = sum(LEAST_HELD <= score.held <= MOST_HELD for score in scores)
    lines.append(f"fit over ridge, at worst: {worst:.2f}")
    lines.append(f"intervals of 95 % hold 90 to 98 % of left-out rows: {well} of {len(scores)} tables")
    return "\n".join(lines)


def score_of(name: str, table: FacetTable) -> TableScore:
    """The four ways on one table. Raises InputError where its rows lie in too few neighbourhoods."""
    cells = cells_of(table)
    fold = _folds_of(name, cells)
    found = {way: np.empty_like(cells.value) for way in ("fit", *_SMOOTHERS)}
    seconds, turning, held = 0.0, 0, 0
    for k in range(FOLDS):
        out = fold == k
        used, left = cells.take(~out), cells.take(out)
        start = time.process_time()
        fit = fit_table(table.take(~out))
        seconds += time.process_time() - start
        turning += fit.brdf.turning
        found["fit"][out] = fit.brdf.evaluate(left.theta_i, left.phi_i, left.theta_r, left.phi_r)
        low, high = fit.prediction_interval(left)
        held += int(np.sum((low <= left.value) & (left.value <= high)))
        for way, smoother in _SMOOTHERS.items():
            found[way][out] = smoother(used, left)
    errors = {way: _rms(said, cells.value) for way, said in found.items()}
    share = held / cells.value.size
    return TableScore(
        table=name, rows=len(cells), **errors, held=share, seconds=seconds / FOLDS, turning=turning
    )


def _folds_of(name: str, cells: Cells) -> np.ndarray:
    fold = block_folds(cells)
    if not np.bincount(fold, minlength=FOLDS).all():
        raise InputError(
            name,
            f"its {len(cells)} rows lie in fewer than {FOLDS} neighbourhoods, which are left out in turn",
        )
    return fold


def block_folds(cells: Cells, folds: int = FOLDS) -> np.ndarray:
    """Fold (n,) of each row: of its block of neighbouring pairs."""
    _, block = np.unique(blocks_of(cells), return_inverse=True)
    shuffled = np.random.default_rng(0).permutation(block.max() + 1)
    return shuffled[block.ravel()] % folds


def _rms(said: np.ndarray, value: np.ndarray) -> float:
    return float(np.mean(np.sqrt(np.mean((said - value) ** 2, axis=0)) / np.abs(value.mean(axis=0))))


def _least_squares(used: Cells, left: Cells) -> np.ndarray:
    basis = Basis("isotropic", LEAST_SQUARES)
    return basis.design(left) @ np.linalg.lstsq(basis.design(used), used.value, rcond=None)[0]


def _ridge(used: Cells, left: Cells) -> np.ndarray:
    basis = Basis("isotropic", ORDER)
    smooth = smooth_ridge(used, np.ones((len(used), 1)), folds_of(used), basis)
    return basis.design(left) @ smooth.coefficients


def _spline(used: Cells, left: Cells) -> np.ndarray:
    fold = block_folds(used)

    def missed(smoothing: float) -> float:
        return sum(
            float(
                np.sum(
                    (_plate(used.take(fold != k), used.take(fold == k), smoothing) - used.value[fold == k])
                    ** 2
                )
            )
            for k in range(FOLDS)
            if (fold == k).any()
        )

    return _plate(used, left, min(SMOOTHING, key=missed))


def _plate(used: Cells, left: Cells, smoothing: float) -> np.ndarray:
    """Over the places of pairs and of their reciprocal twins."""
    there, back = _places(used)
    both = np.concatenate([there, back])
    spread = 1e-6 * np.arange(len(both))[:, None]  # no two places alike
    plate = RBFInterpolator(
        both + spread,
        np.concatenate([used.value, used.value]),
        neighbors=min(NEIGHBOURS, len(both)),
        smoothing=smoothing,
    )
    return plate(_places(left)[0])


def _places(cells: Cells) -> tuple[np.ndarray, np.ndarray]:
    """(n, 4) of pairs and of their reciprocal twins."""
    return (
        pair_places(cells.theta_i, cells.theta_r, cells.dphi),
        pair_places(cells.theta_r, cells.theta_i, cells.dphi),
    )


_SMOOTHERS = {"least_squares": _least_squares, "ridge": _ridge, "spline": _spline}
