"""Whether a table's conventions are what they are taken for: told by what no surface does, or hardly one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.robust import deviation
from photogonio.reconstruct.goniometer.spoilt import lamp_angle
from photogonio.reconstruct.rows.mirrored import mirrored_odds
from photogonio.reconstruct.rows.narrow import NarrowPeak, narrow_peak
from photogonio.reconstruct.rows.slipped import Slip, slip_of
from photogonio.reconstruct.rows.uneven import uneven_of
from photogonio.reconstruct.symmetry.gains import gain_of
from photogonio.reconstruct.symmetry.scans import run_off, scan_off
from photogonio.reconstruct.symmetry.twins import BROKEN, compare_twins
from photogonio.reconstruct.table.cells import cells_of
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples, samples_table
from photogonio.reconstruct.table.neighbours import apart, numbered, places

COSINE = 0.25  # of the power of a cosine that twins follow, from 1
LEFT = 0.2  # of the squared differences of twins, beside that cosine
DIM = 0.02  # of both cosines: rows beyond say little
MANY, SPAN = 20, 1.0  # rows, and the range of the logarithm of both cosines, that tell how values follow them
SCATTER = 0.15  # about that line: no surface of 390 drawn ones and of CUReT's thirty is as even and as dark at grazing
ROUNDS = 10  # of weighing readings by how far they are off
SLANT = np.radians(15.0)  # incidence from which lamp and mirror side are told apart
NEAR, RING = np.radians(15.0), (np.radians(20.0), np.radians(40.0))  # of a direction: its peak, and around it
FEWEST = 3  # readings in each
PEAK = 1.8  # of the readings near the lamp's direction, over those around it
OTHER = 1.3  # and over those near the mirror direction
TURNS = tuple(np.radians(np.arange(-165.0, 181.0, 15.0)).tolist())  # of a mirror lobe about the normal
BRIGHTER = 1.1  # times the readings around it and near the mirror direction: then evidence is asked
BESIDE = np.radians(31.0)  # from the plane of incidence, where no surface has it
BREACH = 0.4  # rms of the logarithm of exchanged pairs' ratios; of thirty CUReT materials none reaches 0.3
LOST = 0.1  # of the rows
EDGE = 4.0  # degrees: rows toward the horizon that are lost
MIRRORED = 20.0  # logarithm of the odds that azimuths count from the mirror side
OBLIQUE = np.radians(1.0)  # incidence that has an azimuth, and how exactly it is told
# of the odds that a group of rows is a multiple of the others; a brushed surface at one rotation has sides, to 80
UNEVEN = {"lines": 30.0, "scans": 40.0, "order": 40.0, "side": 100.0}
SLIPPED = 50.0  # of the odds that values stand beside their directions; readings far off alone make 22 of it

FLAT = 5.0  # times as often as the values next below the largest must come, to be a limit, and
LEVEL = 4  # times, at different directions
BELOW = 10  # values next below


def doubts_of(
    samples: GoniometerSamples, quantity: str, *, side_told: bool = False, quantity_told: bool = False
) -> tuple[Diagnosis, ...]:
    """What is doubtful of samples that were read as ``quantity``; ``side_told``: where azimuths count from is known;
    ``quantity_told``: what the values are."""
    if not samples.value.any():
        return ()  # a fit refuses it
    size = np.maximum(np.abs(samples.value).mean(0), np.finfo(float).tiny)
    value = np.mean(samples.value / size, axis=1)
    peak = _lamp_side(samples, value)
    narrow = narrow_peak(samples.theta_i, samples.theta_r, samples.phi_r - samples.phi_i, value)
    if narrow is not None:
        peak = peak or _narrow_lamp_side(narrow)
        side_told = True  # lobes would tell it by chance
    mirrored = None if side_told or peak is None else _mirrored(samples, value, np.pi)
    if not side_told and peak is None:
        mirrored = _beside(samples, value)
    cosine = _cosine(samples, value, quantity)
    if cosine is None and not quantity_told:
        cosine = _cosines(samples, value)
    slip = None
    if cosine is None and not _turned(samples):
        slip = slip_of(samples, value, SLIPPED, turns=side_told)
    scan = _scan(samples, value) if cosine is None else None
    uneven = _uneven(samples, value) if cosine is None and scan is None else None
    if uneven is not None:
        slip = slip if slip is not None and slip.odds > uneven.amount else None
        mirrored = mirrored if mirrored is not None and mirrored.amount > uneven.amount else None
    if slip is not None and (mirrored is None or slip.odds > mirrored.amount):
        return tuple(one for one in (_slipped(samples, slip), _saturated(samples)) if one is not None)
    breach = None
    if cosine is None and scan is None and uneven is None:
        breach = _gain(samples, value) or _breach(samples, value)
    found = (cosine, peak, mirrored, scan, uneven, breach, _saturated(samples))
    return tuple(one for one in found if one is not None)


def _turned(samples: GoniometerSamples) -> bool:
    """Whether the sample was turned under the lamp: it may be one that looks otherwise then, which no isotropic surface
    is like, with values as read or moved."""
    oblique = samples.theta_i > OBLIQUE
    return len(np.unique(np.rint(samples.phi_i[oblique] / OBLIQUE))) > 1


def _slipped(samples: GoniometerSamples, slip: Slip) -> Diagnosis:
    """What is told of values that stand beside their directions."""
    where = "" if slip.first == 0 else f" from about row {slip.first + 1} on"
    if slip.first and samples.line is not None:
        where = f" from about line {samples.lines[slip.first, 0]} on"
    rows = "a row" if abs(slip.by) == 1 else f"{abs(slip.by)} rows"
    message = (
        f"values{where} agree with one another far better {rows} {'lower' if slip.by > 0 else 'higher'} (odds "
        f"e^{slip.odds:.0f}): do they stand beside their directions? Or an angle is off by its step"
    )
    return Diagnosis("table-slipped", message, amount=slip.odds, least=SLIPPED)


def _cosine(samples: GoniometerSamples, value: np.ndarray, quantity: str) -> Diagnosis | None:
    """Whether a cosine explains that exchanged pairs differ."""
    twins = compare_twins(samples.theta_i, samples.theta_r, samples.phi_r - samples.phi_i, value)
    if twins.verdict != BROKEN or twins.left > LEFT or abs(abs(twins.cosine) - 1.0) > COSINE:
        return None
    held = "theta_r" if twins.cosine > 0.0 else "theta_i"
    message = f"{twins.count} exchanged pairs of directions differ by {twins.apart:.0%}, as if values held "
    message += f"cos({held}): "
    if quantity != "brdf":
        message += f"are they {quantity}, as was told?"
    else:
        asked = "brdf-cos" if held == "theta_r" else "brdf-cos-incident"
        message += f"are they cosine-corrected? Say --quantity {asked}"
    return Diagnosis("table-cosine", message, amount=abs(twins.cosine), error=twins.cosine_error)


def _breach(samples: GoniometerSamples, value: np.ndarray) -> Diagnosis | None:
    """Whether exchanged pairs differ by far more than those of measured surfaces do."""
    if _turned(samples):
        return None
    twins = compare_twins(samples.theta_i, samples.theta_r, samples.phi_r - samples.phi_i, value)
    if twins.verdict != BROKEN or twins.apart < BREACH:
        return None
    message = (
        f"{twins.count} exchanged pairs of directions differ by {twins.apart:.0%} beyond their noise of "
    )
    message += f"{twins.noise:.0%}, which no surface's do that looks alike however it is turned: is the sample brushed "
    message += "or woven? Or was a part of the table measured with another gain, lamp or sample?"
    return Diagnosis("table-not-reciprocal", message, amount=twins.apart, least=BREACH)


def _cosines(samples: GoniometerSamples, value: np.ndarray) -> Diagnosis | None:
    """Whether values fall toward grazing as both cosines do, which reciprocity allows and no surface does."""
    both = np.cos(samples.theta_i) * np.cos(samples.theta_r)
    some = (value > 0.0) & (both > DIM)
    along, seen = np.log(both[some]), np.log(value[some])
    if len(seen) < MANY or np.ptp(np.quantile(along, (0.05, 0.95))) < SPAN:
        return None
    design, weight = np.column_stack([np.ones_like(along), along]), np.ones_like(along)
    for _ in range(ROUNDS):
        line = np.linalg.lstsq(design * weight[:, None], seen * weight, rcond=None)[0]
        missed = seen - design @ line
        typical = float(deviation(missed)) + 1e-9
        weight = 1.0 / (1.0 + (missed / (2.0 * typical)) ** 2)
    power = float(line[1])
    if abs(power - 1.0) > COSINE or typical > SCATTER:
        return None
    message = (
        f"values fall toward grazing as cos(theta_i) cos(theta_r) (power {power:.2f}, within {typical:.0%}): do they "
        "hold both? Say --quantity brdf-cos-cos, or brdf if they are f"
    )
    return Diagnosis("table-cosine", message, amount=power, error=typical)


def _lamp_side(samples: GoniometerSamples, value: np.ndarray) -> Diagnosis | None:
    """Whether a peak sits on the lamp's side."""
    rows = np.arange(len(value))
    lamp = lamp_angle(samples, rows)
    turned = samples.exit * [-1.0, -1.0, 1.0]
    mirror = np.arccos(np.clip(np.einsum("ij,ij->i", samples.incident, turned), -1.0, 1.0))
    slant = samples.theta_i >= SLANT
    around = slant & (lamp > RING[0]) & (lamp < RING[1]) & (mirror > RING[0])
    peak, other = (
        _bright(value[slant & (one < NEAR) & (two > RING[0])])
        for one, two in ((lamp, mirror), (mirror, lamp))
    )
    if peak is None or around.sum() < FEWEST:
        return None
    level = max(float(np.median(value[around])), 1e-3)  # values are about 1
    if peak < PEAK * level or (other is not None and peak < OTHER * other):
        return None
    message = (
        f"readings are brightest toward the lamp, {peak / level:.1f} times those around it: a retro-reflective "
        "surface, or azimuths that count from the mirror side? Then say --azimuth mirror (docs/cli.md draws ours)"
    )
    return Diagnosis("table-lamp-side", message, amount=peak / level)


