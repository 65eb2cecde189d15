"""Photo sets that another renderer traced: errors of f, and whether the stated intervals hold.

Mitsuba renders the room that the scene ``example`` lays out (board, table, mirror balls, white patch, lamp of a finite
size; light bounces as often as it likes), with surfaces of its own: what is true is what its materials answer. Only
the plan, the sensor's noise and the manifest are ours. Materials and lamps are drawn by the seed::

    python -m benchmarks.traced [--sets 12] [--seed 1] [--size 360] [--samples 64] [--workers 2] [--keep FOLDER]

Needs ``pip install 'photogonio[consumers]'``.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import tomli_w

from benchmarks.far_lamps import changed, smaller
from benchmarks.intervals import Score, of_result, table_of
from photogonio.calib.geometry.camera import Camera
from photogonio.capture.photoset import MANIFEST, CharucoBoard
from photogonio.evaluate.scenes import spread_over_processes
from photogonio.options import Options
from photogonio.pipeline import process
from photogonio.reconstruct.brdf.brdf import Brdf, load_brdf
from photogonio.report.trust import faults_of
from photogonio.synthetic.brdf.library import angle_grid
from photogonio.synthetic.render.print import charuco_layout, dictionary
from photogonio.synthetic.render.sensor import expose, exposure_time_of
from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.plan import Shot, camera_of, exposure_factor, plan
from photogonio.synthetic.scene.scene import load_scene
from photogonio.synthetic.write.manifest import manifest_of
from photogonio.synthetic.write.pictures import write_photo

DOTS = 28  # of the print's picture a millimetre: squares of 20 and cells of 15/7 mm are whole numbers of them
DEPTH = 6  # bounces
MIRROR_RAYS = 4096  # of a pixel of a mirror ball
LIMITS = np.radians([70.0, 85.0])
Material = dict[str, object]


def materials(rng: np.random.Generator) -> dict[str, Callable[[], Material]]:
    """What Mitsuba calls each, drawn anew."""

    def colour(low: float = 0.05, high: float = 0.8) -> Material:
        return {"type": "rgb", "value": rng.uniform(low, high, 3).tolist()}

    def plastic(alpha: float, kind: str = "ggx") -> Material:
        return {
            "type": "roughplastic",
            "alpha": alpha,
            "distribution": kind,
            "int_ior": rng.uniform(1.4, 1.6),
            "diffuse_reflectance": colour(0.05, 0.6),
            "nonlinear": bool(rng.integers(2)),
        }

    def metal(alpha: float, kind: str) -> Material:
        name = str(rng.choice(["Al", "Au", "Cu", "Cr"]))
        return {"type": "roughconductor", "material": name, "alpha": alpha, "distribution": kind}

    def principled(**told: float) -> Material:
        return {"type": "principled", "base_color": colour()} | told

    return {
        "diffuse": lambda: {"type": "diffuse", "reflectance": colour()},
        "plastic, rough": lambda: plastic(rng.uniform(0.25, 0.45)),
        "plastic, Beckmann": lambda: plastic(rng.uniform(0.15, 0.3), "beckmann"),
        "plastic, glossy": lambda: plastic(rng.uniform(0.07, 0.12)),
        "metal, rough": lambda: metal(rng.uniform(0.3, 0.45), "ggx"),
        "metal, Beckmann": lambda: metal(rng.uniform(0.15, 0.3), "beckmann"),
        "principled, satin": lambda: principled(
            roughness=rng.uniform(0.4, 0.7), specular=rng.uniform(0.3, 0.8)
        ),
        "principled, cloth": lambda: principled(roughness=0.8, specular=0.1, sheen=rng.uniform(0.3, 1.0)),
        "principled, coat": lambda: principled(
            roughness=0.6,
            specular=0.2,
            clearcoat=rng.uniform(0.3, 1.0),
            clearcoat_gloss=rng.uniform(0.2, 0.7),
        ),
        "principled, metallic": lambda: principled(
            roughness=rng.uniform(0.35, 0.6), metallic=rng.uniform(0.3, 1.0)
        ),
    }


@dataclass(frozen=True, slots=True)
class Traced:
    """A set before it is traced."""

    name: str
    material: Material
    scene: Scene
    samples: int


def drawn(number: int, seed: int, size: int, samples: int) -> Traced:
    """The ``number``-th set: kinds of material in turn, every fourth flat under a moving camera."""
    rng = np.random.default_rng((seed, number))
    kinds = materials(rng)
    kind = list(kinds)[number % len(kinds)]
    shape = "plane" if number % 4 == 3 else "sphere"
    base = "plastic-plane" if shape == "plane" else "example"
    scene = smaller(load_scene(base), size, int(rng.integers(10, 15)))
    lamp = {"radius": float(rng.uniform(4.0, 10.0)), "distance": (float(rng.uniform(300, 400)), 500.0)}
    camera = {"distortion": (0.0, 0.0, 0.0, 0.0, 0.0), "given": False, "calibration": 6}
    scene = changed(scene, lamp=lamp, camera=camera)
    name = f"{kind}, {'flat' if shape == 'plane' else 'ball'}"
    return Traced(
        name, kinds[kind](), replace(scene, name=f"traced-{number}", seed=100 * seed + number), samples
    )


def print_picture(board: CharucoBoard, paper: float, ink: float) -> np.ndarray:
    """(rows, columns) reflectance of the printed board, the page's top row first."""
    marks = dictionary(board.dictionary)
    corners, ids, size = charuco_layout(board, marks)
    columns, rows = board.squares
    square = round(board.square_length * DOTS)
    x, y = np.arange(columns * square) // square, np.arange(rows * square) // square
    white = (x[None, :] + y[:, None]) % 2 == 1
    for quad, number in zip(corners, ids, strict=True):
        left, top = round(quad[0, 0] * DOTS), round((size[1] - quad[0, 1]) * DOTS)
        side = round(board.marker_length * DOTS)
        bits = cv2.aruco.generateImageMarker(marks, int(number), marks.markerSize + 2) > 127
        cell = side // len(bits)
        white[top : top + side, left : left + side] = np.kron(bits, np.ones((cell, cell), bool))
    return np.where(white, paper, ink).astype(np.float32)


