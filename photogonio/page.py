"""A result as a page: pictures, summary, and tables in words and numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from photogonio import __version__
from photogonio.calibration_page import calibration_sections
from photogonio.options import Choice
from reconstruct.brdf import Brdf
from reconstruct.plots import correlation, coverage_figure, lobes_figure, scatter_figure
from reconstruct.report import (
    Card,
    Picture,
    Report,
    Section,
    Table,
    embed,
    image_bytes,
    picture_bytes,
    render_report,
)
from reconstruct.shading import BALL_LIGHTS, shaded_sphere, to_display

if TYPE_CHECKING:
    from photogonio.pipeline import Result
    from reconstruct.fit import FitResult

_LEADING = 12  # modes shown before the fold


@dataclass(frozen=True, slots=True)
class Drawn:
    """One picture, as file and on the page."""

    name: str  # of the file, without suffix
    title: str
    caption: str
    png: bytes


def fit_choices(fit: FitResult) -> tuple[Choice, ...]:
    """What the fit chose, with its reasons."""
    said = fit.diagnostics.get("choices")
    if said is not None:
        return tuple(Choice(one["what"], _short(one["value"]), one["reason"]) for one in said)
    found = fit.diagnostics
    reason = "the simplest of the models tried that predicts left-out cells as well as the best"
    names = [name for name in ("order", "lobes", "prior strength") if name in found]
    return tuple(Choice(name, _short(found[name]), reason) for name in names)


def rescaled(fit: FitResult) -> list[tuple[str, float]]:
    """Views whose scale the fit did not believe, and the factor by which their values were off."""
    return [
        (name, float(fit.scales.factor[g])) for g, name in enumerate(fit.cells.groups) if fit.scales.freed[g]
    ]


def stray_share(fit: FitResult) -> tuple[float, float]:
    """Stray light that was removed, over the value: median and 95 % quantile of the cells."""
    share = np.abs(fit.stray).sum(1) / np.maximum(np.abs(fit.cells.value).sum(1), np.finfo(float).tiny)
    return float(np.median(share)), float(np.quantile(share, 0.95))


def _corrections(fit: FitResult) -> Section:
    median, most = stray_share(fit)
    said = f"{100 * median:.2f} % of the value in the median, {100 * most:.1f} % in one cell of twenty"
    rows = [("stray light of the surroundings", said if most > 0 else "not known, none removed")]
    rows += [(f"scale of {name}", f"{factor - 1:+.1%}") for name, factor in rescaled(fit)]
    return Section("Corrections", Table(("what", "removed"), rows))


def _short(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def draw_pictures(result: Result, *, source: str) -> tuple[Drawn, ...]:
    """Coverage, fit and lobes; ``source`` is kept in each file."""
    brdf, cells = result.brdf, result.fit.cells
    valid = np.radians(brdf.valid.get("theta_r_max", 90.0))
    figures = (
        (
            "coverage",
            "Coverage of the facet pairs",
            "Exit directions seen, by the angle of incidence: equal-area disks, the light at the "
            "orange dot, rings at 30 and 60 degrees. Grey: no sample.",
            coverage_figure(result.table),
        ),
        (
            "fit",
            "Fitted against observed",
            "One dot a facet pair and photo. On the line the fit says what was seen.",
            scatter_figure(cells.value, result.fit.predicted, brdf.channels),
        ),
        (
            "lobes",
            "Lobes",
            "f in the plane of incidence; the arrow is the light. Dashed: beyond the angles that were seen.",
            lobes_figure(brdf, brdf.channels, valid=valid),
        ),
    )
    return tuple(
        Drawn(name, title, caption, picture_bytes(figure, source=source))
        for name, title, caption, figure in figures
    )


def report_html(result: Result, pictures: Sequence[Drawn]) -> str:
    """The report of a result."""
    return render_report(
        Report(
            title=result.name,
            lead=lead(result),
            sphere=embed(image_bytes(_ball(result.brdf))),
            cards=_cards(result),
            choices=Table(
                ("what", "chosen", "reason"), [(c.what, c.value, c.reason) for c in result.choices]
            ),
            pictures=[Picture(p.title, p.caption, embed(p.png)) for p in pictures],
            coefficients_text=_coefficients_text(result.brdf),
            leading_modes=_modes(result.brdf, _LEADING),
            all_modes=_modes(result.brdf, None),
            calibration=(_corrections(result.fit), *calibration_sections(result.setup, result.table))
            if result.setup
            else (),
            warnings=result.warnings,
            left_out=[(photo.name, photo.reason) for photo in result.left_out],
            provenance=_provenance(result),
        )
    )


def numbers(result: Result) -> dict[str, object]:
    """The result's numbers, for ``--json``."""
    brdf = result.brdf
    observed, fitted = result.fit.cells.value, result.fit.predicted
    rms, median = relative_misfit(observed, fitted)
    return {
        "name": result.name,
        "order": brdf.order,
        "symmetry": brdf.symmetry,
        "quantity": brdf.quantity,
        "scale": brdf.scale,
        "channels": brdf.channels,
        "modes": len(brdf.modes),
        "lobes": [
            {"model": lobe.model, "roughness": lobe.roughness, "f0": lobe.f0, "weight": lobe.weight}
            for lobe in brdf.lobes
        ],
        "albedo": brdf.bihemispherical_albedo(),
        "relative_rms": rms,
        "relative_median": median,
        "correlation": [correlation(observed[:, k], fitted[:, k]) for k in range(observed.shape[1])],
        "valid": brdf.valid,
        "stray_light": stray_share(result.fit) if result.setup else None,
        "rescaled": dict(rescaled(result.fit)),
        "level": result.table.level,
        "cells": len(observed),
        "samples": float(result.table.count.sum()),
        "photos_used": photos_used(result) if result.setup else None,
        "choices": {
            choice.what: {"value": choice.value, "reason": choice.reason} for choice in result.choices
        },
        "left_out": [{"photo": photo.name, "reason": photo.reason} for photo in result.left_out],
        "warnings": result.warnings,
        "source": result.provenance.to_dict(),
    }


