"""Writes a scene as a photo set: manifest, photos, and the truth beside them."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import tomli_w

from photogonio.calib.geometry.camera import Camera
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import MANIFEST
from photogonio.synthetic.brdf.files import Foreign
from photogonio.synthetic.brdf.reflectance import Reflectance
from photogonio.synthetic.render.bounce import bounce_extra, exit_albedo, room_extra
from photogonio.synthetic.render.picture import Detail, render
from photogonio.synthetic.render.print import PrintedPage
from photogonio.synthetic.render.sensor import expose, exposure_time_of
from photogonio.synthetic.render.world import CHANNELS, ambient, brdf_of, page_of, world_of
from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.plan import Shot, camera_of, exposure_factor, plan
from photogonio.synthetic.write.manifest import manifest_of
from photogonio.synthetic.write.pictures import write_photo
from photogonio.synthetic.write.truth import copy_name, truth_of

TRUTH = "truth.json"
Progress = Callable[[int, int], None]  # photos done, photos in all


@dataclass(frozen=True, slots=True)
class Alike:
    """What is the same in all photos of a scene, and long to make."""

    page: PrintedPage
    albedo: tuple[np.ndarray, np.ndarray] | None  # of the sample in even light; None in a dark room

    @classmethod
    def of(cls, scene: Scene, brdf: Reflectance) -> Alike:
        return cls(page_of(scene), exit_albedo(brdf) if ambient(scene) > 0 else None)


def synthesize(
    scene: Scene,
    folder: str | Path,
    workers: int = 1,
    progress: Progress | None = None,
    *,
    foreign: Foreign | None = None,
) -> Path:
    """Renders ``scene`` into ``folder``: photoset.toml, photos, truth.json. Returns the folder.

    ``foreign`` reads BRDFs from files of other programs. The files are the same for any number of workers. An earlier
    set of ours is replaced; any other folder that is not empty is refused with InputError.
    """
    folder = Path(os.path.realpath(folder))  # a link's own place
    if folder.exists() and not (folder / TRUTH).is_file() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(folder, "is there already and is not a rendered set; choose another place")
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".photogonio-") as draft:
        made = Path(draft) / "set"
        made.mkdir()
        write_set(scene, made, workers, progress or (lambda done, total: None), foreign)
        if folder.exists():
            shutil.rmtree(folder)
        os.replace(made, folder)
    return folder


def write_set(
    scene: Scene, folder: Path, workers: int, progress: Progress, foreign: Foreign | None = None
) -> None:
    camera, brdf, shots = camera_of(scene), brdf_of(scene, foreign), plan(scene)
    if "file" in scene.brdf:
        given = Path(scene.folder) / str(scene.brdf["file"])
        (shutil.copytree if given.is_dir() else shutil.copyfile)(given, folder / copy_name(scene))
    for shot in shots:
        (folder / shot.file).parent.mkdir(exist_ok=True)
    series: dict[int, list[Shot]] = {}  # exposures of one view share one rendering
    for shot in shots:
        series.setdefault(shot.view, []).append(shot)
    taken: dict[str, Shot] = {}  # by file: as long as the camera exposed them
    alike = Alike.of(scene, brdf)
    with ThreadPoolExecutor(workers) as pool:
        for some in pool.map(lambda view: take(scene, camera, brdf, alike, view, folder), series.values()):
            taken |= {shot.file: shot for shot in some}
            progress(len(taken), len(shots))
    shots = tuple(taken[shot.file] for shot in shots)
    manifest = manifest_of(scene, camera, shots)
    (folder / MANIFEST).write_text(tomli_w.dumps(manifest), encoding="utf-8")
    (folder / TRUTH).write_text(json.dumps(truth_of(scene, camera, brdf, shots)), encoding="utf-8")


def take(
    scene: Scene, camera: Camera, brdf: Reflectance, alike: Alike, shots: list[Shot], folder: Path
) -> list[Shot]:
    """Renders one view and writes its exposures; returns them with their times."""
    radiance = view_radiance(scene, camera, brdf, shots[0], alike)
    factor, taken = exposure_factor(scene), []
    for n, shot in enumerate(shots):
        seconds = shot.exposure_time
        if shot.role not in ("dark", "flat", "ambient"):
            seconds = exposure_time_of(scene, camera, radiance, seconds, shot.view, factor)
        shot = replace(shot, exposure_time=seconds)
        photo = expose(scene, camera, radiance, seconds, factor, (shot.view, n))
        write_photo(folder / shot.file, photo, scene.sensor, shot)
        taken.append(shot)
    return taken


def view_radiance(
    scene: Scene, camera: Camera, brdf: Reflectance, shot: Shot, alike: Alike | None = None
) -> np.ndarray:
    """Radiance (h, w, c) of a view, before lens and sensor."""
    width, height = camera.size
    if shot.role in ("dark", "flat"):
        even = 0.0 if shot.role == "dark" else 0.7 / (shot.exposure_time * exposure_factor(scene))
        return np.full((height, width, CHANNELS), even)
    alike, asked = alike or Alike.of(scene, brdf), scene.render
    world, detail = world_of(scene, shot, alike.page), Detail(asked.sample, asked.near, asked.edge)
    extra = [room_extra(world, brdf, alike.albedo)]
    if scene.render.bounce:
        extra.append(bounce_extra(world, brdf, shot.pose.center))
    return render(world, brdf, camera, shot.pose, extra=tuple(e for e in extra if e), detail=detail)