def room(one: Traced, shot: Shot, page: object) -> dict[str, object]:
    """Mitsuba's scene of a shot, without its camera."""
    import mitsuba as mi

    scene, move = one.scene, mi.ScalarTransform4f()
    board = scene.board
    assert board is not None and board.squares is not None and board.square_length is not None
    half = 0.5 * board.square_length * np.array(board.squares)
    found: dict[str, object] = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": DEPTH, "hide_emitters": False},
        "table": {
            "type": "disk",
            "to_world": move.translate([*half, -0.02]).scale(board.table_radius),
            "bsdf": {"type": "twosided", "bsdf": _grey(board.table)},
        },
        "print": {
            "type": "rectangle",
            "to_world": move.translate([*half, 0.0]).scale([*half, 1.0]),
            "bsdf": {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": page}},
        },
    }
    for k, lamp in enumerate(shot.lamps):
        glow = (lamp.intensity / (np.pi * lamp.radius**2)).tolist()
        found[f"lamp{k}"] = {
            "type": "sphere",
            "center": lamp.place.tolist(),
            "radius": lamp.radius,
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": glow}},
        }
    if shot.offset is None:
        return found
    for k, ball in enumerate(scene.mirror_ball):
        shine = {"type": "conductor", "material": "none", "specular_reflectance": _flat(ball.reflectance)}
        found[f"ball{k}"] = {
            "type": "sphere",
            "center": list(ball.center),
            "radius": ball.radius,
            "bsdf": shine,
        }
    for k, patch in enumerate(scene.white_patch):
        found[f"patch{k}"] = _sheet(np.array(patch.outline), patch.height, _grey(float(patch.reflectance[0])))
    if scene.sample.shape == "sphere":
        center = (np.array(scene.sample.center) + shot.offset).tolist()
        found["sample"] = {
            "type": "sphere",
            "center": center,
            "radius": scene.sample.radius,
            "bsdf": one.material,
        }
    else:
        outline = np.array(scene.sample.outline) + shot.offset[:2]
        found["sample"] = _sheet(outline, scene.sample.height + shot.offset[2], one.material)
    return found


def _flat(value: float) -> Material:
    return {"type": "spectrum", "value": value}


def _grey(value: float) -> Material:
    return {"type": "diffuse", "reflectance": _flat(value)}


