"""How sphinx-gallery runs the scripts of docs/gallery: each has a folder of its own to write to, as its argument."""

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst

BUILD = Path(__file__).resolve().parent / "_build" / "gallery"


def folder_of(script: Mapping[str, Any]) -> Path:
    return BUILD / Path(script["src_file"]).stem


def empty_folder(gallery: Mapping[str, Any], script: Mapping[str, Any]) -> list[str]:
    """The arguments of a script that is about to be run."""
    shutil.rmtree(folder_of(script), ignore_errors=True)
    folder_of(script).mkdir(parents=True)
    return [str(folder_of(script))]


def written_pictures(block: object, script: dict[str, Any], gallery: Mapping[str, Any]) -> str:
    """The pictures that a block of a script has written, as reStructuredText; those of earlier blocks are left out."""
    shown = script.setdefault("pictures shown", set())
    fresh = sorted(set(folder_of(script).glob("*.png")) - shown)
    shown.update(fresh)
    copies = [shutil.copyfile(picture, next(script["image_path_iterator"])) for picture in fresh]
    return figure_rst(copies, gallery["src_dir"])
