"""The room of one photo, from the scene and the photo's place in the plan."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from synthetic.brdf import make_brdf, read_brdf
from synthetic.pattern import print_of
from synthetic.plan import Lamp, Shot, exposure_factor
from synthetic.reflectance import Reflectance
from synthetic.scene import PatchScene, Scene
from synthetic.trace import World

CHANNELS = 3


def brdf_of(scene: Scene) -> Reflectance:
    """The scene's BRDF, from the library or a file. Raises InputError."""
    parameters = dict(scene.brdf)
    if "file" in parameters:
        path = Path(scene.folder) / str(parameters.pop("file"))
        return read_brdf(path, **{"select" if k == "where" else k: v for k, v in parameters.items()})
    return make_brdf(str(parameters.pop("model", "")), parameters, where=f"{scene.name}: brdf")


def world_of(scene: Scene, shot: Shot) -> World:
    """Everything that stands in the room when ``shot`` is taken."""
    board, empty = scene.board, np.zeros(CHANNELS)
    present = shot.offset is not None
    outlines, heights, is_sample, reflectance = sheets(scene, shot)
    return World(
        page=print_of(board.nominal() if board else None, scale=board.print_scale if board else 1.0),
        paper=empty + (board.paper if board else 0.0),
        ink=empty + (board.ink if board else 0.0),
        table=empty + (board.table if board else 0.0),
        table_radius=board.table_radius if board else 0.0,
        sphere=sphere(scene, shot),
        balls=np.array([[*b.center, b.radius, b.reflectance] for b in scene.mirror_ball if present]).reshape(
            -1, 5
        ),
        sheet_outline=outlines,
        sheet_height=heights,
        sheet_sample=is_sample,
        sheet_reflectance=reflectance,
        lamp=np.array([lamp_row(lamp) for lamp in shot.lamps]).reshape(-1, 5),
        intensity=np.array([lamp.intensity for lamp in shot.lamps]).reshape(-1, CHANNELS),
        ambient=ambient(scene) * np.ones(CHANNELS),
    )


def lamp_row(lamp: Lamp) -> list[float]:
    return [float(lamp.kind == "directional"), *lamp.place, lamp.radius]


def ambient(scene: Scene) -> float:
    """The room's radiance: a white facing it gives ``ambient`` times what the lamp gives."""
    sensor = scene.sensor
    return sensor.ambient * sensor.level / (0.9 * sensor.exposure_time * exposure_factor(scene))


def sphere(scene: Scene, shot: Shot) -> np.ndarray:
    if shot.offset is None or scene.sample.shape != "sphere":
        return np.zeros(4)
    return np.array([*(np.array(scene.sample.center) + shot.offset), scene.sample.radius])


def sheets(scene: Scene, shot: Shot) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Outlines (p, v, 2), heights (p,), which is the sample (p,), reflectances (p, c) of patches and flat sample."""
    if shot.offset is None:
        return np.zeros((0, 3, 2)), np.zeros(0), np.zeros(0, bool), np.zeros((0, CHANNELS))
    rows = [(np.array(p.outline, float), p.height, False, true_reflectance(p)) for p in scene.white_patch]
    if scene.sample.shape == "plane":
        outline = np.array(scene.sample.outline, float) + shot.offset[:2]
        rows.append((outline, scene.sample.height + shot.offset[2], True, np.zeros(CHANNELS)))
    corners = max((len(row[0]) for row in rows), default=3)
    outlines = [counter_clockwise(row[0], corners) for row in rows]
    return (
        np.array(outlines).reshape(-1, corners, 2),
        np.array([row[1] for row in rows], float),
        np.array([row[2] for row in rows], bool),
        np.array([row[3] for row in rows]).reshape(-1, CHANNELS),
    )


def true_reflectance(patch: PatchScene) -> np.ndarray:
    return np.zeros(CHANNELS) + np.array(patch.true_reflectance or patch.reflectance, float)


def counter_clockwise(outline: np.ndarray, corners: int) -> np.ndarray:
    x, y = outline.T
    if np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) < 0:
        outline = outline[::-1]
    return np.concatenate([outline, np.repeat(outline[-1:], corners - len(outline), axis=0)])
