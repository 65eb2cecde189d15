"""Results that cannot be physical, or that the photos plainly contradict: one named check for each way.

A result that fails a check is written all the same, and is never called a success: the first line of the outcome, the
first card of the report, ``--json``, the coefficient file and the exit status say so, with the likeliest cause.
docs/cli.md lists the checks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from photogonio.reconstruct.brdf.brdf import HALF_OF_95
from photogonio.reconstruct.brdf.spread import albedo_error
from photogonio.reconstruct.estimate.narrow_gloss import half_angles
from photogonio.reconstruct.paper_fit import UNTOLD
from photogonio.reconstruct.rows.narrow import narrow_peak
from photogonio.reconstruct.rows.resolved import CORE, core_unseen, resolved_by
from photogonio.report.misfit import missed_by_photo, relative_misfit, shared_misfit
from photogonio.result import Fault

if TYPE_CHECKING:
    from photogonio.calib.setup import Setup
    from photogonio.reconstruct.brdf.brdf import Brdf
    from photogonio.reconstruct.estimate.model import Model
    from photogonio.reconstruct.fit_result import FitResult
    from photogonio.reconstruct.table.cells import Cells
    from photogonio.result import Result

DISTRUSTED = "not to be trusted"  # key of the coefficient file's "fit": codes of the checks that failed

MOSTLY = 0.9  # of the values below 0: no noise
BRIGHTEST = 1.05  # albedo: paper and patches are known to a few per cent
MISFIT = 0.2  # median, relative
HOPELESS = 0.5  # median, relative: no noise of a measurement that is worth a fit
PEAK = 0.6  # rms misfit, relative: as much of the light is where the fit has none
# of a photo, the median misfit, relative, and over the middle photo's: right photos are within 5 % and 8 times
ASTRAY, ASTRAY_TIMES = 0.15, 8.0
FEW_PHOTOS = 4  # of which one cannot be called the odd one
APART = 0.2  # photos at the same directions, relative
KNOWN = 0.02  # of an albedo, that it is told within where many rows are lost
# of an albedo: more than twice as unsure as plain paper, whose reflectance nobody measured, leaves it
HARDLY = 0.3
# likewise of a table's rows, whose directions are known: few rows of a fabric or a slate leave a third, and say so
HARDLY_ROWS = 0.5
LOOKED = 0.1  # of f, that it is told within where photos looked, in the middle
CLOSE, CLOSE_RMS = 0.06, 0.15  # median and rms misfit, relative: as noise of 5 % leaves them on few rows
LEAST_REACH = 10.0  # degrees from the normal: data that end before say next to nothing of a BRDF
BOARD = 3.0  # pixels, or the part of the picture's width below if that is more
BOARD_PART = 5e-4
HALF_HEIGHT = float(np.sqrt(np.log(2.0)))  # of roughnesses: where a peak is half as high
UNSURE = 0.5  # relative standard error of a lamp's strength
# checks that a peak which nothing follows lets fail
OF_NARROW = (
    *("peak-missed", "peak-unresolved", "negative-albedo", "albedo-above-one", "not-determined", "unsure"),
    "misfit",
)
NARROW, WIDE = 0.5, 150.0  # degrees: fields of view that no camera has


@dataclass(frozen=True, slots=True)
class Check:
    """One way in which a result is known to be wrong."""

    code: str
    means: str  # when it fails
    cause: str  # the likeliest
    found: Callable[..., str]  # what was found, in words; empty where the check holds


def _board(setup: Setup) -> str:
    rms = np.array([one.pose_rms for some in (setup.views, setup.boards) for one in some])
    rms = rms[np.isfinite(rms)]
    allowed = max(BOARD, BOARD_PART * max(setup.camera.size))
    if not len(rms) or np.median(rms) <= allowed:
        return ""
    return f"the board lies {np.median(rms):.1f} pixels from where it was found, in the middle photo"


def _camera(setup: Setup) -> str:
    width = max(setup.camera.size)
    across = np.degrees(2.0 * np.arctan(0.5 * width / abs(setup.camera.matrix[0, 0])))
    if not NARROW <= across <= WIDE:
        return f"the camera's field of view comes out as {across:.3g} degrees"
    below = [view.name for view in setup.views if np.isfinite(view.pose_rms) and view.pose.center[2] <= 0.0]
    return f"the camera comes out below the board in {len(below)} photos ({below[0]} ...)" if below else ""


def _strengths(setup: Setup) -> str:
    if setup.scale != "absolute":
        return ""
    ratio = [np.max(view.strength_error / np.maximum(view.strength, 1e-300)) for view in setup.views]
    most = float(np.median(ratio))
    return "" if most <= UNSURE else f"the lamps' strengths are known to no better than {most:.0%}"


def _negative(result: Result) -> str:
    albedo = result.brdf.bihemispherical_albedo()
    if (albedo >= 0.0).all():
        return ""
    below = np.mean(result.fit.cells.value < 0.0, axis=0)[albedo < 0.0].max()
    said = f"albedo below 0 ({_each(albedo)})"
    return said if below < MOSTLY else f"{said}, as {below:.0%} of the values are: is their sign turned?"


def _bright(result: Result) -> str:
    albedo = result.brdf.bihemispherical_albedo()
    if result.brdf.scale != "absolute" or (albedo <= BRIGHTEST).all():
        return ""
    meant = _meant(float(albedo.max())) if result.known is None else ""  # of photos nobody says what they are
    return f"albedo above 1 ({_each(albedo)}): more light goes out than came in{meant}"


def _meant(albedo: float) -> str:
    """What a table's values would be, if they are a known multiple of f."""
    for quantity, factor in (("reflectance-factor", np.pi), ("percent", 100.0 * np.pi)):
        if albedo / factor <= BRIGHTEST:
            return f"; with --quantity {quantity} it would be {albedo / factor:.3f}"
    return ""


