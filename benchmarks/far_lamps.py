"""Built-in scenes with their lamps near, three metres away, and as far as the sun: how much the distance costs.

Each scene is rendered with the lamps in the same directions, and processed with a board, its lamps found, and without
one, its lamps and camera given (of scenes whose camera stands still). A row is one set: relative L2 of f below 70
degrees of the worst channel, that over the near lamps', the error over half the stated interval within the valid
angles, photos left out, whether the result calls itself not to be trusted, and what is told that the near set's is
not. A set that is refused is a row too, and counted apart::

    python -m benchmarks.far_lamps [--scenes NAME ...] [--board board|none] [--size PIXELS] [--lamps N] [--quick]

Fewer and smaller photos than the scenes have: what is compared has the same ones.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from photogonio.capture.errors import InputError
from photogonio.compare.reflectances import load_known
from photogonio.evaluate.hard_cases import error_and_interval
from photogonio.evaluate.scenes import INNER, Refusal, against, spread_over_processes
from photogonio.evaluate.truth import TRUTH
from photogonio.options import Options
from photogonio.pipeline import process
from photogonio.report.trust import faults_of
from photogonio.synthetic.scene.hard_cases import changed
from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.scene import built_in, load_scene
from photogonio.synthetic.write.photoset import synthesize
from tests.drawn.scenes import before_given_camera

NEAR = {"kind": "point", "radius": 7.0, "distance": (350.0, 500.0)}
LAMPS = {
    "near": NEAR,
    "3 m": {"kind": "point", "radius": 15.0, "distance": (3000.0, 3000.0)},
    "sun": {"kind": "directional", "radius": 0.27},
}
MOST, SMALL = 1.2, 0.01  # of the near lamps' error, as asked; errors that are small by themselves
MOVING = 2  # times as many photos of a moving camera, which sees each direction once


@dataclass(frozen=True, slots=True)
class Found:
    """One set, measured."""

    error: float  # relative L2 below 70 degrees
    of_stated: float  # error over half the stated interval
    left_out: int
    trusted: bool
    told: frozenset[str]  # codes


def smaller(scene: Scene, width: int, lamps: int) -> Scene:
    """The scene seen by a given camera of ``width`` pixels, under at most ``lamps`` lamps (twice, if it moves)."""
    count = lamps * (MOVING if scene.camera.motion == "moving" else 1)
    lamp = {"count": min(scene.lamp.count, count), "attached_at": None}
    return changed(before_given_camera(scene, width), lamp=lamp)


def variants(scene: Scene) -> Iterator[tuple[str, str, Scene]]:
    """(board or not, lamps, scene)."""
    boards = {"board": scene}
    if scene.camera.motion == "fixed":
        boards["none"] = changed(scene, board=None, lamp={"given": True})
    for board, one in boards.items():
        for name, lamp in LAMPS.items():
            yield board, name, changed(one, lamp=lamp)


def measured(scene: Scene) -> Found | Refusal:
    with tempfile.TemporaryDirectory() as place:
        folder = synthesize(scene, Path(place) / scene.name)
        try:
            result = process(folder, None, Options(workers=1))
        except InputError as error:
            return Refusal(error.where, error.what)
        truth = load_known(folder / TRUTH)
        error, stated = error_and_interval(result, truth)
        return Found(
            float(against(result.brdf, truth, INNER).measures["relative_l2"].max()),
            error / stated,
            len(result.left_out),
            not faults_of(result),
            frozenset(one.code for one in result.diagnoses),
        )


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="what the distance of lamps costs")
    parser.add_argument("--scenes", nargs="+", default=built_in())
    parser.add_argument("--board", choices=("board", "none"), help="only with, or only without one")
    parser.add_argument("--size", type=int, default=420)
    parser.add_argument("--lamps", type=int, default=8)
    parser.add_argument("--seed", type=int, default=0, help="added to the scenes'")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--quick", action="store_true", help="one scene, small, without a board")
    args = parser.parse_args(argv)
    names, size, lamps = (["matte-ball"], 160, 3) if args.quick else (args.scenes, args.size, args.lamps)
    wanted = "none" if args.quick else args.board
    plain = [smaller(load_scene(name), size, lamps) for name in names]
    rows = [row for one in plain for row in variants(replace(one, seed=one.seed + args.seed))]
    rows = [row for row in rows if wanted in (None, row[0])]
    print(
        f"{'scene':22} {'board':6} {'lamps':5} error %  of near  of stated  left out  trusted  told besides"
    )
    found: list[tuple[str, Found | Refusal]] = []
    for (board, lamp, scene), one in zip(
        rows, spread_over_processes(measured, [scene for *_, scene in rows], args.workers), strict=True
    ):
        near = one if lamp == "near" else near_of(found)
        found.append((lamp, one))
        print(f"{scene.name:22} {board:6} {lamp:5} {told(one, near)}", flush=True)
    print(counted(found))


def near_of(found: Sequence[tuple[str, Found | Refusal]]) -> Found | Refusal:
    """The last set under near lamps."""
    return next(one for lamp, one in reversed(found) if lamp == "near")


def told(one: Found | Refusal, near: Found | Refusal) -> str:
    """The rest of a set's row."""
    if isinstance(one, Refusal):
        return f"refused: {one.what}"
    ratio = "-" if isinstance(near, Refusal) else f"{one.error / near.error:.2f}"
    besides = ", ".join(sorted(one.told - (frozenset() if isinstance(near, Refusal) else near.told))) or "-"
    return (
        f"{100 * one.error:7.2f}  {ratio:>7}  {one.of_stated:9.2f}  {one.left_out:8d}  "
        f"{'yes' if one.trusted else 'NO':7}  {besides}"
    )


def counted(found: Sequence[tuple[str, Found | Refusal]]) -> str:
    """How many of the sets, each with its lamps, miss what is asked of them."""
    pairs = [(one, near_of(found[: k + 1])) for k, (lamp, one) in enumerate(found) if lamp != "near"]
    far = [(a, b) for a, b in pairs if isinstance(a, Found) and isinstance(b, Found)]
    above = [a for a, b in far if a.error > MOST * b.error]
    small = sum(one.error < SMALL for one in above)
    done = [one for _, one in found if isinstance(one, Found)]
    beyond = sum(one.of_stated > 1.0 for one in done)
    most = max((one.of_stated for one in done), default=float("nan"))
    return (
        f"{len(above)} of {len(far)} above {MOST} of the near lamps' error ({small} of them below "
        f"{100 * SMALL:.0f} %); {beyond} of {len(done)} above what is stated, most {most:.2f}; "
        f"{len(found) - len(done)} refused"
    )


if __name__ == "__main__":
    main()
