"""The room of one photo, from the scene and the photo's place in the plan."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.synthetic.brdf.files import Foreign, read_brdf
from photogonio.synthetic.brdf.library import make_brdf
from photogonio.synthetic.brdf.reflectance import Reflectance
from photogonio.synthetic.render.print import PrintedPage, print_of
from photogonio.synthetic.render.room import NO_SHADES, World
from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.parts import PatchScene
from photogonio.synthetic.scene.plan import PlannedLamp, Shot, exposure_factor

CHANNELS = 3


def brdf_of(scene: Scene, foreign: Foreign | None = None) -> Reflectance:
    """The scene's BRDF, from the library or a file; ``foreign`` reads those that are not ours. Raises InputError."""
    where = f"{scene.name}: brdf"
    return brdf_from(scene.brdf, Path(scene.folder), where, foreign)


def brdf_from(
    described: Mapping[str, object], folder: Path, where: object, foreign: Foreign | None = None
) -> Reflectance:
    """A BRDF from `model` and its parameters, or from `file` in ``folder`` (with `columns` and `where` for a table).

    Raises InputError.
    """
    if "file" in described:
        found = brdf_of_file(described, folder, where, foreign)
    else:
        parameters: dict[str, Any] = dict(described)
        found = make_brdf(str(parameters.pop("model", "")), parameters, where=where)
    count = found(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.6, 0.8])).shape[-1]
    if count not in (1, CHANNELS):
        raise InputError(where, f"has {count} channels; a picture takes one, for grey, or {CHANNELS}")
    return found


def brdf_of_file(
    described: Mapping[str, object], folder: Path, where: object, foreign: Foreign | None = None
) -> Reflectance:
    parameters: dict[str, Any] = dict(described)
    path = folder / str(parameters.pop("file"))
    for key, value in parameters.items():
        if key not in ("columns", "where"):
            raise InputError(where, f"unknown key {key!r}; a file takes columns and where")
        if not isinstance(value, Mapping):
            raise InputError(where, f"{key}: expected a table, got {value!r}")
    told = {"columns": parameters.get("columns"), "select": parameters.get("where")}
    return read_brdf(path, **told, foreign=foreign)


def page_of(scene: Scene) -> PrintedPage:
    """The scene's printed board, as large as it was printed; empty if it has none."""
    board = scene.board
    return print_of(board.nominal() if board else None, scale=board.print_scale if board else 1.0)


def world_of(scene: Scene, shot: Shot, page: PrintedPage | None = None) -> World:
    """Everything that stands in the room when ``shot`` is taken; ``page`` is that of :func:`page_of`, if it was made
    before."""
    board = scene.board
    outlines, heights, sample_sheet, reflectance = sheets(scene, shot)
    plain = (board.ink, board.paper, board.table, board.ink) if board else (0.0, 0.0, 0.0, 0.0)
    page = page_of(scene) if page is None else page
    half = 0.5 * float(page.extent[2] - page.extent[0])
    return World(
        page=page,
        colors=np.concatenate([np.outer(plain, np.ones(CHANNELS)), reflectance]),
        table_radius=board.table_radius if board else 0.0,
        balls=balls(scene, shot),
        outlines=outlines,
        heights=heights,
        sample_sheet=sample_sheet,
        lamps=np.array([lamp_row(lamp) for lamp in shot.lamps]).reshape(-1, 5),
        intensity=np.array([lamp.intensity for lamp in shot.lamps]).reshape(-1, CHANNELS),
        ambient=ambient(scene) * np.ones(CHANNELS),
        shades=shades(scene, shot),
        curl=board.curl / half**2 if board and half > 0 else 0.0,
    )


def shades(scene: Scene, shot: Shot) -> np.ndarray:
    """Cones (k, 5) that shades leave to the shot's lamps, zeros where a lamp is bare; (0, 5): none has any."""
    shade = scene.lamp.shade
    if shade is None:
        return NO_SHADES
    rows = np.zeros((len(shot.lamps), 5))
    for row, lamp in zip(rows, shot.lamps, strict=True):
        if lamp.shaded:
            axis = np.array(shade.aim) - lamp.place
            row[:3] = axis / np.linalg.norm(axis)
            row[3:] = np.radians([shade.half_angle, shade.rim])
    return rows


def lamp_row(lamp: PlannedLamp) -> list[float]:
    return [float(lamp.kind == "directional"), *lamp.place, lamp.radius]


def ambient(scene: Scene) -> float:
    """The room's radiance: a white facing it gives ``ambient`` times what the lamp gives."""
    sensor = scene.sensor
    return sensor.ambient * sensor.level / (0.9 * sensor.exposure_time * exposure_factor(scene))


def balls(scene: Scene, shot: Shot) -> np.ndarray:
    """The sample (a row of zeros where it is no ball or not there) and the mirror balls, (1 + n, 5)."""
    if shot.offset is None:
        return np.zeros((1, 5))
    rows = [np.zeros(5)]
    if scene.sample.shape == "sphere":
        rows[0] = np.array([*(np.array(scene.sample.center) + shot.offset), scene.sample.radius, 0.0])
    return np.stack(rows + [np.array([*b.center, b.radius, b.reflectance]) for b in scene.mirror_ball])


def sheets(scene: Scene, shot: Shot) -> tuple[np.ndarray, np.ndarray, int, np.ndarray]:
    """Outlines (p, v, 2), heights (p,), which is the sample or -1, reflectances (p, c)."""
    if shot.offset is None:
        return np.zeros((0, 3, 2)), np.zeros(0), -1, np.zeros((0, CHANNELS))
    patches = scene.white_patch + scene.grey_patch
    rows = [(np.array(p.outline, float), p.height, true_reflectance(p)) for p in patches]
    flat = scene.sample.shape == "plane"
    if flat:
        outline = np.array(scene.sample.outline, float) + shot.offset[:2]
        rows.append((outline, scene.sample.height + shot.offset[2], np.zeros(CHANNELS)))
    corners = max((len(row[0]) for row in rows), default=3)
    outlines = [counter_clockwise(row[0], corners) for row in rows]
    return (
        np.array(outlines).reshape(-1, corners, 2),
        np.array([row[1] for row in rows], float),
        len(rows) - 1 if flat else -1,
        np.array([row[2] for row in rows]).reshape(-1, CHANNELS),
    )


def true_reflectance(patch: PatchScene) -> np.ndarray:
    return np.zeros(CHANNELS) + np.array(patch.true_reflectance or patch.reflectance, float)


def counter_clockwise(outline: np.ndarray, corners: int) -> np.ndarray:
    x, y = outline.T
    if np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) < 0:
        outline = outline[::-1]
    return np.concatenate([outline, np.repeat(outline[-1:], corners - len(outline), axis=0)])