def _told(code: str, result: Result) -> str:
    """What a diagnosis of that ``code`` says; nothing where there is none."""
    told = [one.message for one in result.diagnoses if one.code == code]
    return told[0] if told else ""


def _much_lost(result: Result) -> str:
    lost = _told("table-much-lost", result)
    if not lost:
        return ""
    width = _albedo_width(result.brdf)
    within = f"to within {width:.1%}" if np.isfinite(width) else "to no known error"
    return f"{lost}; the others tell the albedo {within}" if width > KNOWN else ""


def _invalid(result: Result) -> str:
    if not _holds_nowhere(result.brdf):
        return ""
    if result.fit.cells.binned:
        return "at no angle is f known to a tenth of itself"
    rms, median = relative_misfit(result.fit.cells.value, result.fit.predicted)
    if (median <= CLOSE).all() and (rms <= CLOSE_RMS).all():
        return ""  # the fit holds where the rows are; how far it holds beyond is said by the intervals
    return "at no angle is f known to a tenth of itself, nor does the fit come close to the data"


def _holds_nowhere(brdf: Brdf) -> bool:
    valid = brdf.valid
    return bool(valid) and min(valid.get(name, 90.0) for name in ("theta_i_max", "theta_r_max")) <= 0.0


def _unsure(result: Result) -> str:
    width = _albedo_width(result.brdf)
    if width <= (HARDLY if result.fit.cells.binned else HARDLY_ROWS):
        return ""
    said = f"the albedo is known to no better than {width:.0%} of itself (95 %)"
    if not np.isfinite(width):
        said = "how well the albedo is known, nothing tells"
    if _holds_nowhere(result.brdf):
        return said
    looked = _width_where_photos_looked(result.fit)
    return f"{said}, and f to {looked:.0%} even where photos looked" if looked > LOOKED else ""


def _width_where_photos_looked(fit: FitResult) -> float:
    """Half the 95 % interval of f, relative, in the middle one of the photos' cells, of the least sure channel; 0 of
    tables. A flash alone tells f well where it looks, and little of the albedo; lamps that stood nobody knows where
    tell neither."""
    if not fit.cells.binned:
        return 0.0
    width = fit.uncertainty.half_width(fit.standard_error(fit.cells))
    return float(np.median(width / np.maximum(np.abs(fit.predicted), 1e-12), axis=0).max())


def _albedo_width(brdf: Brdf) -> float:
    """Half the 95 % interval of the albedo, relative, of the least sure channel; infinite where nothing tells it."""
    share = albedo_error(brdf) / np.maximum(np.abs(brdf.bihemispherical_albedo()), 1e-12)
    return HALF_OF_95 * float(np.nan_to_num(share, nan=np.inf).max())


def _reach(result: Result) -> str:
    cells = result.fit.cells
    reach = float(np.degrees(max(cells.theta_i.max(), cells.theta_r.max())))
    return "" if reach >= LEAST_REACH else f"all data lie within {reach:.2g} degrees of the normal"


