"""The text of a manifest to begin with is a manifest once photos are named."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.manifest.stub import FIELDS, photo_tables, quoted, remark, stub_manifest
from photogonio.capture.photoset import Photo
from photogonio.capture.target.layout import KINDS, PAPERS, make_target

TARGETS = [(paper, kind) for paper in PAPERS for kind in KINDS]


@pytest.mark.parametrize(("paper", "kind"), TARGETS)
def test_the_stub_is_a_manifest_once_photos_are_named(tmp_path, paper, kind):
    target = make_target(paper=paper, kind=kind)
    (tmp_path / "photoset.toml").write_text(stub_manifest(target), encoding="utf-8")
    with pytest.raises(InputError, match="photogonio init"):
        load_photoset(tmp_path)
    (tmp_path / "a.png").write_bytes(b"")
    text = stub_manifest(target) + '[[photo]]\nfile = "a.png"\nrole = "sample"\n'
    (tmp_path / "photoset.toml").write_text(text, encoding="utf-8")
    found = load_photoset(tmp_path)
    assert found.board.kind == kind and found.board.dictionary == target.board.dictionary
    size = "squares" if kind == "charuco" else "markers"
    assert getattr(found.board, size) == getattr(target.board, size)
    assert found.board.marker_length == pytest.approx(target.board.marker_length, abs=1e-4)
    balls = np.array([ball.center[:2] for ball in found.mirror_balls])
    assert np.abs(balls - target.balls).max() <= 0.005
    assert found.sample.center[:2] == pytest.approx(target.sample, abs=0.01)
    greys = np.array([one.outline for one in found.grey_patches])
    assert np.abs(greys - [outline for _, outline in target.greys]).max() <= 0.005


NAMES = [
    "a.png",
    'a "b".png',
    "back\\slash.png",
    "tab\there.png",
    "Grün/日本.png",
    "line\nfeed.png",
    "bell\x07\x7f.png",
]


@pytest.mark.parametrize("name", NAMES)
def test_any_name_is_a_string_of_toml(name):
    assert tomllib.loads(f"x = {quoted(name)}") == {"x": name}


def test_a_stub_takes_any_name_of_a_folder():
    assert tomllib.loads(stub_manifest(make_target(), name='a "b\\c'))["name"] == 'a "b\\c'


def test_a_remark_is_one_line():
    assert tomllib.loads("# " + remark("maker\nx = 1 \udcff")) == {}


def test_photos_come_back_from_their_tables():
    """Numbers to nine digits; what is not known is not written."""
    photos = [
        Photo(
            name,
            "sample",
            "L 1" if k % 2 else None,
            1 / (3 + k),
            5.6,
            100.0 * k or None,
            k if k > 3 else None,
        )
        for k, name in enumerate(NAMES)
    ]
    found = tomllib.loads(photo_tables(photos))["photo"]
    for photo, table in zip(photos, found, strict=True):
        given = {
            key: value for key in (*FIELDS, "file", "role") if (value := getattr(photo, key)) is not None
        }
        assert table.keys() == given.keys()
        for key, value in given.items():
            assert table[key] == (pytest.approx(value, rel=1e-8) if isinstance(value, float) else value)
