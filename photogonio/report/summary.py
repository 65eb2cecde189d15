"""A result in words and numbers: for the screen, for ``--json``, and for the report."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from photogonio.capture.diagnosis import Diagnosis, by_code
from photogonio.options import Choice
from photogonio.reconstruct.brdf.brdf import HALF_OF_95
from photogonio.reconstruct.brdf.lobe_schema import lobe_document
from photogonio.reconstruct.brdf.spread import albedo_error
from photogonio.reconstruct.brdf.words import described
from photogonio.reconstruct.modes.angles import half_difference, unit_vectors
from photogonio.reconstruct.rows.contradicted import told_of
from photogonio.reconstruct.table.facet_table import LEFT_OUT
from photogonio.report.misfit import correlation, relative_misfit
from photogonio.report.trust import trust_numbers, verdict_lines

if TYPE_CHECKING:
    from photogonio.calib.remarks import LeftOut
    from photogonio.reconstruct.brdf.brdf import Brdf
    from photogonio.reconstruct.fit import FitResult
    from photogonio.reconstruct.lighting.lamp_directions import TurnedLight
    from photogonio.reconstruct.table.cells import Cells
    from photogonio.reconstruct.table.facet_table import FacetTable
    from photogonio.result import Result
    from photogonio.run.surroundings import LightAround


CONTRADICTED = 0.05  # relative; geometry, texture and noise leave a few per cent
UNSEEN = 10.0  # degrees
# degrees: a gloss that was seen at as much incidence is hardly extrapolated. From 52, one that covered a third of a
# surface was 46 % off at 70
GRAZING = 55.0
UNSEEN_CODES = ("retro-unseen", "mirror-unseen", "gloss-extrapolated", "gloss-unseen-at-grazing")
FAINT = 0.1  # of the root mean square of f: below that stray light has its own colour
CLIPPED = 0.02  # share of a photo's pixels of the sample
TOLD_STRAY = 0.01  # of the value: less stray light that may be there is not worth a warning


def fit_choices(fit: FitResult) -> tuple[Choice, ...]:
    """What the fit chose, with its reasons."""
    said = fit.diagnostics.get("choices")
    if said is not None:
        return tuple(Choice(one["what"], _short(one["value"]), one["reason"]) for one in said)
    found = fit.diagnostics
    reason = "the simplest of the models tried that predicts left-out cells as well as the best"
    if found.get("averaged"):
        reason = "of an average of models, weighed by evidence and by how they predict rows left out"
    asked = found.get("asked", ())
    names = [name for name in ("order", "lobes", "prior strength") if name in found]
    symmetry = Choice("symmetry", fit.symmetry.symmetry, fit.symmetry.reason)
    reciprocity = Choice("reciprocity", fit.symmetry.reciprocity, fit.symmetry.exchanged)
    chosen = [Choice(name, _short(found[name]), "as asked" if name in asked else reason) for name in names]
    peaks = found.get("said in modes")
    if peaks:
        why = f"the file has no such lobe; modes to order {fit.brdf.order} say it, but for {peaks['lost']:.1%} of it"
        chosen.append(Choice("said in modes", " and ".join(peaks["peaks"]), why))
    return symmetry, reciprocity, *chosen


def rescaled(fit: FitResult) -> list[tuple[str, float]]:
    """Views whose scale the fit did not believe, and the factor by which their values were off."""
    return [
        (name, float(fit.scales.factor[g])) for g, name in enumerate(fit.cells.groups) if fit.scales.freed[g]
    ]


def rescaled_photos(fit: FitResult) -> list[Diagnosis]:
    """The same, to be told."""
    return [
        Diagnosis(
            "photo-rescaled",
            f"{name}: {factor - 1:+.1%} off the scale of the other photos; corrected",
            amount=abs(factor - 1),
            views=(name,),
            allowed=True,
        )
        for name, factor in rescaled(fit)
    ]


def contradicted_photos(fit: FitResult) -> tuple[LeftOut, ...]:
    """Photos that were reduced, and that the fit left out."""
    from photogonio.calib.remarks import LeftOut  # fits of tables do without calibration

    names = fit.diagnostics["views left out"]
    return tuple(LeftOut(name, "the other photos contradict it at the same directions") for name in names)


def physics_warnings(fit: FitResult) -> list[Diagnosis]:
    """What the fit had to be held to, or breaks too firmly to be held to."""
    found = fit.diagnostics["physics"]
    if found.get("contradicted"):
        return [
            Diagnosis(
                "physics-contradicted",
                "the data ask for more light out than came in, or for less than none, by more than their errors allow: "
                "the scale, a light or the stray light is wrong somewhere, or the law has no bound near grazing",
            )
        ]
    if found["held"]:
        least, albedo = found["least f"], found["largest albedo"]
        return [
            Diagnosis(
                "physics-held",
                f"the plain fit broke physics (least f {least:.3g} 1/sr, largest albedo {albedo:.3f}) by more than its "
                f"error; held to it, by {found['standard errors moved']:.1f} standard errors",
            )
        ]
    return []


def doubts(fit: FitResult) -> list[Diagnosis]:
    """What the photos did not look at, and whether they agree where several did."""
    cells = fit.cells
    told: list[Diagnosis] = []
    if not cells.binned:
        return told_of(cells)
    apart = fit.diagnostics["contradiction"]
    if apart is not None and apart > CONTRADICTED:
        told.append(
            Diagnosis(
                "photos-contradict",
                f"the photos contradict one another at the same directions, by {apart:.0%} in the middle: the sample "
                "or the board moved, lights are not what they are taken for, or the sample is not alike everywhere",
            )
        )
    told += _odd_colours(cells, fit.predicted)
    across = np.sin(cells.theta_i) * np.sin(cells.theta_r) * np.cos(cells.dphi)
    along = np.cos(cells.theta_i) * np.cos(cells.theta_r)
    for code, where, cosine, what in (
        ("retro-unseen", "the light's own direction", along + across, "a retro-reflective peak"),
        ("mirror-unseen", "the mirror direction", along - across, "a gloss"),
    ):
        nearest = np.degrees(np.arccos(np.clip(cosine.max(), -1.0, 1.0)))
        if nearest > UNSEEN:
            message = f"no photo looks within {nearest:.0f} degrees of {where}: {what} there was not seen"
            told.append(Diagnosis(code, message, amount=float(nearest), least=UNSEEN))
    mirrored = along - across >= np.cos(np.radians(UNSEEN))
    if (
        mirrored.any()
        and (apart_from := np.degrees(np.arccos((along + across)[mirrored].min()))) < 2 * UNSEEN
    ):
        message = (
            f"the mirror direction was seen head-on alone, where light and camera are no more than {apart_from:.0f} "
            "degrees apart: a gloss elsewhere was not seen; add photos with a lamp opposite the camera"
        )
        told.append(Diagnosis("mirror-unseen", message, amount=float(apart_from), least=2 * UNSEEN))
    return told + _steep(fit)


def _odd_colours(cells: Cells, predicted: np.ndarray) -> list[Diagnosis]:
    """Photos in which channels stand to one another otherwise than in the others, whatever their scales."""
    views = np.unique(cells.group)
    ratio = cells.value / np.maximum(predicted, FAINT * np.sqrt(np.mean(predicted**2, axis=0)))
    middle = np.array([np.median(ratio[cells.group == view], axis=0) for view in views])
    bright = middle.mean(1) > FAINT  # a fit that misses a photo by so much tells nothing of its colour
    if not bright.any():
        return []
    views, middle = views[bright], middle[bright]
    colour = middle / middle.mean(1, keepdims=True)
    apart = np.abs(colour / np.median(colour, axis=0) - 1.0).max(1)
    if not apart.max() > CONTRADICTED:
        return []
    worst = cells.groups[int(views[int(np.argmax(apart))])]
    message = (
        f"{(apart > CONTRADICTED).sum()} of {len(views)} photos show the sample in another colour than the others do, "
        f"{worst} by {apart.max():.0%}: a photo of another sample, another white balance, or a lamp of another colour"
    )
    return [Diagnosis("photos-contradict", message, amount=float(apart.max()), views=(worst,))]


def _steep(fit: FitResult) -> list[Diagnosis]:
    """A gloss that was seen from above alone; or, where none was found, that none could be that begins toward grazing,
    as a sheen does."""
    cells, lobes = fit.cells, fit.model.lobes
    glosses = [s[0] for f, s in zip(lobes.families, lobes.shapes, strict=True) if not f.retro]
    incident, exit = unit_vectors(cells.theta_i, 0.0), unit_vectors(cells.theta_r, cells.dphi)
    half, difference, _ = half_difference(incident, exit)
    seen = difference[half < np.arctan(max(glosses))] if glosses else difference
    if not len(seen) or seen.max() > np.radians(GRAZING):
        return []
    most = float(np.degrees(seen.max()))
    if not glosses:
        return [
            Diagnosis(
                "gloss-unseen-at-grazing",
                f"light and camera were no more than {2 * most:.0f} degrees apart: what a sheen or gloss adds toward "
                "grazing was not seen; look at the sample from lower, or put lamps lower opposite the camera",
            )
        ]
    return [
        Diagnosis(
            "gloss-extrapolated",
            f"the gloss was seen at no more than {most:.0f} degrees of incidence: how much brighter "
            "it grows toward grazing is extrapolated; look at the sample from lower, or put lamps lower opposite the "
            "camera",
        )
    ]


def clipped(table: FacetTable) -> list[Diagnosis]:
    """Photos exposed so long that what the sample reflects most light to was lost."""
    used = np.bincount(table.group, table.count, minlength=len(table.groups))
    lost = table.left_out[:, LEFT_OUT.index("saturated")] if len(table.left_out) else np.zeros(len(used))
    share = lost / np.maximum(lost + used, 1)
    if not (share > CLIPPED).any():
        return []
    return [
        Diagnosis(
            "sample-clipped",
            f"the sample is clipped in {(share > CLIPPED).sum()} of {len(share)} photos, {share.max():.0%} of it in "
            f"{table.groups[int(np.argmax(share))]}: its brightest directions were not measured; expose less",
        )
    ]


def relit_warning(turned: Sequence[TurnedLight]) -> Diagnosis:
    worst = max(turned, key=lambda one: one.angle)
    return Diagnosis(
        "lights-turned",
        f"{len(turned)} lights turned to where the sample's shading has them rather than the highlights, "
        f"{worst.id} most, by {np.degrees(worst.angle):.1f} degrees",
        amount=float(worst.angle),
        allowed=True,
    )


def spoilt_warnings(beside: LightAround) -> list[Diagnosis]:
    """What was left out because nobody knows how much light the surroundings throw on the sample."""
    spoilt = beside.spoilt
    if spoilt is None or not (spoilt.pixels or spoilt.typical > TOLD_STRAY):
        return []
    share = spoilt.pixels / spoilt.of
    return [
        Diagnosis(
            "surroundings-unknown",
            "the light that the surroundings throw on the sample cannot be known, since "
            f"{beside.why}: {spoilt.pixels} pixels ({share:.1%}) where it may be more than {spoilt.beyond:.0%} of the "
            f"value are left out; it may be {spoilt.typical:.1%} in the middle one",
        )
    ]


def stray_share(fit: FitResult) -> tuple[float, float]:
    """Stray light that was removed, over the value: median and 95 % quantile of the cells."""
    share = np.abs(fit.stray).sum(1) / np.maximum(np.abs(fit.cells.value).sum(1), np.finfo(float).tiny)
    return float(np.median(share)), float(np.quantile(share, 0.95))


def _short(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def numbers(result: Result) -> dict[str, Any]:
    """The result's numbers, for ``--json``."""
    brdf = result.brdf
    observed, fitted = result.fit.cells.value, result.fit.predicted
    rms, median = relative_misfit(observed, fitted)
    return {
        "name": result.name,
        "order": brdf.order,
        "fitted_order": brdf.order,
        "symmetry": brdf.symmetry,
        "quantity": brdf.quantity,
        "scale": brdf.scale,
        "channels": brdf.channels,
        "modes": len(brdf.modes),
        "lobes": [lobe_document(lobe) for lobe in brdf.lobes],
        "model": described(brdf),
        "albedo": brdf.bihemispherical_albedo(),
        "relative_rms": rms,
        "relative_median": median,
        "correlation": [correlation(observed[:, k], fitted[:, k]) for k in range(observed.shape[1])],
        "valid": brdf.valid,
        "fresh_reading": result.fit.diagnostics["fresh reading"],
        "physics": result.fit.diagnostics["physics"],
        "binning_error": result.fit.diagnostics["binning error"],
        "stray_light": stray_share(result.fit) if result.setup else None,
        "stray_light_unknown": _spoilt_numbers(result.beside),
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
        "diagnoses": by_code(result.diagnoses),
        "unseen": {
            one.code: {"degrees": one.amount, "what": one.message} for one in unseen(result.diagnoses)
        },
        "trust": trust_numbers(result.faults),
        "source": result.provenance.to_dict(),
    }