def _narrow_lamp_side(narrow: NarrowPeak) -> Diagnosis | None:
    """Whether a peak that lobes do not follow is toward the lamp."""
    if narrow.about != "light":
        return None
    message = (
        f"a peak of a degree or two is toward the lamp, {narrow.times:.0f} times as bright as around it: a "
        "retro-reflective surface, or a mirror whose azimuths count from the mirror side? Then say --azimuth mirror"
    )
    return Diagnosis("table-lamp-side", message, amount=narrow.times)


def _mirrored(samples: GoniometerSamples, value: np.ndarray, turn: float) -> Diagnosis | None:
    """Whether a peak that azimuths less ``turn`` take to the mirror direction is a gloss, that is a mirror lobe."""
    alone = replace(samples, value=value[:, None], sigma=None, channels=samples.channels[:1])
    turned = None if turn == np.pi else cells_of(samples_table(replace(alone, phi_r=alone.phi_r - turn)))
    odds = mirrored_odds(cells_of(samples_table(alone)), turned)
    if odds < MIRRORED:
        return None
    if turn == np.pi:
        message = (
            "the peak toward the lamp widens and grows as a gloss about the mirror direction does, and no "
            f"retro-reflective surface (odds e^{odds:.0f}): azimuths count from the mirror side? Then say --azimuth "
            "mirror, else lamp"
        )
    else:
        message = (
            f"a gloss peaks {np.degrees(abs(turn)):.0f} degrees of azimuth from the mirror direction (odds "
            f"e^{odds:.0f}): from where do azimuths count? From the lamp's side they should; --azimuth lamp if they do"
        )
    return Diagnosis("table-mirrored", message, amount=odds, least=MIRRORED)


