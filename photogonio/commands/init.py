"""``photogonio init``."""

from __future__ import annotations

import argparse
from pathlib import Path

from photogonio.capture.manifest.draft import manifest_text, survey
from photogonio.capture.photoset import MANIFEST
from photogonio.system.outputs import staged_file
from photogonio.system.progress import Reporter


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    folder = Path(args.folder)
    text = manifest_text(folder)
    found = survey(folder)
    with staged_file(folder / MANIFEST) as stage:
        stage.write_text(text, encoding="utf-8")
    for name, why in found.passed.items():
        reporter.warn(f"{name} is not taken: {why}")
    roles = [photo.role for photo in found.photos]
    counts = {role: roles.count(role) for role in dict.fromkeys(roles)}
    shown = ", ".join(f"{count} {role}" for role, count in counts.items())
    reporter.say(f"written to {folder / MANIFEST} ({shown}); check the places and sizes in it")
    return {"out": str(folder / MANIFEST), "photos": counts, "not_taken": dict(found.passed)}
