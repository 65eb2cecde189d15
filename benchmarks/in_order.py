"""What departures amount to where there are none: the largest on drawn sets that are as their manifests say.

The thresholds of belief in :mod:`photogonio.calib.diagnose` stand beside these: ``python -m benchmarks.in_order``.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np

from photogonio.calib.adjust.flat_sample import lying
from photogonio.calib.adjust.start import start_sample, start_scene
from photogonio.calib.adjust.state import State
from photogonio.calib.detect.edges import plane_edges
from photogonio.calib.detect.gray import GrayPart
from photogonio.calib.diagnose.lights.ambient_light import light_beside
from photogonio.calib.diagnose.lights.vignetting import falloff_of, sureness
from photogonio.calib.diagnose.photos.moved_lamp import direction_by_paper
from tests.drawn import flat_samples
from tests.drawn.calibrations import Drawn

FLAT_NOISE = 0.004  # of the drawn photos of flat samples


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="what departures amount to on drawn sets in order")
    parser.add_argument("--sets", type=int, default=20)
    parser.add_argument("--quick", action="store_true", help="one set")
    args = parser.parse_args(argv)
    found: dict[str, list[float]] = {}
    for seed in range(1 if args.quick else args.sets):
        for name, amount in amounts(seed):
            found.setdefault(name, []).append(amount)
    for name, values in found.items():
        print(f"{name:40} {np.max(values):.5f} of {len(values)}, the middle one {np.median(values):.5f}")


def amounts(seed: int) -> Iterator[tuple[str, float]]:
    """Names with units, and what one set of each kind has."""
    drawn = Drawn(seed)
    state = drawn.settled(paper=True)
    board = drawn.remarks.residuals["board"]
    assert isinstance(board, dict)
    yield "board-stretched, relative", abs(board["stretch"])
    yield "board-bent, of its size", float(np.abs(board["bend"]).max())
    shift = state.settled.values["sample"][:3] - state.photoset.sample.center
    yield "sample-moved, of its radius", float(np.linalg.norm(shift) / state.photoset.sample.radius)
    falloff, room = falloff_of(state.settled), light_beside(state.settled.shading)
    if falloff is not None:
        yield "vignetting, of the light in corners", abs(falloff.corner[0])
        yield "vignetting, standard errors", sureness(falloff)
    if room is not None:
        yield "ambient-light, of the lamp's light", abs(room.level / room.bright)
        yield "ambient-light, standard errors", abs(room.level / room.error)
    yield from directions(drawn, state)
    still = Drawn(seed, fixed=True).camera()
    for one in still.observations:
        if one.corners is not None:
            off = still.camera.project(one.pose, one.corners.points) - one.corners.pixels
            yield "camera-moved, pixels", float(np.median(np.linalg.norm(off, axis=1)))
    yield "flat-sample-tilted, radians", tilt(seed)


def directions(drawn: Drawn, state: State) -> Iterator[tuple[str, float]]:
    """How far each photo's own paper has its lamp from where it is, as seen from the board's origin."""
    sample = start_sample(state.camera, state.observations, state.photoset.sample)
    scene = start_scene(state.photoset, state.camera, state.observations, sample)
    for number, one in enumerate(state.observations):
        fit = direction_by_paper(state.photoset, one, {one.view.name: {}}, scene)
        if fit is not None:
            true = drawn.world.lamps[number]
            cosine = fit.place @ true / np.linalg.norm(fit.place) / np.linalg.norm(true)
            yield "lamp-in-several-places, radians", float(np.arccos(min(cosine, 1.0)))


def tilt(seed: int) -> float:
    """Of a flat sample that lies as the manifest says."""
    pose_edges = []
    for k, pose in enumerate(flat_samples.POSES):
        photo = flat_samples.photo(pose, np.zeros(8), FLAT_NOISE, 100 * seed + k)
        part = GrayPart(photo, np.ones(photo.shape, bool))
        edges = plane_edges(part, flat_samples.CAMERA, pose, flat_samples.PLANE, 8.0)
        if edges is not None:
            pose_edges.append((pose, edges))
    move = lying(flat_samples.CAMERA, pose_edges, flat_samples.PLANE, False)
    return 0.0 if move is None else move.tilt[0]


if __name__ == "__main__":
    main()
