"""The text of a manifest to begin with is a manifest once photos are named."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.manifest.stub import stub_manifest
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
