"""How well lamps are found that no file names: rendered sets with bounce and noise, all calibrated from the photos.

The direction as the sample sees it, degrees, and the place as a share of the lamp's distance; median and 95 % quantile
over the views of each scene and over all of them::

    python -m benchmarks.lamps [--scenes NAME ...] [--seeds N] [--workers N] [--quick]
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from photogonio.evaluate.truth import load_truth, view_errors
from photogonio.pipeline import calibrate
from photogonio.synthetic.scene.hard_cases import changed
from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.scene import load_scene
from photogonio.synthetic.write.photoset import synthesize
from photogonio.system.progress import Reporter

SCENES = ("matte-ball", "plastic-ball", "metal-ball", "oren-nayar-plane", "plastic-plane", "brushed-plane")
DIRECTION, PLACE = 1, 2  # among a view's errors
QUICK = {
    "camera": {"size": (420, 280), "focal": 945.0, "calibration": 4},
    "lamp": {"count": 4},
    "render": {"near": 2, "edge": 4},
}


def lamp_errors(scene: Scene, folder: Path, workers: int) -> np.ndarray:
    """Direction, degrees, and place over distance of the lamp of every view that was used, (n, 2)."""
    photos = synthesize(scene, folder, workers=workers)
    setup, truth = calibrate(photos, reporter=Reporter(quiet=True), workers=workers), load_truth(photos)
    of_photo = {photo["file"]: photo for photo in truth["photos"]}
    rows = [view_errors(setup, view, of_photo[view.name], truth["radiance_scale"]) for view in setup.views]
    return np.array(rows)[:, [DIRECTION, PLACE]]


def told(name: str, errors: np.ndarray) -> str:
    direction, place = errors[:, 0], errors[np.isfinite(errors[:, 1]), 1]
    line = f"{name:18} {len(errors):5d}   {np.median(direction):9.3f} {np.quantile(direction, 0.95):8.3f}"
    if len(place):
        line += f"   {np.median(place):9.4f} {np.quantile(place, 0.95):8.4f}"
    return line


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="lamps found against their truth")
    parser.add_argument("--scenes", nargs="+", default=SCENES)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--quick", action="store_true", help="one small set")
    args = parser.parse_args(argv)
    names, seeds = (args.scenes[:1], 1) if args.quick else (args.scenes, args.seeds)
    print(f"{'scene':18} lamps   direction     95 %       place     95 %")
    everything = []
    for name in names:
        found = []
        for seed in range(seeds):
            scene = changed(load_scene(name), **(QUICK if args.quick else {}))
            with tempfile.TemporaryDirectory() as folder:
                found.append(
                    lamp_errors(replace(scene, seed=scene.seed + seed), Path(folder) / "set", args.workers)
                )
        everything += found
        print(told(name, np.concatenate(found)), flush=True)
    print(told("all", np.concatenate(everything)))


if __name__ == "__main__":
    main()