def _beside(samples: GoniometerSamples, value: np.ndarray) -> Diagnosis | None:
    """Whether a mirror lobe stands beside the plane of incidence, where no surface has it."""
    dphi, slant = samples.phi_r - samples.phi_i, samples.theta_i >= SLANT
    middle = np.cos(samples.theta_i) * np.cos(samples.theta_r)
    across = np.sin(samples.theta_i) * np.sin(samples.theta_r)
    angle = {turn: np.arccos(np.clip(middle - across * np.cos(dphi - turn), -1.0, 1.0)) for turn in TURNS}
    bright = {turn: _bright(value[slant & (one < NEAR)]) for turn, one in angle.items()}
    mirror = bright[0.0]
    turn, peak = max(bright.items(), key=lambda one: -1.0 if one[1] is None else one[1])
    if mirror is None or peak is None or min(abs(turn), np.pi - abs(turn)) < BESIDE:
        return None
    around = slant & (angle[turn] > RING[0]) & (angle[turn] < RING[1])
    if around.sum() < FEWEST or peak < BRIGHTER * max(float(np.median(value[around])), mirror, 1e-3):
        return None
    return _mirrored(samples, value, turn)


def _scan(samples: GoniometerSamples, value: np.ndarray) -> Diagnosis | None:
    """Whether one incidence was read with another factor than the others."""
    dphi = samples.phi_r - samples.phi_i
    found = scan_off(samples.theta_i, samples.theta_r, dphi, value)
    if found is None:
        return _run(samples, value)
    message = (
        f"the {found.count} readings at {np.degrees(found.incidence):.4g} degrees of incidence are {found.factor:.3g} "
        f"times what other incidences and exchanged pairs say (each within {found.error:.0%}): another gain or lamp?"
    )
    return Diagnosis("table-scan-off", message, amount=max(found.factor, 1.0 / found.factor))


