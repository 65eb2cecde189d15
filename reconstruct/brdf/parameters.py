"""The numbers that a BRDF consists of, by their names in the coefficient file, and how f changes with each.

Modes come first, in the file's order, then each lobe's numbers; angles are in degrees, as in the file.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from photogonio.reconstruct.lobes.lobe import Lobe

STEP = 1e-3  # of a number, in finite differences; degrees of an azimuth times 100
LEAST = 1e-3  # size of a number of which the step is taken
DIGITS, FULL = 4, 12  # significant digits of errors; of covariances, which may all but cancel
_NAME = re.compile(r"lobe (\d+) (.+)")


def mode_names(symmetry: str, modes: np.ndarray) -> list[str]:
    """``S n m l`` of isotropic modes, ``Z n l n' l'`` of others."""
    letter = "S" if symmetry == "isotropic" else "Z"
    return [" ".join([letter, *(str(int(n)) for n in row)]) for row in modes]


def lobe_numbers(lobe: Lobe) -> tuple[str, ...]:
    """What a lobe's numbers are called, without the lobe's own name."""
    names = ("roughness along", "roughness across", "azimuth") if lobe.turning else ("roughness",)
    if lobe.peak:
        return (*names, "weight")
    return (*names, "f0", "weight", "ground") if lobe.model == "coat" else (*names, "f0", "weight")


def lobe_parameter(name: str, lobes: Sequence[Lobe]) -> tuple[int, str] | None:
    """The lobe's place and the number that ``name`` means; None if there is none."""
    found = _NAME.fullmatch(name)
    if found is None or int(found[1]) >= len(lobes):
        return None
    place, what = int(found[1]), found[2]
    return (place, what) if what in lobe_numbers(lobes[place]) else None


def named_number(name: str, lobes: Sequence[Lobe]) -> tuple[int, str]:
    """The same of a name that means one. Raises KeyError for others."""
    found = lobe_parameter(name, lobes)
    if found is None:
        raise KeyError(name)
    return found


def is_shared(name: str, lobes: Sequence[Lobe]) -> bool:
    """Whether channels have the same of a lobe's number: its shape, and the base reflectance of a dielectric."""
    found = lobe_parameter(name, lobes)
    if found is None:
        return False
    lobe, what = lobes[found[0]], found[1]
    return (
        what.startswith("roughness") or what == "azimuth" or (what == "f0" and lobe.fresnel == "dielectric")
    )


def number_of(lobe: Lobe, what: str) -> np.ndarray:
    """(c,) the value of a number, the same for all channels where they share it."""
    shared = {
        "roughness": lobe.axes[0],
        "roughness along": lobe.axes[0],
        "roughness across": lobe.axes[1],
        "azimuth": float(np.degrees(lobe.azimuth)),
    }
    if what in shared:
        return np.full(len(lobe.weight), shared[what])
    return np.array(getattr(lobe, what), float)


def with_number(lobe: Lobe, what: str, value: np.ndarray) -> Lobe:
    """A lobe with another value (c,) of a number; the first channel's where all share it."""
    first = float(value[0])
    if what == "roughness":
        return replace(lobe, roughness=first)
    if what == "roughness along":
        return replace(lobe, roughness=(first, lobe.axes[1]))
    if what == "roughness across":
        return replace(lobe, roughness=(lobe.axes[0], first))
    if what == "azimuth":
        return replace(lobe, azimuth=float(np.radians(first)))
    if what == "f0" and lobe.fresnel == "dielectric":
        return replace(lobe, f0=np.full_like(value, first))
    given: dict[str, Any] = {what: np.asarray(value, float)}
    return replace(lobe, **given)


def either_side(lobe: Lobe, what: str) -> tuple[Lobe, Lobe, float]:
    """The lobe with a number a step less and a step more, and what lies between both."""
    value = number_of(lobe, what)
    step = 100.0 * STEP if what == "azimuth" else STEP * max(float(np.abs(value).max()), LEAST)
    return with_number(lobe, what, value - step), with_number(lobe, what, value + step), 2.0 * step


def slopes(brdf, where: Sequence[np.ndarray], parameters: Sequence[str]) -> np.ndarray:
    """(n, p, c) derivatives of f by the parameters; ``where`` are angles (n,), radians, as of the BRDF. Modes that
    ``parameters`` name come first."""
    modes = len(brdf.modes)
    angles = [np.asarray(a, float) for a in where]
    result = np.empty((len(angles[0]), len(parameters), len(brdf.channels)))
    unit = replace(brdf, lobes=(), uncertainty=None)
    result[:, :modes] = _mode_slopes(unit, angles)[:, :, None]
    for p, name in enumerate(parameters[modes:], start=modes):
        place, what = named_number(name, brdf.lobes)
        less, more, between = either_side(brdf.lobes[place], what)
        ti, pi, tr, pr = angles
        change = more.evaluate(ti, tr, pr - pi, pi) - less.evaluate(ti, tr, pr - pi, pi)
        result[:, p] = change / between
    return result


def _mode_slopes(brdf, angles: Sequence[np.ndarray]) -> np.ndarray:
    """(n, m) of the modes' coefficients."""
    count = len(brdf.modes)
    if not count:
        return np.empty((len(angles[0]), 0))
    names = tuple(str(k) for k in range(count))
    unit = replace(brdf, coefficients=np.eye(count), standard_errors=np.zeros((count, count)), channels=names)
    return unit.evaluate(*angles)


def rounded(values: np.ndarray, digits: int = DIGITS) -> np.ndarray:
    """The same to so many significant digits: what is written is what is held."""
    size = np.where(values == 0.0, 1.0, np.abs(values))
    scale = 10.0 ** (digits - 1 - np.floor(np.log10(size)))
    return np.round(values * scale) / scale