def _misfit(result: Result) -> str:
    # over what photos show: of a dark sample, or a metal beside its peak, that is next to all light of the surroundings
    stray = np.maximum(result.fit.stray, 0.0)
    cells, fitted = result.fit.cells.with_value(result.fit.cells.value + stray), result.fit.predicted + stray
    _, median = relative_misfit(cells.value, fitted)
    worst = int(np.nanargmax(median)) if np.isfinite(median).any() else 0
    if not median[worst] > MISFIT:
        return ""
    if median[worst] <= HOPELESS and shared_misfit(cells, fitted)[worst] <= MISFIT:
        return ""  # the rows' own noise
    return f"the fit misses the middle one of the data by {median[worst]:.0%}"


def _astray(result: Result) -> str:
    cells, stray = result.fit.cells, np.maximum(result.fit.stray, 0.0)
    if not cells.binned:
        return ""
    missed = missed_by_photo(cells.with_value(cells.value + stray), result.fit.predicted + stray)
    told = missed[np.isfinite(missed)]
    if len(told) < FEW_PHOTOS:
        return ""
    odd = np.flatnonzero(missed > max(ASTRAY, ASTRAY_TIMES * float(np.median(told))))  # of NaN never
    if not len(odd):
        return ""
    worst = sorted(odd, key=lambda k: -missed[k])
    named = ", ".join(f"{cells.groups[k]} by {missed[k]:.0%}" for k in worst[:3])
    more = f" and {len(worst) - 3} more" if len(worst) > 3 else ""
    return f"the fit misses {named}{more}, and the middle photo by {np.median(told):.1%}"


def _peak(result: Result) -> str:
    rms, _ = relative_misfit(result.fit.cells.value, result.fit.predicted)
    return "" if (rms <= PEAK).all() else f"the fit misses the brightest of the data (rms {rms.max():.0%})"


def _unresolved(result: Result) -> str:
    if result.fit.cells.binned and tops_unseen(result.fit.model, result.fit.cells):
        return "no photo shows the top of a narrow peak: it may be another than the fit has"
    if result.fit.cells.binned:
        return ""
    if core_unseen(result.fit.cells, result.fit.model) > CORE:
        return (
            "values rise toward a direction that no row is near: how high the peak there is, rows do not say"
        )
    if not resolved_by(result.fit.cells, result.fit.model).unresolved:
        return ""
    return "a narrow peak was read at too few places: between the rows it may be another than the fit has"


def tops_unseen(model: Model, cells: Cells) -> bool:
    """Whether photos show no peak, whose tails tell nothing of a Fresnel's term, above half its height."""
    roughness = [
        float(shape[0])
        for family, shape in zip(model.lobes.families, model.lobes.shapes, strict=True)
        if family.peak and family.about == "normal"
    ]
    closest = float(np.tan(half_angles(cells).min()))
    return any(closest > HALF_HEIGHT * one for one in roughness)


def _untold(result: Result) -> str:
    untold, modes = result.fit.diagnostics.get(UNTOLD, (0, 0))
    return f"the data leave {untold} of {modes} modes untold; least norm is taken of them" if untold else ""


def _contradiction(result: Result) -> str:
    apart = result.fit.diagnostics["contradiction"]
    if apart is None or apart <= APART:
        return ""
    return f"the photos contradict one another at the same directions by {apart:.0%} in the middle"


def _each(values: np.ndarray) -> str:
    return " · ".join(f"{value:.3g}" for value in values)