def _run(samples: GoniometerSamples, value: np.ndarray) -> Diagnosis | None:
    """Whether rows that were written one after another have another factor than the rows around them."""
    found = run_off(samples.theta_i, samples.theta_r, samples.phi_r - samples.phi_i, value)
    if found is None:
        return None
    where = f"row {found.first + 1}" if samples.line is None else f"line {samples.lines[found.first, 0]}"
    message = (
        f"about {found.count} readings from {where} on are {found.factor:.3g} times what the rows around them say "
        f"(each within {found.error:.0%}): another gain or lamp?"
    )
    return Diagnosis("table-scan-off", message, amount=max(found.factor, 1.0 / found.factor))


def _uneven(samples: GoniometerSamples, value: np.ndarray) -> Diagnosis | None:
    """Whether every second row, or those on one side, or later ones are a multiple of the others."""
    found = uneven_of(samples, value, min(UNEVEN.values()))
    if found is None or found.odds < UNEVEN[found.group]:
        return None
    times = f"about {found.factor:.2f} times"
    said = {
        "lines": f"every second row is {times} what the others say",
        "scans": f"the rows of every second incidence are {times} what the others say",
        "side": f"readings at azimuths of 0 to 180 degrees are {times} those at 180 to 360",
        "order": f"readings grow to {times} from the first row to the last, in whatever order angles come",
    }
    asked = {
        "lines": "two detectors, lamps or gains that took turns?",
        "scans": "another gain or lamp in turns?",
        "side": "something in the way on one side, or a sample that is not level, brushed or woven?",
        "order": "did the lamp or the detector drift?",
    }
    message = f"{said[found.group]} (odds e^{found.odds:.0f}): {asked[found.group]}"
    return Diagnosis("table-uneven", message, amount=found.odds, least=UNEVEN[found.group])


def _gain(samples: GoniometerSamples, value: np.ndarray) -> Diagnosis | None:
    """Whether exchanged pairs differ as a gain has it that changes at an angle or with time."""
    found = gain_of(samples.theta_i, samples.theta_r, samples.phi_r - samples.phi_i, value)
    if found is None:
        return None
    message = (
        f"{found.count} exchanged pairs of directions differ by {found.apart:.0%}, nearly all of it as if "
    )
    if found.beyond is None:
        message += (
            f"readings grew to {found.factor:.2f} times from the first row to the last: did the lamp or the "
        )
        message += "detector drift?"
    else:
        angle = np.degrees(found.beyond)
        message += (
            f"readings beyond {angle:.0f} degrees of exit were {found.factor:.2f} times what they are, or "
        )
        message += (
            f"beyond {angle:.0f} degrees of incidence {1.0 / found.factor:.2f} times: another gain or lamp, "
        )
        message += "or a spot that is larger than the sample or the detector's view?"
    return Diagnosis("table-gain", message, amount=max(found.factor, 1.0 / found.factor))


def _bright(value: np.ndarray) -> float | None:
    return float(np.quantile(value, 0.75)) if len(value) >= FEWEST else None


def _saturated(samples: GoniometerSamples) -> Diagnosis | None:
    """Whether the largest value comes far more often than the next, as where a detector could take no more."""
    at = numbered(places(samples.theta_i, samples.theta_r, samples.phi_r - samples.phi_i))
    for channel, value in zip(samples.channels, samples.value.T, strict=True):
        values, count = np.unique(apart(value, at), return_counts=True)
        beside = count[-BELOW - 1 : -1]
        if len(beside) < BELOW or count[-1] < max(LEVEL, FLAT * beside.mean()):
            continue
        of = f" of {channel}" if len(samples.channels) > 1 else ""
        message = (
            f"the largest value{of}, {values[-1]:.6g}, comes at {count[-1]} pairs of directions: was the "
        )
        message += "detector saturated there? Leave such rows out"
        return Diagnosis("table-saturated", message, amount=float(count[-1]), least=LEVEL)
    return None


def much_lost(samples: GoniometerSamples, rest: GoniometerSamples) -> tuple[Diagnosis, ...]:
    """Whether no row beyond some angle is left of ``samples``, or a tenth of all rows is not."""
    count, lost = len(samples.value), len(samples.value) - len(rest.value)
    for name, word in (("theta_r", "exit"), ("theta_i", "incidence")):
        had, has = (float(np.degrees(getattr(one, name).max())) for one in (samples, rest))
        if had - has >= EDGE:
            message = (
                f"no row beyond {has:.0f} degrees of {word} is a measurement, of rows up to {had:.0f} degrees"
            )
            return (Diagnosis("table-much-lost", message, amount=lost / count),)
    if lost >= LOST * count:
        message = f"{lost} of {count} rows are no measurements"
        return (Diagnosis("table-much-lost", message, amount=lost / count),)
    return ()
