"""Photos to table against decoding the same files with the same reader and workers.

    python -m benchmarks.end_to_end [--quick] [--formats png,tif,exr,jpg] [--photos N] [--share S] [--whole]

The photos, a matte ball before a board, are made first: six different ones under N names, all in the disk's cache.
Camera, pose and lights are given. "first look" is what is read before any photo is reduced (sizes, noise, clipping);
"reduce" takes every photo from its file to the table, with a hash of its bytes and its result kept, as ``process``
does. --whole adds all of ``process``: calibration, fit and report.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import OpenImageIO as oiio

from benchmarks.kernel import RADIUS, made_view
from photogonio.cache.store import Store
from photogonio.calib.setup import Setup
from photogonio.capture.linear.encoding import linear_to_srgb
from photogonio.capture.linear.prepare import prepare
from photogonio.capture.linear.reader import RadianceReader
from photogonio.capture.manifest.load import load_photoset
from photogonio.pipeline import process
from photogonio.reconstruct.modes.parallel import cores
from photogonio.reconstruct.reduce.directions import (
    OUTSIDE,
    ReduceOptions,
    pairs_at,
    region_of,
    region_pixels,
    scene_of,
)
from photogonio.run.reduce_photos import Plan, reduce_photos

DIFFERENT = 6
ELECTRONS, READ = 6000.0, 4.0  # of a small sensor
GRAIN = 0.04  # of the printed paper; without noise and grain a JPEG is decoded in no time
LIGHTS = np.array(
    [
        [251.3, 97.7, 403.1],
        [-200, 150, 380],
        [60, -260, 420],
        [-80, -40, 520],
        [120, 210, 350],
        [-240, -160, 300],
    ]
)


def made_setup(count: int, suffix: str, share: float, megapixels: float) -> Setup:
    """Views of a ball, one lamp after another."""
    setup, _ = made_view("ball", share, megapixels)
    view = setup.views[0]
    views = [
        replace(
            view, name=f"s{k:04d}{suffix}", light=replace(view.light, id=f"L{k % DIFFERENT}", place=place)
        )
        for k, place in ((k, LIGHTS[k % DIFFERENT]) for k in range(count))
    ]
    return replace(setup, views=tuple(views))


def picture(setup: Setup, number: int) -> np.ndarray:
    """(h, w, 3) float32 signal of one view: the ball on squares, with noise."""
    view, camera = setup.views[number], setup.camera
    width, height = camera.size
    y, x = np.mgrid[:height, :width]
    squares = ((x * 11 // width + y * 8 // height) % 2).astype(np.float32)
    rng = np.random.default_rng(number)
    grain = 1.0 + GRAIN * rng.standard_normal(squares.shape, np.float32)
    image = np.repeat(((0.03 + 0.4 * squares) * grain)[..., None], 3, axis=2)
    region = x0, y0, x1, y1 = region_of(setup, view.pose)
    pairs = pairs_at(scene_of(setup, view, ReduceOptions(margin=0.0)), camera, region_pixels(region))
    light = np.maximum(pairs.irradiance, 0.0)[:, None] * view.strength * [0.2, 0.17, 0.13] / np.pi
    ball = image[y0:y1, x0:x1].reshape(-1, 3)
    ball = np.where((pairs.reason == OUTSIDE)[:, None], ball, light)
    image[y0:y1, x0:x1] = ball.reshape(y1 - y0, x1 - x0, 3)
    noise = rng.standard_normal(image.shape, np.float32)
    return image + noise * np.sqrt(
        np.maximum(image, 0.0) / np.float32(ELECTRONS) + np.float32((READ / ELECTRONS) ** 2)
    )


def write_picture(image: np.ndarray, path: Path) -> None:
    """In the format of the path's suffix: 16-bit linear, half float, or 8-bit sRGB (JPEG)."""
    if path.suffix == ".exr":
        file = oiio.ImageOutput.create(str(path))
        file.open(str(path), oiio.ImageSpec(image.shape[1], image.shape[0], 3, "half"))
        file.write_image(image)
        file.close()
    elif path.suffix == ".jpg":
        codes = 255.0 * linear_to_srgb(np.clip(image, 0.0, 1.0)) + 0.5
        cv2.imwrite(str(path), codes.astype(np.uint8)[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 95])
    else:
        codes = 65535.0 * np.clip(image, 0.0, 1.0) + 0.5
        cv2.imwrite(str(path), codes.astype(np.uint16)[..., ::-1])


