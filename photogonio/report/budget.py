"""The uncertainty budget of a result: what leaves its albedo and f unsure, and how much each counts.

In the form of the GUM (JCGM 100:2008, table H.1): a source, its value and standard uncertainty, the sensitivity of the
result to it, and its share of the result's variance. All is computed from the coefficient file alone (docs/modes.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from photogonio.reconstruct.brdf.parameters import lobe_parameter, number_of, slopes
from photogonio.reconstruct.brdf.spread import albedo_beyond, albedo_slopes
from photogonio.report.sections import Section, Table

if TYPE_CHECKING:
    from photogonio.reconstruct.brdf.brdf import Brdf
    from photogonio.reconstruct.brdf.errors import Uncertain

MOST_MODES = 5  # that are listed one by one; more are one source together
PAIRS = {"f at 45/0 degrees": (45.0, 0.0, 180.0), "f at 45 degrees, mirrored": (45.0, 45.0, 180.0)}
BEYOND = {
    "scale": "scale that all photos share",
    "misfit": "what all photos miss alike",
    "unseen": "what was not seen, and other models",
}


@dataclass(frozen=True, slots=True)
class Source:
    """One input; NaN: several numbers together, which have no one value or sensitivity."""

    name: str
    value: np.ndarray  # (c,)
    error: np.ndarray  # (c,) standard uncertainty
    sensitivity: np.ndarray  # (c,) derivative of the result
    share: np.ndarray  # (c,) of the variance, with half of what is correlated with others; may be negative


@dataclass(frozen=True, slots=True)
class Budget:
    """Of one result."""

    of: str
    value: np.ndarray  # (c,)
    error: np.ndarray  # (c,) standard uncertainty
    sources: tuple[Source, ...]


def budgets(brdf: Brdf) -> tuple[Budget, ...]:
    """Of the albedo under even light, and of f at two pairs of directions; none where the file knows no errors."""
    known = brdf.uncertainty
    if known is None or not np.isfinite(known.spread()).all():
        return ()
    albedo = brdf.bihemispherical_albedo()
    made = [_budget("albedo", brdf, known, albedo, albedo_slopes(brdf, known), albedo_beyond(brdf, known))]
    for name, pair in PAIRS.items():
        theta_i, theta_r, dphi = (np.radians([angle]) for angle in pair)
        where = (theta_i, 0.0 * theta_i, theta_r, dphi)
        beyond = {"scale": np.full(len(albedo), known.scale)}
        for key, table in (("misfit", known.misfit), ("unseen", known.unseen)):
            relative = 0.0 if table is None else float(table.at(theta_i, theta_r, dphi)[0])
            beyond[key] = np.full(len(albedo), relative)
        change = slopes(brdf, where, known.parameters)[0]
        made.append(_budget(name, brdf, known, brdf.evaluate(*where)[0], change, beyond))
    return tuple(made)


def _budget(
    of: str,
    brdf: Brdf,
    known: Uncertain,
    value: np.ndarray,
    change: np.ndarray,
    beyond: dict[str, np.ndarray],
) -> Budget:
    """``change`` (p, c) are the derivatives by the parameters, ``beyond`` relative errors (c,) that none says."""
    parts = change * np.einsum("cpq,qc->pc", known.spread(), change)
    others = {key: (relative * value) ** 2 for key, relative in beyond.items()}
    variance = np.maximum(parts.sum(0), 0.0) + sum(others.values(), np.zeros_like(value))
    whole = np.maximum(variance, np.finfo(float).tiny)
    sources = [*_modes(brdf, known, change, parts / whole), *_lobes(brdf, known, change, parts / whole)]
    one = np.ones_like(value)
    sources += [
        Source(name, one, beyond[key], value, others[key] / whole)
        for key, name in BEYOND.items()
        if beyond[key].any()
    ]
    return Budget(of, value, np.sqrt(variance), tuple(sources))


def _modes(brdf: Brdf, known: Uncertain, change: np.ndarray, share: np.ndarray) -> list[Source]:
    count = len(brdf.modes)
    if count > MOST_MODES:
        several = np.full(len(brdf.channels), np.nan)
        return [Source(f"{count} modes together", several, several, several, share[:count].sum(0))]
    return [
        Source(known.parameters[k], brdf.coefficients[k], known.standard_errors[k], change[k], share[k])
        for k in range(count)
    ]


def _lobes(brdf: Brdf, known: Uncertain, change: np.ndarray, share: np.ndarray) -> list[Source]:
    sources = []
    for k, name in enumerate(known.parameters[len(brdf.modes) :], start=len(brdf.modes)):
        found = lobe_parameter(name, brdf.lobes)
        if found is not None:
            value = number_of(brdf.lobes[found[0]], found[1])
            sources.append(Source(name, value, known.standard_errors[k], change[k], share[k]))
    return sources


def budget_numbers(brdf: Brdf) -> list[dict[str, object]]:
    """For ``--json``."""
    return [
        {
            "of": one.of,
            "value": one.value,
            "standard_error": one.error,
            "sources": [
                {
                    "source": source.name,
                    "value": source.value,
                    "standard_error": source.error,
                    "sensitivity": source.sensitivity,
                    "share": source.share,
                }
                for source in one.sources
            ],
        }
        for one in budgets(brdf)
    ]


def budget_sections(brdf: Brdf) -> list[Section]:
    """For the report: a table for each result, of the channel that is known worst."""
    sections = []
    for one in budgets(brdf):
        c = int(np.argmax(one.error / np.maximum(np.abs(one.value), np.finfo(float).tiny)))
        rows = [_row(source, c) for source in one.sources]
        whole = ("all together", f"{one.value[c]:.4g}", f"{one.error[c]:.2g}", "–", "100 %")
        text = (
            f"{one.of.capitalize()} in {brdf.channels[c]}, the channel known worst: {one.value[c]:.4g}, "
            f"95 % interval ± {1.96 * one.error[c]:.2g}."
        )
        sections.append(Section(one.of, Table(HEAD, [*rows, whole]), text))
    return sections


HEAD: Sequence[str] = ("source", "value", "standard uncertainty", "sensitivity", "share of the variance")


def _row(source: Source, c: int) -> tuple[str, ...]:
    numbers = (f"{source.value[c]:.4g}", f"{source.error[c]:.2g}", f"{source.sensitivity[c]:.3g}")
    return (source.name, *("–" if one == "nan" else one for one in numbers), f"{100 * source.share[c]:.1f} %")
