"""One scale for several sessions of a sample: each weighs as its own error of scale has it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from photogonio.calib.setup import Setup
from photogonio.capture.errors import InputError
from photogonio.reconstruct.estimate.session_scales import LEAST_ERROR, Offsets, session_offsets
from photogonio.reconstruct.lighting.veil_error import veil_error
from photogonio.reconstruct.table.cells import cells_of
from photogonio.reconstruct.table.facet_table import FacetTable, add_tables
from photogonio.run.circumstances import SCALE_ERROR, Circumstances, lamp_variances, phase_of, view_errors
from photogonio.run.surroundings import Shown, light_of

ANY = 10.0  # standard error of the logarithm of a scale that nothing tells
KIND = "scale-by-kind-of-paper"  # whose amount sessions on the same sheet have in common
CONTRADICTED = 3.0  # standard errors
UNKNOWN = 0.1  # relative standard error of a scale that is of no use
STEEPEST = np.radians(75.0)  # beyond, edges and what is not quite black have more say than the surface


@dataclass(frozen=True, slots=True)
class Session:
    """What one table's file holds."""

    where: str  # the file
    digest: str  # SHA-256 of it
    table: FacetTable
    known: Circumstances

    @property
    def order(self) -> tuple[str, str]:
        return self.known.name, self.digest


@dataclass(frozen=True, slots=True)
class Scales:
    """What brings k sessions to one scale."""

    factor: np.ndarray  # (k, c) of values
    doubt: np.ndarray  # (k,) relative standard error of a session's scale against the surest one's
    common: float  # relative standard error of the scale that all then have
    apart: float  # by how many of their standard errors the sessions' own scales differ

    def beside(self, veil: float) -> float:
        """What of the common error is neither every patch's nor by ``veil``, which are told apart."""
        return float(np.sqrt(max(self.common**2 - SCALE_ERROR**2 - veil**2, 0.0)))


def scales_of(moved: Sequence[Session], shown: Shown) -> Scales:
    """What brings sessions in one frame to one scale; ``shown`` is what all have around the sample.

    Raises:
        InputError: a session on a scale of its own saw too little of what the others saw, or nothing but black.
    """
    tables, known = [one.table for one in moved], [one.known for one in moved]
    table, setup = (
        add_tables(tables),
        replace(known[0].setup, views=tuple(v for k in known for v in k.setup.views)),
    )
    setup = replace(
        setup, ambient=next((k.setup.ambient for k in known if k.setup.ambient is not None), None)
    )
    cells = cells_of(table).under(lamp_variances(setup, table))
    phase = phase_of(setup)
    if phase is not None and cells.canonical and cells.binned:
        cells = cells.with_phase(phase(cells))
    cells = cells.take((np.maximum(cells.theta_i, cells.theta_r) < STEEPEST) & (cells.value > 0.0).all(1))
    session = np.repeat(np.arange(len(moved)), [len(one.groups) for one in tables])
    for k, one in enumerate(moved):
        if not np.isin(session[cells.group], k).any():
            raise InputError(one.where, f"has nothing above black below {np.degrees(STEEPEST):.0f} degrees")
    errors = view_errors(setup, table)
    stray = light_of(shown, setup, table).known
    absolute = setup.scale == "absolute"
    offsets = session_offsets(cells, session, errors, absolute=absolute, stray=stray)
    own, shared = own_errors([k.setup for k in known], tables)
    for one, sure, error in zip(moved, own, offsets.error.max(1), strict=True):
        if not np.isfinite(sure) and error > UNKNOWN:
            raise InputError(
                one.where,
                f"is on a scale of its own, and saw too little of what {moved[0].where} saw: its scale would be "
                f"unsure by {error:.0%}",
            )
    weight = np.bincount(session, np.maximum(errors, LEAST_ERROR) ** -2.0)
    return settled(offsets, own, shared, weight)


def scaled(session: Session, factor: np.ndarray, doubt: float) -> Session:
    """With values times ``factor`` (c,) of the table's channels, all of them unsure by ``doubt`` more."""
    setup, table = session.known.setup, session.table
    brighter = np.ones(len(setup.channels))
    brighter[[setup.channels.index(name) for name in table.channels]] = factor
    views = tuple(
        replace(
            view,
            strength=view.strength / brighter,
            strength_error=np.hypot(view.strength_error, doubt * view.strength) / brighter,
        )
        for view in setup.views
    )
    table = replace(
        table,
        value=table.value * factor,
        value2=table.value2 * factor**2,
        variance=table.variance * factor**2,
    )
    return replace(session, table=table, known=replace(session.known, setup=replace(setup, views=views)))


def settled(offsets: Offsets, own: np.ndarray, shared: float, weight: np.ndarray) -> Scales:
    """The likeliest scale, given ``offsets`` of the sessions' and what each is sure of.

    ``own`` (k,) are relative standard errors of the sessions' scales, infinite for relative ones, ``shared`` that which
    all have in common beside; ``weight`` (k,) what each counts for in a fit, the inverse squares of its views' errors,
    by which errors that are left add up.
    """
    k, c = offsets.value.shape
    before = np.diag(np.minimum(own, ANY) ** 2)
    against = np.eye(k)[1:] - np.eye(k)[0]
    factor, left, chi2 = np.ones((k, c)), np.zeros((c, k, k)), np.zeros(c)
    for channel in range(c):
        across = before @ against.T
        of = against @ across + np.diag(offsets.error[1:, channel] ** 2)
        off = offsets.value[1:, channel]
        gain = np.linalg.solve(of, across.T).T
        factor[:, channel] = np.exp(-gain @ off)
        left[channel] = before - gain @ across.T
        chi2[channel] = off @ np.linalg.solve(of, off)
    known = np.isfinite(own).sum()
    apart = float(np.sqrt(chi2.mean() / (known - 1))) if known > 1 else 0.0
    remaining = left.mean(0) * max(1.0, apart) ** 2
    surest = int(np.argmin(np.diag(remaining)))
    variances = np.diag(remaining) + remaining[surest, surest] - 2.0 * remaining[surest]
    variances -= 1.0 / weight + 1.0 / weight[surest]  # which the views' own errors hold
    share = weight / weight.sum()
    common = share @ remaining @ share if known else 0.0
    return Scales(factor, np.sqrt(np.maximum(variances, 0.0)), float(np.sqrt(common + shared**2)), apart)


def own_errors(setups: Sequence[Setup], tables: Sequence[FacetTable]) -> tuple[np.ndarray, float]:
    """Relative standard errors (k,) of the sessions' scales, each its own, and the one that all share: what a white
    patch is not known better than, and, where the kind of paper is the scale of all, how far such papers differ."""
    amounts = [
        max(
            (d.amount for d in one.diagnoses if d.code == KIND and d.amount <= 1.001 * one.scale_error),
            default=0.0,
        )
        for one in setups
    ]
    paper = min(amounts)
    own = [
        np.hypot(np.sqrt(max(one.scale_error**2 - paper**2, 0.0)), veil_error(table, one))
        if one.scale == "absolute"
        else np.inf
        for one, table in zip(setups, tables, strict=True)
    ]
    return np.array(own), float(np.hypot(SCALE_ERROR, paper))
