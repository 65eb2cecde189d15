"""The verdict: what it is, how sure, what is missing, what to do next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from photogonio.capture.diagnosis import Diagnosis
from photogonio.reconstruct.brdf.brdf import HALF_OF_95
from photogonio.reconstruct.brdf.spread import albedo_error
from photogonio.report.budget import budgets
from photogonio.report.coverage_words import Coverage
from photogonio.report.summary import lead, listed, unseen

if TYPE_CHECKING:
    from photogonio.reconstruct.brdf.brdf import Brdf
    from photogonio.result import Fault, Result

NAMED = ("the mirror direction", "the lamp's own direction")  # of coverage, of which a diagnosis says more
MOST = 3  # pieces of advice
PLAN = " `photogonio plan` says where camera and lamp should stand next."
NOTHING = "Nothing."  # advice that is none
UNSURE = 0.05  # relative standard error of an albedo, above which more is asked for
LEAST_SHARE = 0.3  # of the variance, that is worth naming


@dataclass(frozen=True, slots=True)
class Answers:
    """Four answers, a few sentences each."""

    what: str
    sure: str
    missing: str
    next: str


def verdict_of(result: Result, coverage: Coverage) -> Answers:
    """Of a fit."""
    told = _not_allowed(result.diagnoses)
    return Answers(
        what=lead(result),
        sure=_sure(result),
        missing=_missing(result, coverage),
        next=_next(result, told) + (PLAN if result.setup and coverage.missing and not result.faults else ""),
    )


def advice_of(told: Sequence[Diagnosis]) -> list[str]:
    """What to do about it, each once, in the order in which it was told."""
    if not told:
        return []
    from photogonio.report.diagnoses import ENTRIES  # of photos too

    advice = {entry.code: entry.advice for entry in ENTRIES}
    found = dict.fromkeys(advice.get(one.code, NOTHING) for one in told)
    return [one for one in found if one != NOTHING]


def _not_allowed(told: Sequence[Diagnosis]) -> list[Diagnosis]:
    return [one for one in told if not one.allowed]


def _sure(result: Result) -> str:
    brdf = result.brdf
    if result.faults:
        return "Not to be trusted: " + "; ".join(one.found for one in result.faults) + "."
    albedo, error = brdf.bihemispherical_albedo(), albedo_error(brdf)
    if not np.isfinite(error).all():
        return "The file does not say how sure its albedo is."
    said = f"Albedo {listed(albedo, '.3f')} ± {listed(HALF_OF_95 * error, '.3f')} (95 %)"
    said += "" if brdf.scale == "absolute" else ", up to the unknown scale"
    for budget in budgets(brdf)[1:2]:
        share = HALF_OF_95 * budget.error / np.maximum(np.abs(budget.value), 1e-12)
        said += f"; {budget.of} to {100 * float(np.max(share)):.2g} % (95 %)"
    return f"{said}. {_reach(brdf)}"


def _reach(brdf: Brdf) -> str:
    if not brdf.valid:
        return ""
    i, r = (brdf.valid.get(name, 90.0) for name in ("theta_i_max", "theta_r_max"))
    if min(i, r) <= 0.0:
        return "At no angle is f known to a tenth of itself."
    return f"f is known to a tenth of itself up to {i:.0f} degrees of incidence and {r:.0f} of exit."


def _missing(result: Result, coverage: Coverage) -> str:
    missing = [one.message.split("; ")[0] for one in unseen(result.diagnoses)]
    missing += [one for one in coverage.missing if not (missing and one in NAMED)]
    if result.brdf.scale == "relative":
        missing.append("a white reference: the scale is not known")
    if result.left_out:
        missing.append(f"{len(result.left_out)} photo{'s' if len(result.left_out) > 1 else ''} left out")
    if not missing:
        return "Nothing that was looked for."
    return "; ".join([missing[0][:1].upper() + missing[0][1:], *missing[1:]]) + "."


def _next(result: Result, told: Sequence[Diagnosis]) -> str:
    if result.faults:
        return _causes(result.faults)
    advice = advice_of(told)[:MOST]
    if advice:
        return " ".join(advice)
    error = albedo_error(result.brdf)
    relative = error / np.maximum(np.abs(result.brdf.bihemispherical_albedo()), 1e-12)
    if np.isfinite(relative).all() and relative.max() > UNSURE:
        return f"What leaves the albedo unsure is above all: {_largest(result.brdf)}."
    return "Use it: nothing was found that asks for other photos."


def _causes(faults: Sequence[Fault]) -> str:
    causes = dict.fromkeys(one.cause for one in faults)
    return "Look for the likeliest cause: " + "; or ".join(causes) + "."


def _largest(brdf: Brdf) -> str:
    """The source that leaves the albedo unsure the most."""
    first = budgets(brdf)[0]
    shares = [(float(np.max(source.share)), source.name) for source in first.sources]
    share, name = max(shares)
    if share > 1.0:
        return f"{name}, with what moves along with it"
    return name if share < LEAST_SHARE else f"{name} ({100 * share:.0f} % of the variance)"
