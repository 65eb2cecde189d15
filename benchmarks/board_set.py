"""A whole set as a user takes it, large and cheap: rendered small, enlarged, with noise at full size.

A satin ball on a board between two mirror balls and a white patch, a still camera, photos of the bare board. Only
DIFFERENT lamps are rendered; more photos repeat them under other names.
"""

from __future__ import annotations

import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import tomli_w

from benchmarks.end_to_end import DIFFERENT, copied, write_picture
from photogonio.calib.geometry.camera import Camera
from photogonio.capture.files.images import read_image
from photogonio.capture.photoset import MANIFEST
from photogonio.reconstruct.modes.parallel import cores
from photogonio.synthetic.render.sensor import expose
from photogonio.synthetic.render.world import brdf_of
from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.plan import Shot, camera_of, exposure_factor, plan
from photogonio.synthetic.scene.scene import load_scene
from photogonio.synthetic.write.manifest import manifest_of
from photogonio.synthetic.write.photoset import view_radiance

RENDERED = 900  # pixels of width, about, that are rendered
FULL = 65535.0


def board_scene(megapixels: float, boards: int) -> Scene:
    """The example scene, before a camera of so many megapixels."""
    scene = load_scene("example")
    across = max(1, round(np.sqrt(megapixels * 1.5e6) / RENDERED))  # how much renders are enlarged
    width = across * 12 * round(np.sqrt(megapixels * 1.5e6) / across / 12)
    camera = replace(
        scene.camera,
        size=(width, width * 2 // 3),
        focal=scene.camera.focal * width / scene.camera.size[0],
        calibration=boards,
    )
    lamp = replace(scene.lamp, count=DIFFERENT)
    return replace(
        scene, camera=camera, lamp=lamp, render=replace(scene.render, bounce=False, near=2, edge=4)
    )


def make_board_set(folder: Path, photos: int, boards: int, megapixels: float) -> None:
    """``photos`` of the sample and ``boards`` of the bare board, 16-bit PNG."""
    scene = board_scene(megapixels, boards)
    camera = camera_of(scene)
    shots = [shot for shot in plan(scene) if shot.role != "sample"]
    samples = [shot for shot in plan(scene) if shot.role == "sample"][:photos]
    for shot in (*shots, *samples):
        (folder / shot.file).parent.mkdir(parents=True, exist_ok=True)

    def take(shot: Shot) -> None:
        write_picture(photo_of(scene, camera, shot), folder / shot.file)

    with ThreadPoolExecutor(cores()) as pool:
        list(pool.map(take, (*shots, *samples)))
    for k in range(photos):
        shot = replace(samples[k % DIFFERENT], file=f"sample/s{k:03d}.png")
        if k >= DIFFERENT:
            copied(folder / samples[k % DIFFERENT].file, folder / shot.file, k)
        shots.append(shot)
    manifest = manifest_of(scene, camera, tuple(shots))
    (folder / MANIFEST).write_text(tomli_w.dumps(manifest), encoding="utf-8")


def converted(source: Path, folder: Path, suffix: str) -> None:
    """The same set in another format."""
    manifest = tomllib.loads((source / MANIFEST).read_text(encoding="utf-8"))
    if suffix == ".jpg":
        manifest["radiometry"]["encoding"] = "srgb"
    entries = manifest["photo"]
    for k, entry in enumerate(entries):
        path = source / entry["file"]
        entry["file"] = str(Path(entry["file"]).with_suffix(suffix))
        place = folder / entry["file"]
        place.parent.mkdir(parents=True, exist_ok=True)
        if k >= DIFFERENT and entries[k - DIFFERENT]["role"] == entry["role"] == "sample":
            copied(folder / entries[k - DIFFERENT]["file"], place, k)
        else:
            write_picture(read_image(path).pixels / np.float32(FULL), place)
    (folder / MANIFEST).write_text(tomli_w.dumps(manifest), encoding="utf-8")


def photo_of(scene: Scene, camera: Camera, shot: Shot) -> np.ndarray:
    """(h, w, 3) linear signal of one photo, noise and all."""
    small = enlarged_from(camera, RENDERED)
    radiance = view_radiance(scene, small, brdf_of(scene), shot)
    radiance = np.maximum(cv2.resize(radiance, camera.size, interpolation=cv2.INTER_CUBIC), 0.0)
    codes = expose(scene, camera, radiance, shot.exposure_time, exposure_factor(scene), (shot.view, 0))
    return (codes / np.float32(FULL)).astype(np.float32)


def enlarged_from(camera: Camera, width: int) -> Camera:
    """A camera of about ``width`` pixels whose picture, enlarged, is that of ``camera``."""
    factor = max(1, round(camera.size[0] / width))
    matrix = camera.matrix.copy()
    matrix[:2] /= factor
    matrix[:2, 2] = (camera.matrix[:2, 2] + 0.5) / factor - 0.5  # pixels' middles are whole numbers
    return Camera(matrix, camera.distortion, (camera.size[0] // factor, camera.size[1] // factor))