def _spoilt_numbers(beside: LightAround | None) -> dict[str, float] | None:
    return None if beside is None or beside.spoilt is None else asdict(beside.spoilt)


def photos_used(result: Result) -> int:
    """Views that gave the fit something."""
    return len(np.unique(result.table.group)) - len(result.fit.diagnostics["views left out"])


def count_of(count: int, what: str) -> str:
    return f"no {what}" if count == 0 else f"{count} {what}{'s' if count > 1 else ''}"


def lead(result: Result) -> str:
    """The result in one sentence."""
    brdf = result.brdf
    scale = "in absolute units" if brdf.scale == "absolute" else "on a relative scale: no white reference"
    symmetry = "turning" if brdf.turning and brdf.symmetry == "isotropic" else brdf.symmetry
    text = f"{symmetry.capitalize()} BRDF: {described(brdf)}; {scale}."
    if result.setup is None:
        return f"{text} From {len(result.table)} measured pairs of directions."
    used, out = photos_used(result), len(result.left_out)
    return f"{text} From {used} photo{'s' if used != 1 else ''}" + (f", {out} left out." if out else ".")


def unseen(told: Iterable[Diagnosis]) -> list[Diagnosis]:
    """What of the directions in which surfaces shine no photo showed."""
    return [one for one in told if one.code in UNSEEN_CODES]


