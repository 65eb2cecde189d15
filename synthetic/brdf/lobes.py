"""Lobes of the coefficient file, from docs/modes.md alone and not by the fitter's code."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline, RectBivariateSpline
from scipy.special import erfc

from photogonio.synthetic.brdf.glossy import fresnel, schlick
from photogonio.synthetic.brdf.reflectance import PairAngles, spread

FIRST = {"ggx": ("mirror", "ggx"), "retro-ggx": ("retro", "ggx"), "retro-beckmann": ("retro", "beckmann")}
ROOTS = np.linspace(0.0, 1.0, 65)  # of the cosine, at which a coat's albedo is known
TURNS = np.linspace(0.0, 0.5 * np.pi, 9)  # from the first roughness of two


def lobe_value(lobe: dict[str, Any], pairs: PairAngles) -> np.ndarray:
    """(n, c) of a lobe as the file lists it, 1/sr."""
    model, distribution = FIRST.get(lobe["model"], (lobe["model"], lobe.get("distribution", "ggx")))
    if model in ("retro", "round"):
        about = pairs.cos_phase if model == "retro" else 2.0 * pairs.cos_i * pairs.cos_r - pairs.cos_phase
        cos = np.sqrt(0.5 * np.maximum(1.0 + about, 0.0))
        tangent = np.sqrt(np.maximum(1.0 - cos**2, 0.0)) / lobe["roughness"]
        return spread(0.25 * density(distribution, tangent**2, cos, lobe["roughness"] ** 2), lobe["weight"])
    along, across = np.broadcast_to(np.asarray(lobe["roughness"], float), 2)
    turn = np.radians(lobe.get("azimuth", 0.0))
    surface = (float(along), float(across), distribution, lobe.get("masking", "correlated"))
    value = microfacets(surface, turned(pairs.incident, turn), turned(pairs.exit, turn))
    exact = lobe.get("fresnel", "dielectric" if model == "coat" else "schlick") == "dielectric"
    if not exact:
        return value[:, None] * schlick(pairs.cos_d, lobe["f0"]) * np.asarray(lobe["weight"], float)
    total = spread(value * fresnel(pairs.cos_d, index_of(lobe["f0"])), lobe["weight"])
    if model == "coat":
        sent = coat_albedo(surface, float(lobe["f0"]))
        entered = [1.0 - sent(turned(v, turn)) for v in (pairs.incident, pairs.exit)]
        total = total + spread(entered[0] * entered[1] / np.pi, lobe["ground"])
    return total


def index_of(f0: float) -> float:
    return float((1.0 + np.sqrt(f0)) / (1.0 - np.sqrt(f0)))


def turned(directions: np.ndarray, angle: float) -> np.ndarray:
    """Directions (n, 3) in a frame turned by ``angle`` about the normal."""
    x, y, z = directions.T
    cos, sin = np.cos(angle), np.sin(angle)
    return np.column_stack([cos * x + sin * y, cos * y - sin * x, z])


def density(distribution: str, slope2: np.ndarray, cos: np.ndarray, area: float) -> np.ndarray:
    """D (n,) of normals at ``cos``; ``slope2`` is the sum of squared tangential parts over the roughnesses."""
    if distribution == "ggx":
        return 1.0 / (np.pi * area * (cos**2 + slope2) ** 2)
    return np.exp(-slope2 / np.maximum(cos, 1e-9) ** 2) / (np.pi * area * np.maximum(cos, 1e-9) ** 4)


def microfacets(surface: tuple[float, float, str, str], incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
    """D G / (4 cos_i cos_r), (n,)."""
    along, across, distribution, masking = surface
    half = incident + exit
    half = half / np.linalg.norm(half, axis=1, keepdims=True)
    slope2 = (half[:, 0] / along) ** 2 + (half[:, 1] / across) ** 2
    hidden = [
        _hidden(distribution, np.hypot(along * v[:, 0], across * v[:, 1]) / v[:, 2]) for v in (incident, exit)
    ]
    both = hidden[0] * hidden[1] if masking == "separable" else 0.0
    seen = 1.0 / (1.0 + hidden[0] + hidden[1] + both)
    return (
        density(distribution, slope2, half[:, 2], along * across) * seen / (4.0 * incident[:, 2] * exit[:, 2])
    )


def _hidden(distribution: str, tangent: np.ndarray) -> np.ndarray:
    """Smith's Lambda (Walter et al. 2007)."""
    if distribution == "ggx":
        return 0.5 * (np.sqrt(1.0 + tangent**2) - 1.0)
    a = 1.0 / np.maximum(tangent, 1e-12)
    return 0.5 * (np.exp(-np.minimum(a * a, 700.0)) / (a * np.sqrt(np.pi)) - erfc(a))


@lru_cache
def coat_albedo(surface: tuple[float, float, str, str], f0: float) -> Callable[[np.ndarray], np.ndarray]:
    """E of directions (n, 3) in the frame of the roughnesses: a spline through integrals over the exit hemisphere."""
    cos = np.maximum(ROOTS**2, 1e-6)
    if surface[0] == surface[1]:
        known = CubicSpline(ROOTS, [_sent(surface, f0, c, 0.0) for c in cos])
        return lambda directions: known(np.sqrt(directions[:, 2]))
    table = np.array([[_sent(surface, f0, c, turn) for turn in TURNS] for c in cos[::2]])
    spline = RectBivariateSpline(ROOTS[::2], TURNS, table)

    def sent(directions: np.ndarray) -> np.ndarray:
        turn = np.arctan2(np.abs(directions[:, 1]), np.abs(directions[:, 0]))
        return spline.ev(np.sqrt(directions[:, 2]), turn)

    return sent


def _sent(surface: tuple[float, float, str, str], f0: float, cos: float, turn: float) -> float:
    """The integral of the lobe times cos_r, over exit directions about the mirror direction: panels of Gauss nodes that
    close in on it."""
    sin = np.sqrt(1.0 - cos * cos)
    mirror = np.arccos(cos)
    steps = np.concatenate([[0.0], 0.5 ** np.arange(9)[::-1] * 0.5 * np.pi])
    theta, weight = _panels(np.concatenate([mirror - steps, mirror + steps]), 0.0, 0.5 * np.pi)
    phi, share = _panels(np.concatenate([-2.0 * steps, 2.0 * steps]), -np.pi, np.pi)
    t, p = (grid.ravel() for grid in np.meshgrid(theta, phi + turn + np.pi, indexing="ij"))
    exit = np.column_stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
    light = np.broadcast_to([sin * np.cos(turn), sin * np.sin(turn), cos], exit.shape)
    cos_d = np.sqrt(np.clip(0.5 * (1.0 + np.sum(light * exit, axis=1)), 0.0, 1.0))
    value = microfacets(surface, light, exit) * fresnel(cos_d, index_of(f0))
    return float(np.sum(value * exit[:, 2] * np.sin(t) * np.outer(weight, share).ravel()))


def _panels(bounds: np.ndarray, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    bounds = np.unique(np.concatenate([np.clip(bounds, low, high), [low, high]]))
    bounds = bounds[np.concatenate([[True], np.diff(bounds) > 1e-12])]
    node, weight = np.polynomial.legendre.leggauss(8)
    width = np.diff(bounds)[:, None]
    return (bounds[:-1, None] + width * 0.5 * (node + 1.0)).ravel(), (0.5 * width * weight).ravel()
