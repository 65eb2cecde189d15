"""A result as a page: pictures, summary, and tables in words and numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from photogonio import __version__
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.words import described, lobe_details, lobe_in_words
from photogonio.report.ball import BALL_LIGHTS, shaded_sphere, to_display
from photogonio.report.budget import budget_sections
from photogonio.report.calibration_page import calibration_sections
from photogonio.report.coverage_words import coverage_of
from photogonio.report.html import embed, image_bytes, interactive_text, picture_bytes, render_report
from photogonio.report.plots import coverage_figure, drawn_channels, lobes_figure, scatter_figure
from photogonio.report.sections import Card, ContactPrint, Picture, Report, Section, Table
from photogonio.report.summary import (
    albedo_note,
    count_of,
    lead,
    listed,
    median_misfit,
    numbers,
    rescaled,
    stray_share,
)
from photogonio.report.verdict import verdict_of
from photogonio.report.viewer.ball_table import ball_table
from photogonio.report.viewer.mode_map import mode_map
from photogonio.report.viewer.photo_fit import photo_fit
from photogonio.system.drawing import own_style
from photogonio.system.provenance import Provenance

if TYPE_CHECKING:
    from photogonio.reconstruct.fit import FitResult
    from photogonio.result import Result
    from photogonio.run.surroundings import LightAround

_LEADING = 12  # modes shown before the fold


@dataclass(frozen=True, slots=True)
class Drawn:
    """One picture, as file and on the page."""

    name: str  # of the file, without suffix
    title: str
    caption: str
    png: bytes


def _corrections(fit: FitResult, beside: LightAround | None) -> Section:
    median, most = stray_share(fit)
    said = f"{100 * median:.2f} % of the value in the median, {100 * most:.1f} % in one cell of twenty"
    rows = [("stray light of the surroundings", said if most > 0 else "none")]
    if beside is not None and beside.spoilt is not None:
        lost = f"{beside.spoilt.pixels} pixels of {beside.spoilt.of} left out"
        rows += [("pixels that unknown stray light may spoil", lost)]
    binned = listed(100 * np.array(fit.diagnostics["binning error"]), ".2f")
    rows += [("binning into facets", f"{binned} % of the values, rms")]
    rows += [(f"scale of {name}", f"{factor - 1:+.1%}") for name, factor in rescaled(fit)]
    return Section("Corrections", Table(("what", "removed"), rows))


@own_style()
def draw_pictures(result: Result, *, source: str) -> tuple[Drawn, ...]:
    """Coverage, fit and lobes; ``source`` is kept in each file."""
    brdf, cells = result.brdf, result.fit.cells
    valid = np.radians(brdf.valid.get("theta_r_max", 90.0))
    shown, count = drawn_channels(brdf.channels), len(brdf.channels)
    some = f" {len(shown)} of {count} channels are drawn." if len(shown) < count else ""
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
            f"One dot a facet pair and photo. On the line the fit says what was seen.{some}",
            scatter_figure(cells.value, result.fit.predicted, result.fit.brdf.channels),
        ),
        (
            "lobes",
            "Lobes",
            "f in the plane of incidence, all on one radial scale; the arrow is the light. Dashed: beyond the angles "
            f"up to which f is known to a tenth of itself.{some}",
            lobes_figure(brdf, brdf.channels, valid=valid),
        ),
    )
    return tuple(
        Drawn(name, title, caption, picture_bytes(figure, source=source))
        for name, title, caption, figure in figures
    )


def report_html(result: Result, pictures: Sequence[Drawn]) -> str:
    """The report of a result."""
    brdf, setup, coverage = result.brdf, result.setup, coverage_of(result.table)
    answers = verdict_of(result, coverage)
    told: dict[str, object] = {"table": ball_table(brdf)}
    prints: Sequence[ContactPrint] = ()
    if setup is not None:
        from photogonio.report.viewer.contact_sheet import contact_sheet  # of photos
        from photogonio.report.viewer.set_up_scene import set_up_scene

        told["scene"] = set_up_scene(setup)
        prints = contact_sheet(setup, result.left_out, result.prints)
    return render_report(
        Report(
            title=result.name,
            lead=lead(result),
            verdict=(
                ("What it is", answers.what),
                ("How sure", answers.sure),
                ("What is missing", answers.missing),
                ("What to do next", answers.next),
            ),
            told=interactive_text(told),
            parts=("ball", "set-up") if setup else ("ball",),
            turning=brdf.turning,
            sphere=embed(image_bytes(_ball(brdf))),
            cards=_cards(result),
            choices=Table(
                ("what", "chosen", "reason"), [(c.what, c.value, c.reason) for c in result.choices]
            ),
            prints=prints,
            coverage=coverage.said,
            pictures=[Picture(p.title, p.caption, embed(p.png)) for p in pictures],
            coefficients_text=_coefficients_text(brdf),
            modes=mode_map(brdf),
            tables=[one for one in (_by_photo(result),) if one is not None],
            leading_modes=_modes(brdf, _LEADING),
            all_modes=_modes(brdf, None),
            budget=budget_sections(brdf),
            calibration=(_corrections(result.fit, result.beside), *calibration_sections(setup, result.table))
            if setup
            else (),
            warnings=_other_warnings(result),
            left_out=[(photo.name, photo.reason) for photo in result.left_out],
            provenance=provenance_table(result.provenance),
        )
    )


def _by_photo(result: Result) -> Section | None:
    fit = result.fit
    return photo_fit(fit.cells, fit.predicted, fit.weight) if result.setup is not None else None


def _other_warnings(result: Result) -> list[tuple[str, str]]:
    """Codes and words of what is told, but for left-out photos, which have a table of their own."""
    out = tuple(f"{photo.name}: left out" for photo in result.left_out)
    return [(one.code, one.message) for one in result.diagnoses if not one.message.startswith(out)]


def _cards(result: Result) -> list[Card]:
    brdf = result.brdf
    values = numbers(result)
    order = ", ".join(brdf.channels)
    cards = [
        Card(f"not to be trusted: {one.code}", one.found, f"likeliest cause: {one.cause}", alarm=True)
        for one in result.faults
    ]
    cards += [
        Card(
            "model",
            f"order {brdf.order}, {count_of(len(brdf.lobes), 'lobe')}",
            f"{described(brdf)}; {count_of(len(brdf.modes), 'mode')}",
        ),
        Card("albedo", listed(values["albedo"], ".3f"), f"{order}; {albedo_note(brdf)}"),
        Card(
            "misfit",
            median_misfit(values),
            f"{order}; median of the cells; rms {listed(100 * values['relative_rms'], '.2f')} %",
        ),
        Card("correlation", listed(values["correlation"], ".4f"), f"{order}; fitted against observed"),
    ]
    if brdf.valid:
        angles = f"{brdf.valid.get('theta_i_max', 90):.0f}° / {brdf.valid.get('theta_r_max', 90):.0f}°"
        cards.append(Card("valid up to", angles, "incident / exit angle"))
    samples = f"{values['samples']:,.0f} samples" if result.table.level >= 0 else "measurements"
    cards.append(Card("observations", f"{values['cells']:,}", f"facet pairs from {samples}"))
    return cards


def _ball(brdf: Brdf) -> np.ndarray:
    light = BALL_LIGHTS["over the shoulder"]
    return to_display(shaded_sphere(brdf, light, size=352), background=1.0)


def _coefficients_text(brdf: Brdf) -> str:
    text = "Coefficients of the orthonormal modes, largest first, with their standard errors."
    for lobe in brdf.lobes:
        text += f" Then {lobe_in_words(lobe)}: {lobe_details(lobe)}."
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


def provenance_table(source: Provenance) -> Table:
    """Program, command and inputs."""
    rows = [("program", f"photogonio {__version__}"), ("command", source.command)]
    rows += [(name, f"SHA-256 {digest}") for name, digest in source.inputs.items()]
    return Table(("what", "which"), rows)