OF_SETUPS = (
    Check(
        "board-residual",
        "the board's corners lie more than 3 pixels (or 1/2000 of the picture's width) from where they were found, in "
        "the middle photo",
        "the board is not the one that the manifest describes (kind, dictionary, sizes, order of corners), or a lens "
        "that no model of OpenCV's says",
        _board,
    ),
    Check(
        "camera-place",
        "the camera comes out below the board, or with a field of view below 0.5 or above 150 degrees",
        "markers are mirrored or their corners listed in another order, or the given camera matrix is another camera's",
        _camera,
    ),
    Check(
        "lamp-strength",
        "on an absolute scale the lamps' strengths have a standard error of more than half of themselves",
        "the white patch or the paper is clipped, shadowed or hardly lit",
        _strengths,
    ),
)
OF_FITS = (
    Check(
        "cosine-in-values",
        "exchanged pairs of directions differ in a table, and a cosine explains it; or values fall toward grazing as "
        "both cosines do",
        "the values are cosine-corrected, or intensities: --quantity says which",
        partial(_told, "table-cosine"),
    ),
    Check(
        "quantity-in-header",
        "a table's header names its values as per cent, a reflectance factor or cosine-corrected, and they are read "
        "as f",
        "f is pi, 100 pi or a cosine away: --quantity says which, or brdf if they are f all the same",
        partial(_told, "table-quantity"),
    ),
    Check(
        "azimuth-mirrored",
        "a table's peak toward the lamp, or beside the plane of incidence, is a mirror lobe, with odds above e^20",
        "azimuths count from the mirror side: --azimuth mirror, or lamp if they do not; or from elsewhere",
        partial(_told, "table-mirrored"),
    ),
    Check(
        "rows-slipped",
        "a table's values, all or from some row on, agree with one another far better a row or two lower or higher, "
        "with odds above e^50",
        "a value was lost, or the column of values pasted a row off; or a zero of the angles is off by a step",
        partial(_told, "table-slipped"),
    ),
    Check(
        "scan-off",
        "all readings of one incidence, or of a run of lines that lie among others, are the same multiple, 1.3 or "
        "more, of what the others and exchanged pairs say",
        "another gain, filter or lamp than in the other scans",
        partial(_told, "table-scan-off"),
    ),
    Check(
        "rows-uneven",
        "every second row of a table, the rows of every second incidence, those on one side of the plane of incidence, "
        "or later ones are a multiple of the others, 1.05 or more, with odds above e^30 (e^40, e^100, e^40)",
        "detectors, lamps or gains that took turns, something in the way on one side, or a lamp that drifted",
        partial(_told, "table-uneven"),
    ),
    Check(
        "gain-changed",
        "exchanged pairs of directions differ in a table, and a gain that changes at an angle or from line to line, by "
        "1.1 or more, explains it down to the noise",
        "a lamp that drifted, another gain, or a lit spot larger than the sample or the detector's view",
        partial(_told, "table-gain"),
    ),
    Check(
        "rows-lost",
        "rows that are no measurements are a tenth of a table, or all that it has beyond some angle, and the others "
        "tell the albedo to no better than 2 % (95 %)",
        "the detector or its holder was in the way, or the instrument stood still",
        _much_lost,
    ),
    Check(
        "saturated",
        "the largest value of a table comes at 4 pairs of directions or more, and 5 times as often as the next ones",
        "the detector was saturated: what was brighter is not in the table",
        partial(_told, "table-saturated"),
    ),
    Check(
        "peak-missed",
        "the rms misfit is above 60 % of the data's rms: the brightest data are not in the fit",
        "a peak narrower than any lobe that was tried, or rows that are no measurements",
        _peak,
    ),
    Check(
        "peak-unresolved",
        "rows of a table hold but the top of a narrow peak (fewer than 3 angles from its direction above a tenth of "
        "the highest), or no lobe follows it but with modes beyond order 8; and most light lies between rows that "
        "differ manifold. Or f rises toward the light's or the mirror's direction, no row is near that, and the light "
        "there may be a tenth of the albedo more. Or no photo shows a cosine power's peak above half its height",
        "steps of the angles that are wider than the peak; too few lamps, or the sample too small in the photos",
        _unresolved,
    ),
    Check(
        "negative-albedo",
        "an albedo is below 0",
        "values of the wrong sign or with too much dark signal taken off, angles in another unit or azimuths from "
        "another zero, rows that are no measurements, or lamps that stood elsewhere",
        _negative,
    ),
    Check(
        "albedo-above-one",
        "on an absolute scale an albedo is above 1.05",
        "the values are no BRDF (a reflectance factor is pi times f, per cent of white 100 pi times), or the white "
        "patch's reflectance is wrong",
        _bright,
    ),
    Check(
        "not-determined",
        "f is known to a tenth of itself at no angle (the valid angles are 0 degrees); of a table, and the misfit is "
        "above 6 % in the median or 15 % rms",
        "too few or too noisy data, or data that contradict one another",
        _invalid,
    ),
    Check(
        "unsure",
        "the albedo is known to no better than 30 % (95 %; of a table 50 %), and f to a tenth of itself at no angle, "
        "or to no better than 10 % (95 %) even where photos looked, in the middle",
        "too few rows or photos; or, of photos, lamps whose directions nothing tells, as far away ones over a flat "
        "sample without polished balls",
        _unsure,
    ),
    Check(
        "extrapolated",
        "all data lie within 10 degrees of the normal: nearly all of the result is extrapolated",
        "angles in radians, or the camera and the lamps too close together",
        _reach,
    ),
    Check(
        "misfit",
        "the median misfit is above 20 % of what is seen, and neighbours agree that the fit is off; or above 50 %",
        "rows that are no measurements, angles that are not what they are taken for, or lamps that stood elsewhere",
        _misfit,
    ),
    Check(
        "sample-not-believed",
        "the photos show the sample ball farther from its place, or of another size, than a manifest's slip is taken "
        "for, and the manifest is kept",
        "the ball's radius or center, or the lengths of the board, are not as the manifest has them: measure them",
        partial(_told, "sample-not-believed"),
    ),
    Check(
        "photo-astray",
        "the fit misses a photo by more than 15 % in the median of its cells, and by 8 times as much as the middle one",
        "its lamp stood elsewhere than the manifest has it (two ids exchanged?), or it shows another sample or a "
        "shadow: correct it, or leave it out",
        _astray,
    ),
    Check(
        "modes-untold",
        "the paper's own fit of q was asked for, and the data leave some of its modes untold",
        "more modes than the directions tell: a lower order, or another symmetry",
        _untold,
    ),
    Check(
        "photos-contradict",
        "photos differ by more than 20 % at the same directions, in the middle",
        "the sample or the board moved, or lamps are not what they are taken for",
        _contradiction,
    ),
)


