"""What Mitsuba makes of an exported ``measured`` file: light sent out as it samples it, and a ball as it renders it.

Of each of the twelve materials of :mod:`benchmarks.consumers`: the directional albedo up to 88 degrees as the mean
weight of a grid of samples, over the source's, where it is farthest from 1; and a ball under one distant lamp, rendered
with several rays a pixel, against f at the same rays: rms over our own picture's, Delta E ITP (ITU-R BT.2124), mean and
95 % quantile::

    python -m benchmarks.mitsuba_renders [--materials ...] [--size 48] [--samples 64]
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.consumers import materials
from photogonio.compare.appearance import difference_itp
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.export.formats import find_format
from photogonio.reconstruct.export.loss import ANGLES, TURNS

LAMP = np.array([0.6, -0.7, 0.5])  # toward it; the camera is on the negative y axis, the ball's pole is up
DISTANCE, RAYS = 4.0, 6  # rays a side of a pixel
WHITE_QUANTILE = 0.98  # of our picture: white, as in compare


def sampled_albedo(material, theta: float, turn: float, side: int) -> np.ndarray:
    """(3,) mean weight of side^2 samples of light from there, degrees."""
    import mitsuba as mi

    point, context = mi.SurfaceInteraction3f(), mi.BSDFContext()
    theta, turn = np.radians([theta, turn])
    point.wi = mi.Vector3f(np.sin(theta) * np.cos(turn), np.sin(theta) * np.sin(turn), np.cos(theta))
    at = (np.arange(side) + 0.5) / side
    found = [np.array(material.sample(context, point, 0.5, mi.Point2f(u, v))[1]) for u in at for v in at]
    return np.mean(found, axis=0)


def albedo_ratios(material, brdf: Brdf, side: int) -> np.ndarray:
    """(angles, 3) Mitsuba's over the source's, of the turn where it is farthest from 1."""
    turns = TURNS if brdf.turning else (0.0,)
    found = []
    for theta in ANGLES:
        ratios = [
            sampled_albedo(material, theta, turn, side) / brdf.directional_albedo(*np.radians([theta, turn]))
            for turn in turns
        ]
        found.append(max(ratios, key=lambda one: np.abs(one - 1.0).max()))
    return np.array(found)


def rendered(path: Path, size: int) -> np.ndarray:
    """(size, size, 3) Mitsuba's picture of a ball, with an even grid of rays in each pixel."""
    import mitsuba as mi

    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "bsdf_samples": 0, "emitter_samples": 1},
            "ball": {"type": "sphere", "material": {"type": "measured", "filename": str(path)}},
            "lamp": {"type": "directional", "direction": (-LAMP).tolist(), "irradiance": 1.0},
        }
    )
    toward = _toward(size)
    integrator, picture = scene.integrator(), np.zeros((len(toward), 3))
    sampler = mi.load_dict({"type": "independent"})
    for k, (x, z) in enumerate(toward):
        ray = mi.RayDifferential3f(mi.Ray3f(mi.Point3f(x, -DISTANCE, z), mi.Vector3f(0.0, 1.0, 0.0)))
        picture[k] = np.array(integrator.sample(scene, sampler, ray)[0])
    return _pixels(picture, size)


def shaded(brdf: Brdf, size: int) -> np.ndarray:
    """The same of the BRDF itself, whose azimuths are from the ball's circles of latitude, as Mitsuba's are."""
    x, z = _toward(size).T
    depth = 1.0 - x**2 - z**2
    inside = depth > 0.0
    normal = np.column_stack([x, -np.sqrt(np.maximum(depth, 0.0)), z])[inside]
    along = np.column_stack([-normal[:, 1], normal[:, 0], 0.0 * normal[:, 0]])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    frame = np.stack([along, np.cross(normal, along), normal], axis=1)
    light, view = frame @ (LAMP / np.linalg.norm(LAMP)), frame @ np.array([0.0, -1.0, 0.0])
    lit = (light[:, 2] > 0.0) & (view[:, 2] > 0.0)
    picture, some = np.zeros((len(inside), 3)), np.flatnonzero(inside)[lit]
    picture[some] = np.maximum(brdf(light[lit], view[lit]), 0.0) * light[lit, 2:]
    return _pixels(picture, size)


def _toward(size: int) -> np.ndarray:
    """(rays, 2) where rays meet the plane of the picture, pixel by pixel."""
    at = (np.arange(size * RAYS) + 0.5) / (size * RAYS) * 2.0 - 1.0
    return np.stack(np.meshgrid(at, at), axis=-1).reshape(-1, 2)


def _pixels(rays: np.ndarray, size: int) -> np.ndarray:
    return rays.reshape(size, RAYS, size, RAYS, 3).mean(axis=(1, 3))


def measure(brdf: Brdf, size: int, side: int) -> dict[str, float]:
    """Per cent and Delta E."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.bsdf"
        find_format("mitsuba").write(brdf, path)
        ratio = albedo_ratios(mi.load_dict({"type": "measured", "filename": str(path)}), brdf, side)
        theirs, ours = rendered(path, size), shaded(brdf, size)
    white = float(np.quantile(ours[ours.max(axis=-1) > 0.0], WHITE_QUANTILE))
    apart = difference_itp(theirs / white, ours / white)[ours.max(axis=-1) > 0.0]
    off = ratio[np.unravel_index(np.abs(ratio - 1.0).argmax(), ratio.shape)] - 1.0
    rms = np.sqrt(((theirs - ours) ** 2).mean() / (ours**2).mean())
    found = {"albedo": 100.0 * off, "rms": 100.0 * rms, "mean": apart.mean(), "95": np.quantile(apart, 0.95)}
    return {name: float(value) for name, value in found.items()}


def main(arguments: list[str] | None = None) -> None:
    known = materials()
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--materials", nargs="+", choices=tuple(known), default=tuple(known))
    parser.add_argument("--size", type=int, default=48, help="pixels across the ball")
    parser.add_argument("--samples", type=int, default=64, help="a side of the grid of samples")
    options = parser.parse_args(arguments)
    print("| material | albedo, % | ball, rms % | Delta E ITP | 95 % |")
    print("|---|---|---|---|---|")
    for name in options.materials:
        one = measure(known[name], options.size, options.samples)
        row = f"| {name} | {one['albedo']:+.2f} | {one['rms']:.2f} "
        print(f"{row}| {one['mean']:.2f} | {one['95']:.2f} |", flush=True)


if __name__ == "__main__":
    main()