def relative_misfit(observed: np.ndarray, fitted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Root mean square and median of |fitted - observed| / observed over the cells with f above 0, (c,) each."""
    ratio = np.divide(fitted - observed, observed, out=np.full_like(observed, np.nan), where=observed > 0)
    return np.sqrt(np.nanmean(ratio**2, axis=0)), np.nanmedian(np.abs(ratio), axis=0)


def photos_used(result: Result) -> int:
    """Views that gave the table something."""
    return len(np.unique(result.table.group))


def lead(result: Result) -> str:
    """The result in one sentence."""
    brdf = result.brdf
    lobes = f"{len(brdf.lobes)} lobe{'s' if len(brdf.lobes) != 1 else ''}" if brdf.lobes else "no lobe"
    scale = "in absolute units" if brdf.scale == "absolute" else "on a relative scale: no white reference"
    text = f"{brdf.symmetry.capitalize()} BRDF of order {brdf.order} with {lobes}, {scale}."
    if result.setup is None:
        return f"{text} From {len(result.table)} measured pairs of directions."
    used, out = photos_used(result), len(result.left_out)
    return f"{text} From {used} photo{'s' if used != 1 else ''}" + (f", {out} left out." if out else ".")


def closing_lines(result: Result) -> str:
    """What is told at the end, on screen."""
    values = numbers(result)
    order = ", ".join(result.brdf.channels)
    median, rms = (100 * values[name] for name in ("relative_median", "relative_rms"))
    return (
        f"{lead(result)}\n"
        f"albedo under even light ({order}): {_list(values['albedo'], '.3f')}\n"
        f"misfit of the cells ({order}): median {_list(median, '.2f')} %, rms {_list(rms, '.2f')} %"
    )


def _cards(result: Result) -> list[Card]:
    brdf = result.brdf
    values = numbers(result)
    order = ", ".join(brdf.channels)
    cards = [
        Card("model", f"order {brdf.order}", f"{len(brdf.modes)} modes, {len(brdf.lobes)} lobes"),
        Card("albedo", _list(values["albedo"], ".3f"), f"{order}; under even light"),
        Card(
            "misfit",
            _list(100 * values["relative_median"], ".2f") + " %",
            f"{order}; median of the cells; rms {_list(100 * values['relative_rms'], '.2f')} %",
        ),
        Card("correlation", _list(values["correlation"], ".4f"), f"{order}; fitted against observed"),
    ]
    if brdf.valid:
        angles = f"{brdf.valid.get('theta_i_max', 90):.0f}° / {brdf.valid.get('theta_r_max', 90):.0f}°"
        cards.append(Card("valid up to", angles, "incident / exit angle"))
    samples = f"{values['samples']:,.0f} samples" if result.table.level >= 0 else "measurements"
    cards.append(Card("observations", f"{values['cells']:,}", f"facet pairs from {samples}"))
    return cards


def _list(values: Sequence[float], form: str) -> str:
    return " · ".join(format(float(value), form) for value in values)


def _ball(brdf: Brdf) -> np.ndarray:
    light = BALL_LIGHTS["over the shoulder"]
    return to_display(shaded_sphere(brdf, light, size=352), background=1.0)


def _coefficients_text(brdf: Brdf) -> str:
    text = "Coefficients of the orthonormal modes, largest first, with their standard errors."
    for lobe in brdf.lobes:
        f0, weight = _list(lobe.f0, ".4g"), _list(lobe.weight, ".4g")
        text += f" Lobe: GGX of roughness {lobe.roughness:.3f}, base reflectance {f0}, weight {weight}."
    return text


def _modes(brdf: Brdf, count: int | None) -> Table:
    indices = ("n", "m", "l") if brdf.symmetry == "isotropic" else ("n", "l", "n′", "l′")
    head = [*indices, *(text for name in brdf.channels for text in (name, "±"))]
    size = np.abs(brdf.coefficients).max(1)
    rows = []
    for k in np.argsort(-size, kind="stable")[:count]:
        pairs = zip(brdf.coefficients[k], brdf.standard_errors[k], strict=True)
        rows.append(
            [str(int(n)) for n in brdf.modes[k]]
            + [text for value, error in pairs for text in (f"{value:.5f}", _error(error))]
        )
    return Table(head, rows)


def _error(value: float) -> str:
    return f"{value:.5f}" if np.isfinite(value) else "–"


def _provenance(result: Result) -> Table:
    rows = [("program", f"photogonio {__version__}"), ("command", result.provenance.command)]
    rows += [(name, f"SHA-256 {digest}") for name, digest in result.provenance.inputs.items()]
    return Table(("what", "which"), rows)
