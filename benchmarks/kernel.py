"""Pixels to table: the compiled kernel against vectorised numpy, and against the memory it must read.

    python -m benchmarks.kernel [--quick] [--level L]

A frame of 12 megapixels with a ball or a plane on some part of it; the radiance is in memory. "Mpx/s" counts pixels
of the frame, "ns/px" is of a pixel of the sample's region, times threads. "memory" is the time in which the region's
radiance, variance and masks could be copied, over the kernel's: 1 would be as fast as memory allows.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np

from benchmarks.evaluation import best_time
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.setup import Light, Setup, ViewSetup
from photogonio.capture.photoset import Plane, Sphere
from photogonio.capture.radiance import RadianceImage
from photogonio.reconstruct.modes.parallel import cores
from photogonio.reconstruct.reduce.directions import ReduceOptions, region_of
from photogonio.reconstruct.reduce.reduce import reduce_view, reduce_view_plainly
from photogonio.reconstruct.table.facet_table import FacetTable

RADIUS, DISTANCE = 25.0, 500.0  # of the ball; the plane's half side
LENS = np.array([-0.026, 0.018, 1.2e-4, -8e-5, 0.0])
SIGMA = 0.004


def made_view(kind: str, share: float, megapixels: float) -> tuple[Setup, RadianceImage]:
    """A view whose sample covers ``share`` of the frame, and noise for a photo."""
    height = int(np.sqrt(megapixels * 1e6 * 3 / 4))
    width = height * 4 // 3
    across = (
        np.sqrt(share * width * height / np.pi) if kind == "ball" else np.sqrt(share * width * height) / 2
    )
    focal = across * DISTANCE / RADIUS
    matrix = np.array([[focal, 0, width / 2 + 10.37], [0, focal, height / 2 - 9.71], [0, 0, 1]])
    square = RADIUS * np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
    sample = Sphere(np.zeros(3), RADIUS) if kind == "ball" else Plane(square)
    pose = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, DISTANCE]))
    light = Light("L", "point", np.array([251.3, 97.7, 403.1]), np.zeros((3, 3)), "given", 7.0)
    view = ViewSetup("view", light, pose, np.full(3, 7e5), np.zeros(3), "intensity")
    setup = Setup(Camera(matrix, LENS, (width, height)), sample, (view,), "relative", ("R", "G", "B"))
    value = np.full((height, width, 3), 0.3, np.float32)
    value += SIGMA * np.random.default_rng(0).standard_normal(value.shape, np.float32)
    good = np.ones(value.shape[:2], bool)
    return setup, RadianceImage(value, np.full(value.shape, SIGMA**2, np.float32), good, ~good)


def disagreement(ours: FacetTable, plain: FacetTable) -> float:
    """Largest relative difference of a cell's mean f; infinite if the cells differ."""
    if not np.array_equal(ours.facet_i, plain.facet_i) or not np.array_equal(ours.facet_r, plain.facet_r):
        return np.inf
    a, b = ours.value / ours.weight[:, None], plain.value / plain.weight[:, None]
    return float(np.max(np.abs(a / b - 1.0)))


def copying(setup: Setup, photo: RadianceImage, repeats: int) -> float:
    """Seconds in which the region's pixels can be copied in memory."""
    x0, y0, x1, y1 = region_of(setup, setup.views[0].pose)
    parts = [
        part[y0:y1, x0:x1].copy() for part in (photo.value, photo.variance, photo.valid, photo.saturated)
    ]
    places = [np.empty_like(part) for part in parts]

    def copy() -> None:
        for place, part in zip(places, parts, strict=True):
            np.copyto(place, part)

    return best_time(copy, repeats)


def case(kind: str, share: float, megapixels: float, level: int, repeats: int) -> Iterator[str]:
    """A line of the table for each number of threads."""
    setup, photo = made_view(kind, share, megapixels)
    view, rules = setup.views[0], ReduceOptions()
    x0, y0, x1, y1 = region_of(setup, view.pose)
    plain = reduce_view_plainly(setup, view, photo, level, rules)
    slow = best_time(lambda: reduce_view_plainly(setup, view, photo, level, rules), 1)
    copied = copying(setup, photo, repeats)
    for threads in dict.fromkeys((1, cores())):
        ours = reduce_view(setup, view, photo, level, rules, threads=threads)
        fast = best_time(lambda n=threads: reduce_view(setup, view, photo, level, rules, threads=n), repeats)
        yield (
            f"{kind:6}  {share:5.2f}  {threads:7}  {megapixels / fast:7.0f}"
            f"  {1e9 * fast * threads / ((x1 - x0) * (y1 - y0)):5.0f}  {slow / fast:19.1f}"
            f"  {copied / fast:6.2f}  {disagreement(ours, plain):12.1e}"
        )


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--quick", action="store_true", help="a small frame: shows that it runs, not how fast"
    )
    parser.add_argument("--level", type=int, default=4)
    options = parser.parse_args(arguments)
    megapixels, repeats = (0.1, 1) if options.quick else (12.0, 5)
    print(f"{megapixels:g} megapixels, level {options.level}")
    print("sample  share  threads    Mpx/s  ns/px  numpy's time / ours  memory  disagreement")
    for kind in ("ball", "plane"):
        for share in (0.06, 0.25):
            for line in case(kind, share, megapixels, options.level, repeats):
                print(line, flush=True)


if __name__ == "__main__":
    main()
