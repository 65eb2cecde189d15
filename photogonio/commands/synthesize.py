"""``photogonio synthesize``."""

from __future__ import annotations

import argparse
import os
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from photogonio.capture.errors import InputError
from photogonio.compare.reflectances import as_reflectance
from photogonio.synthetic.scene.plan import plan
from photogonio.synthetic.scene.scene import built_in, load_scene
from photogonio.synthetic.write.photoset import synthesize
from photogonio.system.outputs import check_place
from photogonio.system.progress import Reporter


def counted(roles: Iterable[str]) -> str:
    """How many photos of each role, since ``process`` counts those of the sample alone."""
    each = ", ".join(f"{count} {role}" for role, count in Counter(roles).most_common())
    return f"photos ({each})"


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    if args.list:
        reporter.say("\n".join(built_in()))
        return {"scenes": built_in()}
    if args.scene is None:
        raise InputError("synthesize", "expected a SCENE; --list names the built-in ones")
    scene = load_scene(args.scene)
    folder = Path(args.out) if args.out else Path(Path(args.scene).stem)
    check_place(folder, folder=True)
    photos = counted(shot.role for shot in plan(scene))
    synthesize(
        scene,
        folder,
        args.workers or os.cpu_count() or 1,
        lambda done, total: reporter.progress(f"rendering {photos}", done, total),
        foreign=as_reflectance,
    )
    reporter.say(f"written to {folder}: photoset.toml, {photos}, and truth.json")
    return {"scene": scene.name, "out": str(folder)}
