"""Kept results hang on the program's text: a byte changed anywhere in it is another key."""

import shutil
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import pytest

import photogonio
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


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """All rooms inside the front door's folder, as they are installed; and how their key is made anew."""
    front = tmp_path / "photogonio"
    ignore = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(photogonio.__file__).parent, front, ignore=ignore)
    rooms = []
    for name, package in PACKAGES.items():
        shutil.copytree(Path(package.__file__).parent, front / name, ignore=ignore)
        rooms.append(SimpleNamespace(__name__=package.__name__, __file__=str(front / name / "__init__.py")))
    monkeypatch.setattr(kept, "ROOMS", tuple(rooms[:3]))
    monkeypatch.setattr(kept, "photogonio", SimpleNamespace(__file__=str(front / "__init__.py")))
    return front


def test_the_key_of_results_is_that_of_a_checkout_and_holds_each_file(installed):
    now = kept.code_key.__wrapped__
    assert now() == kept.code_key()
    for name in (
        "run/one_photo.py",
        "run/cluster.py",
        "refit.py",
        "cache/kept.py",
        "capture/files/images.py",
        "calib/setup.py",
        "reconstruct/table/facet_table.py",
    ):
        text = (installed / name).read_bytes()
        (installed / name).write_bytes(text + b"#")
        assert now() != kept.code_key(), name
        (installed / name).write_bytes(text)
    # scenes bear on no photo's result
    (installed / "synthetic" / "new.py").write_text("")
    assert now() == kept.code_key()


@pytest.mark.parametrize("library", [*kept.LIBRARIES, "cv2"])
def test_another_version_of_a_library_is_another_key(monkeypatch, library):
    before = kept.code_key.__wrapped__()
    assert "unknown" not in {kept._version(name) for name in kept.LIBRARIES}
    if library == "cv2":
        monkeypatch.setattr(kept.cv2, "__version__", "0")
    else:
        monkeypatch.setattr(kept, "version", lambda name: "0" if name == library else metadata.version(name))
    assert kept.code_key.__wrapped__() != before


def test_a_library_that_was_built_by_hand_has_a_key(monkeypatch):
    monkeypatch.setattr(kept, "LIBRARIES", ("no-such-library",))
    assert kept.code_key.__wrapped__()


def test_the_renderer_s_key_leaves_out_what_the_scenes_say_themselves(monkeypatch):
    asked = []
    monkeypatch.setattr(
        evaluate, "text_key", lambda folder, leaving_out=(): asked.append((folder, set(leaving_out)))
    )
    evaluate.renderer_key.__wrapped__()
    assert asked == [(Path(synthetic.__file__).parent, {Path(evaluate.hard.__file__)})]


def test_the_key_of_written_files_holds_templates_and_what_draws(installed, monkeypatch):
    now = kept.written_key.__wrapped__
    before = now()
    assert before == kept.written_key()  # of a checkout
    templates = sorted(installed.rglob("templates/*"))
    assert {path.name for path in templates} >= {"report.html", "interactive.js", "summary.html"}
    for path in (*templates, installed / "report" / "html.py", installed / "reconstruct" / "fit.py"):
        text = path.read_bytes()
        path.write_bytes(text + b"\n")
        kept.code_key.cache_clear()
        assert now() != before, path
        path.write_bytes(text)
    kept.code_key.cache_clear()
    (installed / "report" / "templates" / "new.css").write_text("")
    assert now() != before
    (installed / "report" / "templates" / "new.css").unlink()
    for name in ("report/__pycache__/a.pyc", "synthetic/new.toml", "report/templates/.report.html.swp"):
        (installed / name).parent.mkdir(exist_ok=True)
        (installed / name).write_text("")
        assert now() == before, name
    for library in kept.DRAWING:
        assert kept._version(library) != "unknown"
        monkeypatch.setattr(
            kept, "version", lambda name, own=library: "0" if name == own else metadata.version(name)
        )
        assert now() != before, library


def test_a_page_that_is_laid_out_anew_lets_photos_be(installed):
    before = kept.code_key.__wrapped__()
    (installed / "report" / "templates" / "report.html").write_text("another")
    assert kept.code_key.__wrapped__() == before