def copied(source: Path, place: Path, number: int) -> None:
    """The same picture in a file of other bytes: copies of a photo would be left out."""
    place.write_bytes(source.read_bytes() + number.to_bytes(4, "big"))


def make_set(folder: Path, setup: Setup, suffix: str) -> None:
    """Photos and manifest of a setup; photos beyond the first DIFFERENT show what those do."""
    folder.mkdir(parents=True)
    for k, view in enumerate(setup.views):
        if k < DIFFERENT:
            write_picture(picture(setup, k), folder / view.name)
        else:
            copied(folder / setup.views[k % DIFFERENT].name, folder / view.name, k)
    pose, camera = setup.views[0].pose, setup.camera
    text = "format = 1\n"
    text += f'[sample]\nshape = "sphere"\ncenter = [0.0, 0.0, 0.0]\nradius = {RADIUS}\n'
    text += f'[radiometry]\nencoding = "{"srgb" if suffix == ".jpg" else "linear"}"\n'
    text += f"[camera]\nfixed = true\nmatrix = {camera.matrix.tolist()}\n"
    text += f"distortion = {camera.distortion.tolist()}\n"
    text += f"rotation = {pose.rotation.tolist()}\ntranslation = {pose.translation.tolist()}\n"
    for k, place in enumerate(LIGHTS[: len(setup.views)]):
        text += f'[[light]]\nid = "L{k}"\nkind = "point"\nposition = {place.tolist()}\nradius = 7.0\n'
    for view in setup.views:
        text += f'[[photo]]\nfile = "{view.name}"\nrole = "sample"\nlight = "{view.light.id}"\n'
    (folder / "photoset.toml").write_text(text)


def timed(task: Callable[[], object]) -> float:
    start = time.perf_counter()
    task()
    return time.perf_counter() - start


def decode_all(reader: RadianceReader, workers: int) -> None:
    """Every sample photo, decoded and dropped."""
    photos = [photo for view in reader.photoset.views("sample") for photo in view.photos]
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(lambda photo: reader.image(photo).pixels.shape, photos))


def measure(folder: Path, setup: Setup, workers: int, repeats: int) -> tuple[float, float, float]:
    """Seconds, medians: decoding alone, the first look, photos to table. The runs take turns."""
    photoset = load_photoset(folder)
    reader = prepare(photoset)
    decode_all(reader, workers)  # into the disk's cache
    rounds = []
    for _ in range(repeats + 1):
        with tempfile.TemporaryDirectory() as kept:
            job = Plan(4, ReduceOptions(), workers, Store(Path(kept)))
            rounds.append(
                (
                    timed(lambda: decode_all(reader, workers)),
                    timed(lambda: prepare(photoset)),
                    timed(lambda job=job: reduce_photos(reader, setup, job)),
                )
            )
    return tuple(np.median(rounds[1:], axis=0))  # the first compiled


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few small photos: shows that it runs")
    parser.add_argument("--formats", default="png,tif,exr,jpg")
    parser.add_argument("--photos", type=int, default=24)
    parser.add_argument("--share", type=float, default=0.06, help="of the frame that the ball covers")
    parser.add_argument("--workers", type=int, default=cores())
    parser.add_argument("--whole", action="store_true")
    options = parser.parse_args(arguments)
    photos, megapixels, repeats = (3, 0.2, 1) if options.quick else (options.photos, 12.0, 3)
    print(
        f"{photos} photos of {megapixels:g} megapixels, ball on {options.share:.0%}, {options.workers} workers"
    )
    print("format   decode  first look  reduce  reduce / decode  with first look  process / decode")
    for name in options.formats.split(","):
        folder = Path(tempfile.mkdtemp()) / "set"
        try:
            setup = made_setup(photos, f".{name}", options.share, megapixels)
            make_set(folder, setup, f".{name}")
            decode, look, reduce = measure(folder, setup, options.workers, repeats)
            ratios = f"{reduce / decode:15.2f}  {(look + reduce) / decode:15.2f}"
            whole = f"{timed(lambda f=folder: process(f)) / decode:16.2f}" if options.whole else ""
            print(f"{name:6}  {decode:7.3f}  {look:10.3f}  {reduce:6.3f}  {ratios}  {whole}", flush=True)
        finally:
            shutil.rmtree(folder.parent)


if __name__ == "__main__":
    main()
