"""Angles and values of a table in the project's own terms: radians, azimuths from the lamp's side, f in 1/sr."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.goniometer.columns import is_elevation, units_of
from photogonio.reconstruct.goniometer.text import TextTable
from photogonio.reconstruct.goniometer.told import Told

RADIANS = 1.58  # the largest polar angle is pi / 2
TURN = 6.3  # likewise of azimuths, 2 pi
WIDE = 10.0  # degrees: polar angles beyond which no table has azimuths of a few degrees alone
GRADIANS = 0.9  # degrees
UNIT = {"degrees": 1.0, "radians": 180.0 / math.pi, "gradians": GRADIANS}  # degrees
GRIDDED, MANY = 4, 200  # different polar angles of a grid
LOOSE = 0.006  # of angles that were rounded to two digits
NORMAL = 0.5  # degrees: nearer to the normal a direction has no side
GRAZING = math.cos(math.radians(89.5))  # values divided by less say nothing
HORIZON = 89.95  # degrees: nothing is lit or seen from there on, but elevations end there
ABOVE = 4.0  # degrees from the normal, that other angles of a table begin at or nearer
SIDE = 15.0  # degrees about a direction: where its peak would be


def directions(
    table: TextTable, angles: Mapping[str, str], value: np.ndarray, told: Told
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """theta_i, phi_i, theta_r, phi_r (n,) in radians, phi_r - phi_i = 0 on the lamp's side; a negative theta is
    folded to the other side, elevations are taken from 90 degrees. ``value`` (n,) helps to ask which side is which.

    Raises:
        InputError: the unit or the side is not told, and cannot be taken for granted.
    """
    found = {name: table.number(header) for name, header in angles.items()}
    units = told.units() or units_of(table, angles)
    degree = _degrees(table, found, units)
    zero = np.zeros(len(table))
    turned = {name: degree[name] * found.get(name, zero) for name in ("theta_i", "phi_i", "theta_r", "phi_r")}
    for name in ("theta_i", "theta_r"):
        if is_elevation(angles[name]):
            turned[name] = 90.0 - turned[name]
        elif name not in units:
            _ask_elevation(table, name, turned[name], value)
    if "phi_r" not in found and told.azimuth is None:
        _ask_side(table, turned["theta_i"], turned["theta_r"], value)
    theta_i, phi_i = _fold(turned["theta_i"], turned["phi_i"])
    theta_r, phi_r = _fold(turned["theta_r"], turned["phi_r"] + (180.0 if told.azimuth == "mirror" else 0.0))
    return theta_i, phi_i, theta_r, phi_r


def _degrees(table: TextTable, found: Mapping[str, np.ndarray], units: Mapping[str, str]) -> dict[str, float]:
    """How many degrees the unit of each angle is, those of ``units`` as they are told.

    Raises:
        InputError: one is none of its unit, or its unit is not told and seems another than degrees.
    """
    largest = {name: float(np.nanmax(np.abs(angle), initial=0.0)) for name, angle in found.items()}
    for name, most in largest.items():
        if units.get(name) == "radians" and most > 4.0 * TURN:
            raise InputError(table.path, f"an angle is {most:g}: these are no radians")
    untold = {name: angle for name, angle in found.items() if name not in units}
    if untold:
        _ask_unit(table, untold, largest)
    return {name: UNIT[units.get(name, "degrees")] for name in ("theta_i", "phi_i", "theta_r", "phi_r")}


def _ask_unit(table: TextTable, found: Mapping[str, np.ndarray], largest: Mapping[str, float]) -> None:
    """Raises InputError where angles whose unit nobody told seem to be radians or gradians, all or some of them."""
    theta = max((largest[name] for name in found if name.startswith("theta")), default=0.0)
    phi = max((largest[name] for name in found if name.startswith("phi")), default=0.0)
    if _turns_by_400(found):
        raise InputError(
            table.path,
            f"azimuths reach {phi:g}: are these gradians, of which 400 are a turn? Say --angles gradians if polar "
            "angles are gradians too, --angles theta=degrees,phi=gradians if those are degrees, or --angles degrees",
        )
    if 0.0 < theta <= RADIANS:
        if phi <= TURN:
            raise InputError(
                table.path,
                f"no polar angle is above {theta:.4g}, no azimuth above {phi:.4g}: are these radians? "
                "Say --angles radians, or --angles degrees if they are not",
            )
        raise InputError(
            table.path,
            f"no theta is above {theta:.4g}, but azimuths reach {phi:.4g}: polar angles in radians? "
            "Say --angles theta=radians,phi=degrees, or --angles degrees if they are not",
        )
    if 0.0 < phi <= TURN and theta > WIDE:
        raise InputError(
            table.path,
            f"no azimuth is above {phi:.4g}, but polar angles reach {theta:.4g}: azimuths in radians? "
            "Say --angles theta=degrees,phi=radians, or --angles degrees if they are not",
        )
    for name, angle in found.items():
        other = max((largest[one] for one in found if one[:3] == name[:3]), default=0.0)
        limit = RADIANS if name.startswith("theta") else TURN
        if 0.0 < largest[name] <= limit and other > WIDE and not _round(angle):
            raise InputError(
                table.path,
                f"{name} is {largest[name]:.4g} at most, where others of its kind reach {other:.4g}: is it in radians? "
                f"Say --angles {name}=radians and the others' units, or --angles degrees",
            )
    _ask_even_gradians(table, {name: angle for name, angle in found.items() if name.startswith("theta")})


def _ask_even_gradians(table: TextTable, polar: Mapping[str, np.ndarray]) -> None:
    """Raises InputError where polar angles of a grid are no even degrees, and even ones if they are gradians."""
    for name, angle in polar.items():
        every = np.unique(np.abs(angle[np.isfinite(angle) & (angle != 0.0)]))
        if (
            GRIDDED <= len(every) < MANY
            and _round(GRADIANS * every)
            and np.mean(_off_round(every) > LOOSE) > 0.5
        ):
            raise InputError(
                table.path,
                f"{name} ({every[0]:.5g}, {every[1]:.5g} ...) has no even degrees, but has if it is in gradians, of "
                "which 400 are a turn: say --angles gradians, theta=gradians,phi=degrees, or degrees if it is not",
            )


def _off_round(angle: np.ndarray) -> np.ndarray:
    """How far numbers are from halves."""
    return np.abs(angle - np.rint(2.0 * angle) / 2.0)


def _round(angle: np.ndarray) -> bool:
    """Whether all that are finite are halves, as people set angles."""
    return bool((_off_round(angle[np.isfinite(angle)]) < LOOSE).all())


def _ask_elevation(table: TextTable, name: str, degrees: np.ndarray, value: np.ndarray) -> None:
    """Raises InputError where polar angles end at the horizon, with readings there, and do not begin at the normal."""
    angle = np.abs(degrees[np.isfinite(value) & (value > 0.0)])
    angle = angle[np.isfinite(angle) & (angle < 90.0 + NORMAL)]
    if len(angle) and angle.max() > HORIZON and ABOVE < angle.min() < 90.0 - ABOVE:
        raise InputError(
            table.path,
            f"{name} is between {angle.min():.4g} and {angle.max():.4g} degrees, and at the horizon no light is "
            "measured: are these elevations? Take them from 90, or say --angles degrees if they are not",
        )


def _turns_by_400(found: Mapping[str, np.ndarray]) -> bool:
    """Whether azimuths of light from one azimuth go around by 400: beyond 360, by half a turn of 200, or in even steps
    that close at 400 and never at 360."""
    incident, exit = (found.get(name, np.zeros(1)) for name in ("phi_i", "phi_r"))
    if not np.isfinite(exit).any() or np.nanmax(incident) != np.nanmin(incident):
        return False
    low, high = (float(side) for side in (np.nanmin(exit), np.nanmax(exit)))
    beyond = low >= 0.0 and 360.0 + NORMAL < high <= 400.0 + NORMAL
    halves = (low, high) in ((0.0, 200.0), (-200.0, 200.0), (-200.0, 0.0))
    return beyond or halves or _closes_at_400(exit)


def _closes_at_400(azimuth: np.ndarray) -> bool:
    """Whether a turn of 400 is cut evenly by azimuths of which there are three or more, from 0 on or about it."""
    found = np.unique(np.round(azimuth[np.isfinite(azimuth)] % 400.0, 2))
    found = found[found < 399.9]  # rounding of a whole turn
    if len(found) < 3 or abs(360.0 / (400.0 / len(found)) % 1.0) < 1e-6:
        return False
    return bool(np.allclose(found, np.arange(len(found)) * 400.0 / len(found), atol=0.05))


def _ask_side(table: TextTable, theta_i: np.ndarray, theta_r: np.ndarray, value: np.ndarray) -> None:
    """Raises InputError for a table without azimuths that nobody told the sides of, unless sides do not matter."""
    if not (np.abs(theta_i) > NORMAL).any() or not (np.abs(theta_r) > NORMAL).any():
        return
    same, other = (_brightest(np.abs(theta_r - sign * theta_i), theta_i, value) for sign in (1.0, -1.0))
    guess = ""
    if max(same, other) > 1.2 * min(same, other):
        where = "of the same sign as" if same > other else "of the other sign than"
        guess = f" (readings are brightest at theta_r {where} theta_i, and most surfaces are toward the mirror side)"
    raise InputError(
        table.path,
        "no azimuths (phi_i, phi_r): which side are exit angles on that have the sign of theta_i? Say --azimuth "
        f"mirror if they are on the mirror side, --azimuth lamp if they are on the lamp's{guess}",
    )


def _brightest(apart: np.ndarray, theta_i: np.ndarray, value: np.ndarray) -> float:
    """Mean value near where ``apart`` is 0, off the normal; 0 where nothing is."""
    near = (apart < SIDE) & (np.abs(theta_i) > SIDE) & np.isfinite(value)
    return float(np.mean(value[near])) if near.any() else 0.0


def _fold(theta: np.ndarray, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Degrees to radians; a negative theta becomes positive on the other side."""
    return np.radians(np.abs(theta)), np.radians(np.where(theta < 0, phi + 180.0, phi))


def per_brdf(quantity: str, theta_i: np.ndarray, theta_r: np.ndarray) -> np.ndarray:
    """What the table's numbers are over f (n,), sr; NaN where that is 0, toward grazing."""
    cos_i, cos_r = np.cos(theta_i), np.cos(theta_r)
    factor = {
        "brdf": np.ones_like(cos_i),
        "brdf-cos": cos_r,
        "brdf-cos-incident": cos_i,
        "brdf-cos-cos": cos_i * cos_r,
        "reflectance-factor": np.full_like(cos_i, math.pi),
        "percent": np.full_like(cos_i, 100.0 * math.pi),
    }[quantity]
    grazing = {"brdf-cos": cos_r, "brdf-cos-incident": cos_i, "brdf-cos-cos": np.minimum(cos_i, cos_r)}
    return np.where(grazing.get(quantity, 1.0) < GRAZING, np.nan, factor)