def unseen_lines(told: Iterable[Diagnosis]) -> list[str]:
    """The same in a line, to stand beside the result; none if all was seen."""
    missed = [one.message.split("; ")[0] for one in unseen(told)]
    if not missed:
        return []
    return [f"NOT SEEN: {'; '.join(missed)}. There f is extrapolated, and only as sure as its stated error"]


def albedo_note(brdf: Brdf) -> str:
    return "under even light" if brdf.scale == "absolute" else "under even light, up to the unknown scale"


def closing_lines(result: Result) -> str:
    """What is told at the end, on screen."""
    values = numbers(result)
    order = ", ".join(result.brdf.channels)
    rms = 100 * values["relative_rms"]
    lines = [
        *verdict_lines(result.faults),
        lead(result),
        *unseen_lines(result.diagnoses),
        f"albedo {albedo_note(result.brdf)} ({order}): {listed(values['albedo'], '.3f')}{_surely(result.brdf)}",
        f"misfit of the cells ({order}): median {median_misfit(values)}, rms {listed(rms, '.2f')} %",
    ]
    return "\n".join(lines)


def _surely(brdf: Brdf) -> str:
    """Half the albedo's 95 % interval; nothing where the result does not know it."""
    half = HALF_OF_95 * albedo_error(brdf)
    return f" ± {listed(half, '.3f')} (95 %)" if np.isfinite(half).all() else ""


def median_misfit(values: Mapping[str, Any]) -> str:
    """The median misfit of a result's :func:`numbers`, in per cent; a channel without a cell above 0 has none."""
    median = 100 * np.asarray(values["relative_median"], float)
    if not np.isfinite(median).any():
        return "none, since no cell is above 0"
    return f"{listed(median, '.2f')} %" + ("" if np.isfinite(median).all() else " (–: no cell is above 0)")


def listed(values: Iterable[float], form: str) -> str:
    """Numbers in words; a dash for one that is none."""
    return " · ".join(format(float(value), form) if np.isfinite(value) else "–" for value in values)
