"""Narrow gloss: how far f and the roughness are off, of balls and planes of roughness 0.03 to 0.1.

Each set is drawn by its seed: a gloss of GGX's or Beckmann's slopes, or of two slopes (seven tenths of the surface the
core, three tenths three times as rough), over a ground of any colour; lamps of 12 or 20 mm in radius; one exposure or
two. Half of a plane's lamps stand where the camera sees them mirrored, for else no photo shows the peak. A row is one
set: relative L2 of f below 70 degrees of the worst channel, and near the mirror direction; the roughness of the lobe
that is most of the peak over the true one; the error over half the stated interval::

    python -m benchmarks.narrow_gloss [--seeds N ...] [--roughness R ...] [--shapes ball plane] [--keep FOLDER]
"""

from __future__ import annotations

import argparse
import json
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from photogonio.compare.compare import Comparison
from photogonio.compare.reflectances import as_reflectance, load_known
from photogonio.evaluate.hard_cases import error_and_interval
from photogonio.evaluate.scenes import INNER, against
from photogonio.evaluate.truth import TRUTH
from photogonio.options import Options
from photogonio.pipeline import process
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.synthetic.scene.hard_cases import changed
from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.plan import camera_places, sample_center, spiral
from photogonio.synthetic.scene.scene import load_scene
from photogonio.synthetic.write.photoset import synthesize

ROUGHNESS = (0.03, 0.04, 0.05, 0.08, 0.1)
ASKED = (4.0, 3.0, 2.0, 1.5, 1.2)  # % of error
SLOPES = ("ggx", "beckmann", "two")
ELEVATION = (22.0, 82.0)  # degrees, of a moving camera
MISSED = 0.06  # of a lamp's direction, radians: how far from the mirror direction lamps of a plane are put
NEAR = np.radians(3.0)


@dataclass(frozen=True, slots=True)
class Drawn:
    """One set to be rendered."""

    scene: Scene
    slopes: str
    roughness: float
    lamp: float  # radius
    exposures: int