def _sheet(outline: np.ndarray, height: float, bsdf: Material) -> dict[str, object]:
    """A rectangle whose sides are along x and y."""
    import mitsuba as mi

    low, high = outline.min(axis=0), outline.max(axis=0)
    place = (
        mi.ScalarTransform4f().translate([*(0.5 * (low + high)), height]).scale([*(0.5 * (high - low)), 1.0])
    )
    return {"type": "rectangle", "to_world": place, "bsdf": {"type": "twosided", "bsdf": bsdf}}


def sensor_of(camera: Camera, shot: Shot, samples: int, seed: int) -> dict[str, object]:
    """Mitsuba's pinhole, whose x points left and y up, with pixels that average their area."""
    import mitsuba as mi

    width, height = camera.size
    focal, middle = camera.matrix[0, 0], camera.matrix[:2, 2]
    placed = np.eye(4)
    placed[:3, :3] = shot.pose.rotation.T @ np.diag([-1.0, -1.0, 1.0])
    placed[:3, 3] = shot.pose.center
    shift = (0.5 * (np.array(camera.size) - 1.0) - middle) / camera.size  # to the left, and up
    return {
        "type": "perspective",
        "to_world": mi.ScalarTransform4f(placed),
        "fov_axis": "x",
        "fov": float(np.degrees(2.0 * np.arctan(0.5 * width / focal))),
        "principal_point_offset_x": float(shift[0]),
        "principal_point_offset_y": float(shift[1]),
        "near_clip": 1.0,
        "far_clip": 1e5,
        "film": {
            "type": "hdrfilm",
            "width": width,
            "height": height,
            "rfilter": {"type": "box"},
            "component_format": "float32",
        },
        "sampler": {"type": "multijitter", "sample_count": samples, "seed": seed},
    }


def picture_of(one: Traced, camera: Camera, shot: Shot, page: object) -> np.ndarray:
    """(h, w, 3) radiance; the mirror balls, in which the lamp is smaller than a pixel, with many more rays."""
    what, seed = room(one, shot, page), one.scene.seed * 1000 + shot.view
    radiance = _rendered(what, sensor_of(camera, shot, one.samples, seed), seed)
    if shot.offset is None:
        return radiance
    for k, ball in enumerate(one.scene.mirror_ball):
        middle = shot.pose.apply(np.array(ball.center, float))
        at = (camera.matrix @ (middle / middle[2]))[:2]
        reach = 1.3 * camera.matrix[0, 0] * ball.radius / middle[2] + 2.0
        low = np.clip(np.floor(at - reach), 0, camera.size).astype(int)
        high = np.clip(np.ceil(at + reach) + 1, 0, camera.size).astype(int)
        if (high - low < 2).any():
            continue
        sensor = sensor_of(camera, shot, MIRROR_RAYS, seed + k + 1)
        names = ("crop_offset_x", "crop_offset_y", "crop_width", "crop_height")
        sensor["film"] |= dict(zip(names, (*low.tolist(), *(high - low).tolist()), strict=True))
        radiance[low[1] : high[1], low[0] : high[0]] = _rendered(what, sensor, seed + k + 1)
    return radiance


def _rendered(what: dict[str, object], sensor: dict[str, object], seed: int) -> np.ndarray:
    import mitsuba as mi

    return np.array(mi.render(mi.load_dict(what | {"sensor": sensor}), seed=seed), float)[..., :3]


def truth(material: Material) -> tuple[np.ndarray, np.ndarray]:
    """Angles (n, 3), radians, and f (n, 3) as Mitsuba answers."""
    import mitsuba as mi

    angles = angle_grid()
    surface, context = mi.load_dict(material), mi.BSDFContext()
    point = mi.SurfaceInteraction3f()
    found = np.empty((len(angles), 3))
    for k, (theta_i, theta_r, dphi) in enumerate(angles):
        point.wi = mi.Vector3f(np.sin(theta_i), 0.0, np.cos(theta_i))
        toward = np.sin(theta_r) * np.array([np.cos(dphi), np.sin(dphi)])
        found[k] = np.array(surface.eval(context, point, mi.Vector3f(*toward, np.cos(theta_r))))
    return angles, found / np.cos(angles[:, 1:2])


