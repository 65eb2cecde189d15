"""The library of known BRDFs by name, and the grid of angles on which a truth is written down."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.synthetic.brdf import glossy, matte
from photogonio.synthetic.brdf.reflectance import Reflectance

MODELS: dict[str, type[Reflectance]] = {
    "lambert": matte.Lambert,
    "minnaert": matte.Minnaert,
    "oepik": matte.Oepik,
    "oren-nayar": matte.OrenNayar,
    "oren-nayar-qualitative": matte.OrenNayarQualitative,
    "retro-reflector": matte.RetroReflector,
    "phong": glossy.Phong,
    "blinn-phong": glossy.BlinnPhong,
    "blinn": glossy.Blinn,
    "torrance-sparrow": glossy.TorranceSparrow,
    "ggx-conductor": glossy.Conductor,
    "anisotropic-ggx": glossy.AnisotropicConductor,
    "brushed-metal": glossy.BrushedMetal,
    "plastic": glossy.Plastic,
    "plastic-schlick": glossy.PlasticSchlick,
    "satin-paint": glossy.SatinPaint,
    "glossy-paint": glossy.GlossyPaint,
}
POSITIVE = ("roughness", "roughness_x", "roughness_y", "width", "c3", "ior", "power")
NOT_NEGATIVE = ("albedo", "specular", "retro", "mirror", "f0", "sigma", "k")


def make_brdf(
    model: str, parameters: dict[str, object] | None = None, *, where: object = "brdf"
) -> Reflectance:
    """A model of MODELS with its parameters; lists become one number a channel.

    Raises InputError for an unknown model or parameter.
    """
    if model not in MODELS:
        raise InputError(where, f"model: expected one of {', '.join(MODELS)}, got {model!r}")
    known = {f.name: f for f in fields(MODELS[model])}
    parameters = dict(parameters or {})
    for key, value in parameters.items():
        if key not in known:
            raise InputError(where, f"{model} has no parameter {key!r}; it has {', '.join(sorted(known))}")
        parameters[key] = checked(key, value, where)
        if isinstance(value, list | tuple) and not isinstance(known[key].default, tuple):
            raise InputError(where, f"{key}: {model} has one number of it, for all channels; got {value!r}")
    return MODELS[model](**parameters)


def checked(key: str, value: object, where: object) -> object:
    """A parameter as a number or a tuple of them; InputError for what no model can take."""
    values = value if isinstance(value, list | tuple) else [value]
    if not all(isinstance(v, int | float) and np.isfinite(v) for v in values) or not values:
        raise InputError(where, f"{key}: expected a number or one a channel, got {value!r}")
    if key in POSITIVE and min(values) <= 0:
        raise InputError(where, f"{key}: expected more than 0, got {value!r}")
    if key in NOT_NEGATIVE and min(values) < 0:
        raise InputError(where, f"{key}: expected 0 or more, got {value!r}")
    return tuple(map(float, values)) if isinstance(value, list | tuple) else value


def angle_grid(step_degrees: float = 5.0) -> np.ndarray:
    """(n, 3) theta_i, theta_r, dphi in radians at the middles of ``step_degrees`` cells: 2.5, 7.5, ..."""
    half = 0.5 * step_degrees
    theta = np.radians(np.arange(half, 90.0, step_degrees))
    dphi = np.radians(np.arange(half, 180.0, step_degrees))
    return np.stack([a.ravel() for a in np.meshgrid(theta, theta, dphi, indexing="ij")], axis=-1)


def directions(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Unit vectors (..., 3) of polar angles, radians."""
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)


def on_grid(brdf: Reflectance, angles: np.ndarray) -> np.ndarray:
    """BRDF (n, c) at theta_i, theta_r, dphi (n, 3), with the light in the plane of x."""
    zero = np.zeros(len(angles))
    return brdf(directions(angles[:, 0], zero), directions(angles[:, 1], angles[:, 2]))
