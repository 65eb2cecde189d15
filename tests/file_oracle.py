"""The coefficient file once more, evaluated from docs/modes.md alone: nothing here imports the project.

tests/reconstruct/lobes/test_lobe.py and tests/reconstruct/brdf/test_errors.py hold what the program reads and
computes against it.
"""

from __future__ import annotations

import json
from functools import lru_cache
from math import factorial
from pathlib import Path

import numpy as np
from scipy.special import erfc

COSINES = {"brdf": (0, 0), "brdf_cos": (1, 0), "brdf_cos_cos": (1, 1)}


def f_of(path: Path, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
    """f (n, c) of a file at unit vectors (n, 3), of version 1 or 2; 0 below the surface."""
    file = json.loads(Path(path).read_text())
    channels = len(file["channels"])
    value = np.zeros((len(incident), channels))
    above = (incident[:, 2] > 0) & (exit[:, 2] > 0)
    i, r = incident[above], exit[above]
    total = np.zeros((len(i), channels))
    for mode, coefficient in zip(file["modes"], file["coefficients"], strict=True):
        total += mode_value(file["symmetry"], mode, i, r)[:, None] * np.array(coefficient)
    of_i, of_r = COSINES[file["quantity"]]
    total /= (i[:, 2] ** of_i * r[:, 2] ** of_r)[:, None]
    for lobe in file["lobes"]:
        total += lobe_value(lobe, i, r)
    value[above] = total
    return value


def theta_mode(n: int, l: int, cos: np.ndarray) -> np.ndarray:
    """Theta_n^l, by the printed sum: exact to rounding at low orders."""
    rho, radial = np.sqrt(1.0 - cos), 0.0
    for s in range((n - l) // 2 + 1):
        below = factorial(s) * factorial((n + l) // 2 - s) * factorial((n - l) // 2 - s)
        radial = radial + (-1) ** s * factorial(n - s) / below * rho ** (n - 2 * s)
    return np.sqrt((n + 1) / (2 * np.pi)) * radial


def real_mode(n: int, l: int, w: np.ndarray) -> np.ndarray:
    phi = np.arctan2(w[:, 1], w[:, 0])
    wave = np.cos(l * phi) if l >= 0 else np.sin(-l * phi)
    return np.sqrt(2.0 if l else 1.0) * theta_mode(n, abs(l), w[:, 2]) * wave


def mode_value(symmetry: str, mode: list[int], i: np.ndarray, r: np.ndarray) -> np.ndarray:
    if symmetry == "isotropic":
        n, m, l = mode
        dphi = np.arctan2(r[:, 1], r[:, 0]) - np.arctan2(i[:, 1], i[:, 0])
        both = theta_mode(n, l, i[:, 2]) * theta_mode(m, l, r[:, 2])
        both = both + theta_mode(m, l, i[:, 2]) * theta_mode(n, l, r[:, 2])
        c2 = (2 if n != m else 4) * (1 if l == 0 else 0.5)
        return both * np.cos(l * dphi) / np.sqrt(c2)
    (n, l), (m, k) = mode[:2], mode[2:]
    one = real_mode(n, l, i) * real_mode(m, k, r)
    if symmetry == "general" or (n, l) == (m, k):
        return one
    return (one + real_mode(m, k, i) * real_mode(n, l, r)) / np.sqrt(2.0)


def lobe_value(lobe: dict, i: np.ndarray, r: np.ndarray) -> np.ndarray:
    """(n, c) of one lobe."""
    model = {"ggx": "mirror", "retro-ggx": "retro", "retro-beckmann": "retro"}.get(
        lobe["model"], lobe["model"]
    )
    name = lobe.get("distribution", "beckmann" if lobe["model"] == "retro-beckmann" else "ggx")
    weight = np.array(lobe["weight"])
    if model in ("retro", "round"):
        about = i if model == "retro" else i * [-1.0, -1.0, 1.0]
        half = 0.5 * np.arccos(np.clip(np.sum(about * r, axis=1), -1.0, 1.0))
        alpha = lobe["roughness"]
        return 0.25 * weight * slopes(name, np.tan(half) ** 2 / alpha**2, np.cos(half), alpha**2)[:, None]
    a = np.broadcast_to(lobe["roughness"], 2).astype(float)
    azimuth = np.radians(lobe.get("azimuth", 0.0))
    i, r = about_normal(i, azimuth), about_normal(r, azimuth)
    masking = lobe.get("masking", "correlated")
    base, cosine = facets(name, masking, a, i, r)
    if model == "mirror" and lobe.get("fresnel", "schlick") == "schlick":
        f0 = np.array(lobe["f0"])
        return weight * base[:, None] * (f0 + (1 - f0) * ((1 - cosine) ** 5)[:, None])
    value = weight * (base * fresnel(cosine, lobe["f0"]))[:, None]
    if model == "coat":
        sent = [albedo((name, masking, *a.tolist(), lobe["f0"]), w) for w in (i, r)]
        value = value + np.array(lobe["ground"]) / np.pi * ((1 - sent[0]) * (1 - sent[1]))[:, None]
    return value


def about_normal(w: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([c * w[:, 0] + s * w[:, 1], c * w[:, 1] - s * w[:, 0], w[:, 2]])


def slopes(name: str, s2: np.ndarray, cos: np.ndarray, area: float) -> np.ndarray:
    shape = 1 / (1 + s2) ** 2 if name == "ggx" else np.exp(-s2)
    return shape / (np.pi * area * cos**4)


def facets(name, masking, a, i, r) -> tuple[np.ndarray, np.ndarray]:
    """D G / (4 cos_i cos_r) and h.i."""
    h = i + r
    length = np.linalg.norm(h, axis=1)
    s2 = ((h[:, 0] / a[0]) ** 2 + (h[:, 1] / a[1]) ** 2) / h[:, 2] ** 2
    hidden = [smith(name, np.hypot(a[0] * w[:, 0], a[1] * w[:, 1]) / w[:, 2]) for w in (i, r)]
    g = 1 / (1 + hidden[0] + hidden[1])
    if masking == "separable":
        g = 1 / ((1 + hidden[0]) * (1 + hidden[1]))
    return slopes(name, s2, h[:, 2] / length, a[0] * a[1]) * g / (4 * i[:, 2] * r[:, 2]), length / 2


def smith(name: str, t: np.ndarray) -> np.ndarray:
    if name == "ggx":
        return (np.sqrt(1 + t**2) - 1) / 2
    x = 1 / np.maximum(t, 1e-9)
    return (np.exp(-(x**2)) / (x * np.sqrt(np.pi)) - erfc(x)) / 2


def fresnel(cos: np.ndarray, f0: float) -> np.ndarray:
    index = (1 + np.sqrt(f0)) / (1 - np.sqrt(f0))
    inside = np.sqrt(1 - (1 - cos**2) / index**2)
    s, p = (cos - index * inside) / (cos + index * inside), (index * cos - inside) / (index * cos + inside)
    return (s**2 + p**2) / 2


def albedo(coat: tuple, w: np.ndarray) -> np.ndarray:
    """E (n,) of directions in the frame of the roughnesses, each by its own quadrature."""
    turns = np.arctan2(w[:, 1], w[:, 0]) if coat[2] != coat[3] else np.zeros(len(w))
    return np.array([sent(coat, float(z), float(turn)) for z, turn in zip(w[:, 2], turns, strict=True)])


@lru_cache(maxsize=4096)
def sent(coat: tuple, cos: float, turn: float) -> float:
    """The integral of D G F / (4 cos_i cos_r) cos_r over the exit hemisphere, in panels that halve toward the mirror
    direction and the horizon."""
    name, masking, along, across, f0 = coat
    theta = np.arccos(cos)
    steps = 0.5 * np.pi * np.concatenate([[0.0], 0.5 ** np.arange(9)])
    polar, polar_weight = panels([theta - steps, theta + steps, 0.5 * np.pi - steps], 0.0, 0.5 * np.pi)
    half = along == across  # both sides of the plane of incidence are alike
    side, side_weight = panels(
        [2 * steps] if half else [-2 * steps, 2 * steps], 0.0 if half else -np.pi, np.pi
    )
    t, p = (grid.ravel() for grid in np.meshgrid(polar, side + turn + np.pi, indexing="ij"))
    r = np.column_stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
    light = [np.sin(theta) * np.cos(turn), np.sin(theta) * np.sin(turn), cos]
    value, cosine = facets(name, masking, np.array([along, across]), np.broadcast_to(light, r.shape), r)
    weight = np.outer(polar_weight, side_weight).ravel() * np.sin(t) * np.cos(t)
    return (2.0 if half else 1.0) * float(np.sum(value * fresnel(np.minimum(cosine, 1.0), f0) * weight))


def panels(bounds: list[np.ndarray], low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Eight Gauss nodes on each interval."""
    ends = np.unique(np.clip(np.concatenate([*bounds, [low, high]]), low, high))
    ends = ends[np.concatenate([[True], np.diff(ends) > 1e-9])]
    x, w = np.polynomial.legendre.leggauss(8)
    width = np.diff(ends)[:, None]
    return (ends[:-1, None] + width * (x + 1) / 2).ravel(), (width * w / 2).ravel()


def standard_error(path: Path, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
    """(n, c) of f, by changing each parameter of the file in turn."""
    file = json.loads(Path(path).read_text())
    count, modes = len(file["parameters"]), len(file["modes"])
    rows, columns = np.tril_indices(count)
    plain = f_of(path, incident, exit)
    slopes_of = np.empty((len(incident), count, len(file["channels"])))
    for p, name in enumerate(file["parameters"]):
        if p < modes:
            slopes_of[:, p] = mode_value(file["symmetry"], file["modes"][p], incident, exit)[:, None]
        else:
            _, place, *what = name.split()
            slopes_of[:, p] = change(file["lobes"][int(place)], " ".join(what), incident, exit)
    variance = np.empty_like(plain)
    for c, lower in enumerate(file["covariance"]["channels"]):
        whole = np.zeros((count, count))
        whole[rows, columns] = whole[columns, rows] = lower
        variance[:, c] = np.einsum("np,pq,nq->n", slopes_of[:, :, c], whole, slopes_of[:, :, c])
    beyond = file["beyond"]
    relative = beyond["scale"] ** 2 + sum(
        table(beyond[key], incident, exit) ** 2 for key in ("misfit", "unseen")
    )
    return np.sqrt(variance + plain**2 * np.reshape(relative, (-1, 1)))


def change(lobe: dict, what: str, i: np.ndarray, r: np.ndarray) -> np.ndarray:
    """(n, c) derivative of a lobe by one of its numbers."""
    ends = []
    for side in (-1, 1):
        other = json.loads(json.dumps(lobe))
        key, place = {"roughness along": ("roughness", 0), "roughness across": ("roughness", 1)}.get(
            what, (what, None)
        )
        step = 1e-3 * max(abs(float(np.max(lobe[key]))), 1e-2)
        if place is not None:
            other[key][place] += side * step
        elif isinstance(lobe[key], list):
            other[key] = [one + side * step for one in lobe[key]]
        else:
            other[key] += side * step
        ends.append(lobe_value(other, i, r))
    return (ends[1] - ends[0]) / (2 * step)


def table(given: dict, i: np.ndarray, r: np.ndarray) -> np.ndarray:
    """(n,) bilinear between the nodes, constant outside; 0 of an empty one."""
    if not given["relative"]:
        return np.zeros(len(i))
    values = np.array(given["relative"], float)
    across = i[:, 0] * r[:, 0] + i[:, 1] * r[:, 1]
    turn = np.arctan2(np.abs(i[:, 0] * r[:, 1] - i[:, 1] * r[:, 0]), across)
    weights = []
    for name, angle in (("theta_i", np.arccos(i[:, 2])), ("theta_r", np.arccos(r[:, 2])), ("dphi", turn)):
        nodes = np.array(given[name], float)
        weights.append(
            np.stack([np.interp(np.degrees(angle), nodes, unit) for unit in np.eye(len(nodes))], axis=1)
        )
    return np.einsum("na,nb,nc,abc->n", *weights, values.reshape([w.shape[1] for w in weights]))
