"""A ball on a white table, photographed without a board: what the table throws on it is removed where lamps are
measured, and where they are not the pixels that it may spoil are left out."""

from __future__ import annotations

import json
import shutil
import tomllib
from pathlib import Path

import pytest
import tomli_w

from photogonio import pipeline
from photogonio.compare.reflectances import load_known
from photogonio.evaluate.scenes import INNER, against
from photogonio.evaluate.truth import TRUTH
from photogonio.pipeline import process
from photogonio.result import Result
from photogonio.run.surroundings import Shown

pytestmark = pytest.mark.slow


def without(rendered: Path, folder: Path, *keys: str) -> Path:
    """The set with the camera's place in the manifest, and without tables of it."""
    shutil.copytree(rendered, folder)
    manifest = tomllib.loads((folder / "photoset.toml").read_text(encoding="utf-8"))
    photos = json.loads((folder / TRUTH).read_text(encoding="utf-8"))["photos"]
    place = next(photo for photo in photos if photo["role"] == "sample")
    manifest["camera"] |= {"rotation": place["rotation"], "translation": place["translation"]}
    for key in keys:
        del manifest[key]
    (folder / "photoset.toml").write_text(tomli_w.dumps(manifest), encoding="utf-8")
    return folder


def error(found: Result, folder: Path) -> float:
    """Relative L2 below 70 degrees, worst channel."""
    return float(against(found.brdf, load_known(folder / TRUTH), INNER).measures["relative_l2"].max())


def test_the_table_under_the_ball_is_seen_without_a_board(on_white: Path, tmp_path: Path):
    folder = without(on_white, tmp_path / "set", "board")
    found = process(folder)
    assert found.setup.scale == "absolute"
    assert found.beside.known is not None and found.beside.unknown is None
    assert error(found, folder) <= 0.03


def test_where_lamps_are_proportions_spoilt_pixels_are_left_out(on_white: Path, tmp_path: Path, monkeypatch):
    folder = without(on_white, tmp_path / "set", "board", "white_patch")
    found = process(folder)
    assert found.setup.scale == "relative"
    assert found.beside.known is None and found.beside.spoilt.pixels > 0
    monkeypatch.setattr(
        pipeline, "shown_around", lambda photoset, setup, table, around: (Shown((None,) * len(around)), table)
    )
    believed = process(folder)
    assert error(found, folder) <= 0.03
    assert error(believed, folder) >= 2.0 * error(found, folder)
