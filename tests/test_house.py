"""The house rule: each module has a test file of its name at the mirrored place, which says what is tested."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.places import ROOT

ROOMS = ("capture", "calib", "reconstruct")
# modules without, at most eight, and why
WITHOUT = {
    "calib/diagnose/base.py": "protocols, which test_registry holds every departure to",
}


def mirrored(module: Path) -> Path:
    room, *folders, name = module.relative_to(ROOT).parts
    return ROOT / "tests" / room / Path(*folders) / f"test_{name}"


def modules(room: str) -> list[Path]:
    return sorted(path for path in (ROOT / room).rglob("*.py") if path.name != "__init__.py")


@pytest.mark.parametrize("room", ROOMS)
def test_each_module_has_a_test_file_of_its_name(room):
    found = modules(room)
    missing = [str(path.relative_to(ROOT)) for path in found if not mirrored(path).is_file()]
    assert len(found) > 10
    assert [name for name in missing if name not in WITHOUT] == []


def test_few_go_without_and_none_that_has_one():
    assert len(WITHOUT) <= 8 and all(WITHOUT.values())
    assert [name for name in WITHOUT if not (ROOT / name).is_file() or mirrored(ROOT / name).is_file()] == []