def drawn(shape: str, roughness: float, seed: int, folder: Path, width: int) -> Drawn:
    """A set; the file of its BRDF, where its slopes are not the renderer's own, in ``folder``."""
    rng = np.random.default_rng([seed, round(1000 * roughness), shape == "plane"])
    slopes, lamp, exposures = (
        str(rng.choice(SLOPES)),
        float(rng.choice([12.0, 20.0])),
        int(rng.integers(1, 3)),
    )
    ground = rng.uniform(0.05, 0.6, 3).round(3).tolist()
    count = 24 if shape == "plane" else int(rng.choice([12, 16, 20, 24]))
    scene = changed(
        load_scene("example"),
        camera={"size": (width, width * 2 // 3), "focal": 2.25 * width},
        lamp={"count": count, "radius": lamp},
        sensor={"level": 0.06} if exposures == 1 else {"level": 0.45, "brackets": (1.0, 0.1)},
    )
    if shape == "plane":
        moving = {"motion": "moving", "elevation": ELEVATION, "distance": (560.0, 660.0)}
        scene = changed(replace(scene, seed=seed), sample={"shape": "plane"}, camera=moving)
        scene = changed(scene, lamp={"places": _mirrored(scene, rng)})
    brdf: dict[str, object] = {"model": "plastic", "albedo": ground, "roughness": roughness}
    if slopes != "ggx":
        name = f"{shape}-{roughness}-{seed}.json"
        (folder / name).write_text(json.dumps(_file(slopes, roughness, ground)))
        brdf = {"file": name}
    name = f"{shape}-{roughness}-{seed}"
    scene = replace(scene, brdf=brdf, seed=seed, name=name, folder=str(folder))
    return Drawn(scene, slopes, roughness, lamp, exposures)


def _mirrored(scene: Scene, rng: np.random.Generator) -> tuple[tuple[float, ...], ...]:
    """Lamps of a plane, every second about where the camera of its photo sees it mirrored."""
    middle = sample_center(scene)
    camera = camera_places(scene) - middle
    count = len(camera)
    camera /= np.linalg.norm(camera, axis=1, keepdims=True)
    elsewhere = spiral(count, (12.0, 85.0))
    toward = np.where(np.arange(count)[:, None] % 2, elsewhere, camera * [-1.0, -1.0, 1.0])
    toward = toward + MISSED * rng.normal(size=toward.shape)
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    distance = rng.uniform(350.0, 500.0, count)[:, None]
    return tuple(tuple(one) for one in (middle + distance * toward).tolist())


def _file(slopes: str, roughness: float, ground: list[float]) -> dict[str, object]:
    """A coefficient file (docs/modes.md) of a gloss of index 1.5."""
    said = {"masking": "correlated", "fresnel": "dielectric", "f0": 0.04}
    albedo = [0.0, 0.0, 0.0]
    if slopes == "beckmann":
        coat = {"model": "coat", "distribution": "beckmann", "roughness": roughness, "ground": ground}
        lobes = [coat | said | {"weight": [1.0, 1.0, 1.0]}]
    else:
        albedo = [2.0 * one for one in ground]  # the Lambertian mode is 1 / (2 pi)
        parts = ((roughness, 0.7), (3.0 * roughness, 0.3))
        one = {"model": "mirror", "distribution": "ggx"} | said
        lobes = [one | {"roughness": alpha, "weight": [part] * 3} for alpha, part in parts]
    return {
        "format": "photogonio-brdf",
        "version": 2,
        "quantity": "brdf",
        "symmetry": "isotropic",
        "order": 0,
        "channels": ["R", "G", "B"],
        "modes": [[0, 0, 0]],
        "coefficients": [albedo],
        "lobes": lobes,
        "scale": "absolute",
    }


def near_mirror(found: Comparison) -> float:
    """Relative L2 of the pairs whose exit lies near the mirror direction, of the worst channel."""
    at = found.at
    near = np.einsum("ij,ij->i", at.incident * [-1.0, -1.0, 1.0], at.exit) > np.cos(NEAR)
    weight = (at.weight * at.cos_i * at.cos_r)[near, None]
    square = (weight * (found.a - found.b)[near] ** 2).sum(0) / (weight * found.b[near] ** 2).sum(0)
    return float(np.sqrt(square.max()))


def core(brdf: Brdf) -> float:
    """Roughness of the mirror lobe that is highest in the mirror direction; NaN: there is none."""
    lobes = [one for one in brdf.lobes if not one.peak]
    if not lobes:
        return np.nan
    return float(max(lobes, key=lambda one: float(np.max(one.f0 * one.weight)) / one.axes[0] ** 2).axes[0])


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="how far a narrow gloss is off")
    parser.add_argument("--seeds", nargs="+", type=int, default=[1])
    parser.add_argument("--roughness", nargs="+", type=float, default=ROUGHNESS)
    parser.add_argument("--shapes", nargs="+", choices=("ball", "plane"), default=("ball", "plane"))
    parser.add_argument("--width", type=int, default=780, help="of the photos, pixels")
    parser.add_argument("--keep", type=Path, help="folder in which sets are kept, and found again")
    parser.add_argument("--quick", action="store_true", help="one small set")
    args = parser.parse_args(argv)
    if args.quick:
        args.roughness, args.shapes, args.width = [0.1], ["ball"], 240
    print(f"{'set':16} slopes   lamp exposures  error %  near mirror %  roughness / true  of stated  asked %")
    with tempfile.TemporaryDirectory() as place:
        folder = args.keep or Path(place)
        folder.mkdir(parents=True, exist_ok=True)
        for seed in args.seeds:
            for shape in args.shapes:
                for roughness in args.roughness:
                    print(_row(drawn(shape, roughness, seed, folder, args.width), folder), flush=True)


def _row(one: Drawn, folder: Path) -> str:
    where = folder / one.scene.name
    if not (where / TRUTH).is_file():
        synthesize(one.scene, where, 1, foreign=as_reflectance)
    result, truth = process(where, None, Options(workers=1)), load_known(where / TRUTH)
    found = against(result.brdf, truth, INNER)
    error, stated = error_and_interval(result, truth)
    asked = dict(zip(ROUGHNESS, ASKED, strict=True)).get(one.roughness, np.nan)
    return (
        f"{one.scene.name:16} {one.slopes:8} {one.lamp:4.0f} {one.exposures:9d}  "
        f"{100 * found.measures['relative_l2'].max():7.2f}  {100 * near_mirror(found):13.2f}  "
        f"{core(result.brdf) / one.roughness:16.3f}  {error / stated:9.2f}  {asked:7.1f}"
    )


if __name__ == "__main__":
    main()