def trace(one: Traced, folder: Path) -> None:
    """Writes the photo set, and ``truth.npz`` beside its manifest."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    scene, camera = one.scene, camera_of(one.scene)
    board = scene.board
    assert board is not None
    nominal = board.nominal()
    assert isinstance(nominal, CharucoBoard)
    picture = print_picture(nominal, board.paper, board.ink)
    page = {
        "type": "bitmap",
        "bitmap": mi.Bitmap(np.ascontiguousarray(picture[::-1, :, None])),  # its first row is at v = 0
        "filter_type": "nearest",
        "raw": True,
        "wrap_mode": "clamp",
    }
    factor, taken = exposure_factor(scene), []
    for shot in plan(scene):
        radiance = picture_of(one, camera, shot, page)
        seconds = exposure_time_of(scene, camera, radiance, shot.exposure_time, shot.view, factor)
        shot = replace(shot, exposure_time=seconds)
        (folder / shot.file).parent.mkdir(exist_ok=True)
        write_photo(
            folder / shot.file,
            expose(scene, camera, radiance, seconds, factor, (shot.view, 0)),
            scene.sensor,
            shot,
        )
        taken.append(shot)
    (folder / MANIFEST).write_text(tomli_w.dumps(manifest_of(scene, camera, tuple(taken))), encoding="utf-8")
    angles, f = truth(one.material)
    np.savez(folder / "truth.npz", grid=angles, brdf=f)
    (folder / "material.json").write_text(json.dumps(one.material, indent=1), encoding="utf-8")


def judge(one: Traced, keep: Path | None = None) -> tuple[Score, np.ndarray, tuple[str, ...]]:
    """Score, relative L2 (2,) to 70 and 85 degrees of the worst channel, and what calls it not to be trusted."""
    with nullcontext(str(keep)) if keep else tempfile.TemporaryDirectory() as place:
        folder, out = Path(place) / one.scene.name, Path(place) / f"{one.scene.name}-result"
        if not (folder / "truth.npz").is_file():
            folder.mkdir(parents=True, exist_ok=True)
            trace(one, folder)
        result = process(folder, out, Options(workers=1))
        score = replace(of_result(out, folder / "truth.npz"), kind=one.name)
        errors = errors_of(load_brdf(out / "coefficients.json"), folder / "truth.npz")
        return score, errors, tuple(fault.code for fault in faults_of(result))


def errors_of(brdf: Brdf, path: Path) -> np.ndarray:
    """(2,) weighted as in compare."""
    with np.load(path) as file:
        angles, true = file["grid"], file["brdf"]
    found = brdf.evaluate(angles[:, 0], 0.0, angles[:, 1], angles[:, 2])
    weight = (np.sin(2.0 * angles[:, 0]) * np.sin(2.0 * angles[:, 1]))[:, None]
    rows = []
    for most in LIMITS:
        some = (angles[:, :2] < most).all(axis=1)
        off = np.sum((weight * (found - true) ** 2)[some], axis=0) / np.sum((weight * true**2)[some], axis=0)
        rows.append(np.sqrt(off).max())
    return np.array(rows)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sets", type=int, default=12)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--size", type=int, default=360, help="pixels across")
    parser.add_argument("--samples", type=int, default=64, help="rays a pixel, a square number")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument(
        "--keep", type=Path, help="sets and results are kept there, and sets found there are used"
    )
    asked = parser.parse_args(arguments)
    sets = [drawn(k, asked.seed, asked.size, asked.samples) for k in range(asked.sets)]
    scores, errors = [], []
    judged = partial(judge, keep=asked.keep)
    for one, (score, error, faults) in zip(
        sets, spread_over_processes(judged, sets, asked.workers), strict=True
    ):
        scores.append(score)
        errors.append(error)
        print(
            f"{one.name:28} {100 * error[0]:6.2f} {100 * error[1]:6.2f} %  held {100 * score.from_file:5.1f}, "
            f"peaks {100 * score.at_peaks:5.1f} {' '.join(faults)}",
            flush=True,
        )
    inner, outer = 100 * np.array(errors).T
    print(f"error to 70 degrees: median {np.median(inner):.2f}, most {inner.max():.2f} %")
    print(f"to 85 over to 70: median {np.median(outer / inner):.2f}, most {np.max(outer / inner):.2f}")
    print(table_of(scores, ("all",)))


if __name__ == "__main__":
    main()