def checks_table() -> str:
    """All checks, as docs/cli.md lists them."""
    rows = [f"| `{one.code}` | {one.means} | {one.cause} |" for one in (*OF_SETUPS, *OF_FITS)]
    return "\n".join(["| check | fails where | likeliest cause |", "|---|---|---|", *rows])


def faults_of(result: Result) -> tuple[Fault, ...]:
    """The checks that a result fails; none: it may be trusted."""
    fitted = _failed(OF_FITS, result)
    if result.setup is None and fitted:
        return _of_narrow_peak(result, fitted)
    return fitted if result.setup is None else (*setup_faults(result.setup), *fitted)


def _of_narrow_peak(result: Result, faults: tuple[Fault, ...]) -> tuple[Fault, ...]:
    """Faults of a table with their likeliest cause, where that is a peak which nothing follows."""
    cells = result.fit.cells
    if cells.binned:
        return faults
    value = np.mean(cells.value / np.maximum(np.abs(cells.value).mean(0), np.finfo(float).tiny), axis=1)
    peak = narrow_peak(cells.theta_i, cells.theta_r, cells.dphi, value)
    if peak is None:
        return faults
    about = "the mirror direction" if peak.about == "mirror" else "the light's own direction"
    cause = f"a peak about {about}, {peak.times:.0f} times as bright as 4 degrees beside it: narrower than lobes or "
    cause += "the steps of the angles can follow"
    return tuple(replace(one, cause=cause) if one.code in OF_NARROW else one for one in faults)


def setup_faults(setup: Setup) -> tuple[Fault, ...]:
    """The checks that a calibration fails."""
    return _failed(OF_SETUPS, setup)


def _failed(checks: Iterable[Check], judged: object) -> tuple[Fault, ...]:
    found = [(check, check.found(judged)) for check in checks]
    return tuple(Fault(check.code, said, check.cause) for check, said in found if said)


def verdict_lines(faults: Iterable[Fault]) -> list[str]:
    """What comes before everything else that is told of a result; nothing if it may be trusted."""
    return [f"NOT TO BE TRUSTED: {fault}" for fault in faults]


def told_distrust(brdf: Brdf, name: str) -> list[str]:
    """What a coefficient file says of itself, to whoever uses it."""
    codes, known, told = brdf.fit.get(DISTRUSTED), brdf.uncertainty, []
    if isinstance(codes, list) and codes:
        told.append(f"{name} says of itself that it is not to be trusted: {', '.join(map(str, codes))}")
    if known is not None and known.missing is not None:
        told.append(f"{known.missing.get('file')} is missing beside {name}: how sure f is cannot be told")
    return told


def trust_numbers(faults: Iterable[Fault]) -> dict[str, object]:
    """For ``--json``."""
    faults = list(faults)
    told = [{"code": one.code, "found": one.found, "likeliest_cause": one.cause} for one in faults]
    return {"trusted": not faults, "codes": [one.code for one in faults], "faults": told}
