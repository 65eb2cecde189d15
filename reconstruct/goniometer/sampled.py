"""Readings of a BRDF that is known everywhere, at directions that a fit can work with."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from photogonio.reconstruct.modes.angles import spherical_angles, unit_vectors
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples

Evaluate = Callable[[np.ndarray, np.ndarray], np.ndarray]
INCIDENCE = np.arange(0.0, 76.0, 7.5)  # degrees
EXIT = np.arange(0.0, 81.0, 8.0)
AZIMUTH = np.arange(0.0, 181.0, 15.0)  # of an isotropic surface, which is the same on both sides
TURNS = np.arange(0.0, 360.0, 45.0)  # incident azimuths of one that may not be
AROUND = (0.7, 1.5, 3.0, 5.0, 8.0)  # degrees from the mirror direction, where a gloss is


def samples_of(
    evaluate: Evaluate, channels: tuple[str, ...], *, isotropic: bool, note: str
) -> GoniometerSamples:
    """Readings on a grid of angles, and about the mirror directions; where ``evaluate`` says NaN there are none."""
    incident, exit = _pairs(isotropic)
    value = evaluate(incident, exit)
    good = np.isfinite(value).all(1)
    theta_i, phi_i = spherical_angles(incident[good])
    theta_r, phi_r = spherical_angles(exit[good])
    notes = (f"{note}: read at {good.sum()} pairs of directions",)
    return GoniometerSamples(theta_i, phi_i, theta_r, phi_r, value[good], None, channels, notes=notes)


def _pairs(isotropic: bool) -> tuple[np.ndarray, np.ndarray]:
    """Incident and exit unit vectors (n, 3)."""
    turns = np.zeros(1) if isotropic else TURNS
    azimuth = AZIMUTH if isotropic else np.arange(0.0, 360.0, 30.0)
    incidence = INCIDENCE if isotropic else INCIDENCE[::2]
    grid = np.meshgrid(incidence, turns, EXIT, azimuth, indexing="ij")
    theta_i, phi_i, theta_r, dphi = (np.radians(axis.ravel()) for axis in grid)
    once = (theta_r > 0.0) | (dphi == 0.0)  # at the normal all azimuths are one
    once &= (theta_i > 0.0) | (phi_i == 0.0)
    theta_i, phi_i, theta_r, dphi = (axis[once] for axis in (theta_i, phi_i, theta_r, dphi))
    incident, exit = unit_vectors(theta_i, phi_i), unit_vectors(theta_r, phi_i + dphi)
    near = [_about_mirror(theta, turn) for theta in np.radians(incidence) for turn in np.radians(turns)]
    return (
        np.vstack([incident, *(pair[0] for pair in near)]),
        np.vstack([exit, *(pair[1] for pair in near)]),
    )


def _about_mirror(theta: float, phi: float) -> tuple[np.ndarray, np.ndarray]:
    """The mirror direction of one incidence, and rings about it."""
    middle = unit_vectors(theta, phi + np.pi)
    along, across = unit_vectors(theta + np.pi / 2, phi + np.pi), unit_vectors(np.pi / 2, phi - np.pi / 2)
    radius, turn = np.meshgrid(np.radians(AROUND), np.arange(0.0, 2.0 * np.pi, np.pi / 4), indexing="ij")
    radius, turn = np.append(radius.ravel(), 0.0)[:, None], np.append(turn.ravel(), 0.0)[:, None]
    exit = np.cos(radius) * middle + np.sin(radius) * (np.cos(turn) * along + np.sin(turn) * across)
    exit = exit[exit[:, 2] > np.cos(np.radians(85.0))]
    return np.broadcast_to(unit_vectors(theta, phi), exit.shape), exit
