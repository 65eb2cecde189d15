"""Tables as a goniometer gives them, of known surfaces, and spoilt as instruments and programs spoil them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from photogonio.reconstruct.modes.angles import pair_angles, unit_vectors
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples, samples_table
from photogonio.synthetic.brdf.library import make_brdf

ROWS = 900
Surface = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]  # theta_i, theta_r, dphi -> f, 1/sr


def lobe(theta_i, theta_r, dphi, exponent: float, *, toward: float = -1.0) -> np.ndarray:
    """cos^n of the angle between exit and mirror direction, or with ``toward`` 1 and the lamp's; its albedo at normal
    incidence is 2 pi / (n + 2)."""
    along, across = np.cos(theta_i) * np.cos(theta_r), np.sin(theta_i) * np.sin(theta_r) * np.cos(dphi)
    return np.maximum(along + toward * across, 0.0) ** exponent


def matte(albedo: float) -> Surface:
    return lambda theta_i, theta_r, dphi: np.full_like(theta_i, albedo / np.pi)


def glossy(albedo: float, weight: float, exponent: float, *, toward: float = -1.0) -> Surface:
    """Lambert and a lobe that is reciprocal."""
    scale = weight * (exponent + 2.0) / (2.0 * np.pi)
    return lambda ti, tr, p: albedo / np.pi + scale * lobe(ti, tr, p, exponent, toward=toward)


SATIN = glossy(0.3, 0.1, 20.0)


def rough(albedo: float) -> Surface:
    """Brighter toward the lamp, broadly, as rough matte surfaces are (Oren and Nayar 1994)."""

    def f(theta_i, theta_r, dphi):
        steep, flat = np.maximum(theta_i, theta_r), np.minimum(np.minimum(theta_i, theta_r), 1.2)
        return albedo / np.pi * (0.8 + 0.35 * np.maximum(np.cos(dphi), 0.0) * np.sin(steep) * np.tan(flat))

    return f


def regular(step_i: float = 15.0, step_r: float = 10.0, step_phi: float = 30.0) -> tuple[np.ndarray, ...]:
    """theta_i, theta_r, dphi (n,) of a grid, radians."""
    axes = (np.arange(0, 76, step_i), np.arange(0, 81, step_r), np.arange(0, 360, step_phi))
    return tuple(np.radians(axis.ravel()) for axis in np.meshgrid(*axes, indexing="ij"))


def in_plane(step: float = 3.0) -> tuple[np.ndarray, ...]:
    theta_i, signed = np.meshgrid([10.0, 30.0, 50.0, 70.0], np.arange(-78, 79, step), indexing="ij")
    dphi = np.where(signed < 0, 0.0, 180.0)
    return tuple(np.radians(axis.ravel()) for axis in (theta_i, np.abs(signed), dphi))


def scattered(count: int, seed: int = 0) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    theta_i, theta_r = np.arccos(rng.uniform(np.cos(np.radians(80)), 1.0, (2, count)))
    return theta_i, theta_r, rng.uniform(0.0, 2.0 * np.pi, count)


def measured(
    surface: Surface,
    at: tuple[np.ndarray, ...],
    *,
    noise: float = 0.005,
    constant: float = 0.0,
    seed: int = 1,
) -> GoniometerSamples:
    """What a goniometer reads, to six digits: ``noise`` relative, ``constant`` 1/sr."""
    rng = np.random.default_rng(seed)
    theta_i, theta_r, dphi = at
    value = surface(theta_i, theta_r, dphi)
    value = value * (1.0 + noise * rng.normal(size=len(value))) + constant * rng.normal(size=len(value))
    return samples(at, np.array([float(f"{one:.6g}") for one in value]))


def samples(at: tuple[np.ndarray, ...], value: np.ndarray) -> GoniometerSamples:
    theta_i, theta_r, dphi = at
    line = np.arange(2, len(value) + 2)[:, None]
    return GoniometerSamples(
        theta_i, 0.0 * theta_i, theta_r, dphi, value[:, None], None, ("value",), line=line
    )


def rows_of(name, parameters, seed=0):
    """Values (n, 1) of a known surface at random pairs, theta_i, theta_r and phi_r (n,)."""
    rng = np.random.default_rng(seed)
    theta_i, theta_r = np.arccos(rng.uniform(0.17, 1.0, (2, ROWS)))
    phi_r = rng.uniform(0.0, 2.0 * np.pi, ROWS)
    brdf = make_brdf(name, parameters)
    return (
        brdf(unit_vectors(theta_i, 0.0 * theta_i), unit_vectors(theta_r, phi_r))[:, :1],
        theta_i,
        theta_r,
        phi_r,
    )


def table_of_rows(value, theta_i, theta_r, phi_r):
    return samples_table(GoniometerSamples(theta_i, 0.0 * theta_i, theta_r, phi_r, value, None, ("Y",)))


def satin(incident, exit):
    """:data:`SATIN` of unit vectors (n, 3), in three channels."""
    theta_i, theta_r, dphi = pair_angles(incident, exit)
    return np.repeat(SATIN(theta_i, theta_r, dphi)[:, None], 3, axis=1)
