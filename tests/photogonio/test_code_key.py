"""Kept results hang on the program's text: a byte changed anywhere in it is another key."""

import shutil
from pathlib import Path

import pytest

from photogonio import calib, capture, reconstruct, synthetic
from photogonio.cache import kept
from photogonio.evaluate import scenes as evaluate

PACKAGES = {
    package.__name__.rpartition(".")[2]: package for package in (capture, calib, reconstruct, synthetic)
}


@pytest.mark.parametrize("name", PACKAGES)
def test_any_changed_byte_changes_the_key(tmp_path, name):
    copy = tmp_path / name
    shutil.copytree(Path(PACKAGES[name].__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__"))
    before = kept.text_key(copy)
    for path in sorted(copy.rglob("*.py")):
        text = path.read_bytes()
        path.write_bytes(text + b"#")
        assert kept.text_key(copy) != before, path
        path.write_bytes(text)
    assert kept.text_key(copy) == before


def test_a_moved_or_new_file_changes_the_key(tmp_path):
    (tmp_path / "a.py").write_text("x = 1\n")
    keys = {kept.text_key(tmp_path)}
    (tmp_path / "inner").mkdir()
    (tmp_path / "a.py").rename(tmp_path / "inner" / "a.py")
    keys.add(kept.text_key(tmp_path))
    (tmp_path / "inner" / "b.py").write_text("")
    keys.add(kept.text_key(tmp_path))
    assert len(keys) == 3


@pytest.mark.parametrize("package", ["capture", "calib", "reconstruct"])
def test_the_key_of_results_holds_each_package(monkeypatch, package):
    asked = []
    monkeypatch.setattr(kept, "text_key", lambda folder, leaving_out=(): asked.append(folder) or "key")
    kept.code_key.__wrapped__()
    assert Path(PACKAGES[package].__file__).parent in asked


def test_the_renderer_s_key_leaves_out_what_the_scenes_say_themselves(monkeypatch):
    asked = []
    monkeypatch.setattr(
        evaluate, "text_key", lambda folder, leaving_out=(): asked.append((folder, set(leaving_out)))
    )
    evaluate.renderer_key.__wrapped__()
    assert asked == [(Path(synthetic.__file__).parent, {Path(evaluate.hard.__file__)})]
