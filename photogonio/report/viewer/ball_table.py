"""A BRDF as a table that a browser looks up: over half vector and difference angles, with its relative error.

Rusinkiewicz (1998): a gloss is narrow in the half vector's polar angle alone, in whose root nodes are even, as MERL's.
"""

from __future__ import annotations

import base64

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.export.rgb import rgb_order
from photogonio.reconstruct.modes.angles import from_half_difference, spherical_angles

ISOTROPIC = (1, 64, 32, 16)  # nodes: azimuth and polar angle of the half vector, difference angle and azimuth
TURNING = (12, 32, 12, 16)
COARSE = 5  # nodes of errors along an axis, which are smooth
LOWEST = np.sin(np.radians(5.0))  # cosine to which directions near the horizon are lifted
ANGLES = np.radians([0.0, 15.0, 30.0, 45.0, 60.0])  # of incidence, whose highest lobe is one radius


def ball_table(brdf: Brdf) -> dict[str, object]:
    """``shape``, ``folded`` (difference azimuths of a quarter turn, which the others mirror), ``data``: base64 of half
    floats (..., 4) little-endian, f in red, green and blue, 1/sr, and its relative standard error (0: not known);
    ``highest``: the greatest f, mean of the three, in the plane of incidence up to 60 degrees of it, 75 of exit."""
    turning = brdf.turning
    shape = TURNING if turning else ISOTROPIC
    axes = [np.linspace(0.0, 1.0, count) if count > 1 else np.zeros(1) for count in shape]
    if turning:  # all the way round, without the end that is the beginning again
        axes = [np.arange(n) / n if k in (0, 3) else axes[k] for k, n in enumerate(shape)]
    places = np.stack([grid.ravel() for grid in np.meshgrid(*axes, indexing="ij")], axis=1)
    f = _rgb(brdf, np.maximum(brdf.evaluate(*_angles(places, turning)), 0.0))
    error = _relative(brdf, places, turning)
    data = np.column_stack([np.minimum(f, 6e4), error]).astype("<f2")
    return {
        "shape": list(shape),
        "folded": not turning,
        "error": bool((error > 0.0).any()),
        "data": base64.b64encode(data.tobytes()).decode("ascii"),
        "highest": _highest(brdf),
    }


def _angles(places: np.ndarray, turning: bool) -> tuple[np.ndarray, ...]:
    """theta_i, phi_i, theta_r, phi_r (n,) at places (n, 4) from 0 to 1 along the axes."""
    phi_h, theta_h = 2.0 * np.pi * places[:, 0], 0.5 * np.pi * places[:, 1] ** 2
    phi_d = places[:, 3] * (2.0 * np.pi if turning else 0.5 * np.pi)
    angles = []
    for vector in from_half_difference(theta_h, 0.5 * np.pi * places[:, 2], phi_d):
        lifted = np.column_stack([vector[:, :2], np.maximum(vector[:, 2], LOWEST)])
        theta, phi = spherical_angles(lifted / np.linalg.norm(lifted, axis=1, keepdims=True))
        angles += [theta, phi + phi_h]
    return tuple(angles)


def _relative(brdf: Brdf, places: np.ndarray, turning: bool) -> np.ndarray:
    """(n,) standard error over f, of the channel that is least sure; 0 where it is not known."""
    if brdf.uncertainty is None:
        return np.zeros(len(places))
    axes = [np.linspace(0.0, 1.0, COARSE if turning or k else 2) for k in range(4)]
    grids = np.meshgrid(*axes, indexing="ij")
    angles = _angles(np.stack([grid.ravel() for grid in grids], axis=1), turning)
    f, error = brdf.evaluate(*angles), brdf.standard_error(*angles)
    least = 1e-3 * max(float(np.abs(f).max()), 1e-12)
    relative = np.nan_to_num(np.max(error / np.maximum(f, least), axis=1)).reshape(grids[0].shape)
    return np.minimum(RegularGridInterpolator(axes, relative)(places), 2.0)


def _highest(brdf: Brdf) -> float:
    theta = np.radians(np.linspace(-75.0, 75.0, 301))
    f = [brdf.evaluate(angle, 0.0, np.abs(theta), np.where(theta < 0.0, 0.0, np.pi)) for angle in ANGLES]
    return float(np.max(_rgb(brdf, np.concatenate(f)).mean(axis=1)))


def _rgb(brdf: Brdf, value: np.ndarray) -> np.ndarray:
    """(n, 3) to be drawn: R, G and B by name, any other three in order, else their mean."""
    order = rgb_order(brdf.channels)
    if order is None and value.shape[1] != 3:
        return np.repeat(value.mean(axis=1, keepdims=True), 3, axis=1)
    return value if order is None else value[:, order]
