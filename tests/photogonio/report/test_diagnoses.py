"""Codes of what is told: each has its place in the docs, and each told one is among them."""

import ast

import pytest

from photogonio.report.diagnoses import ENTRIES, to_markdown
from tests.places import ROOT

LISTS = (
    "calib/diagnose/registry.py",
    "capture/codes.py",
    "photogonio/report/diagnoses.py",
    "reconstruct/goniometer/codes.py",
)
TELLING = {"Diagnosis": 0, "tell": 0, "leave_out": 2}  # callables, and which argument is the code


def constants(path) -> set[str]:
    return {
        node.value
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }


def sources():
    rooms = ("capture", "calib", "reconstruct", "photogonio")
    return [path for room in rooms for path in (ROOT / room).rglob("*.py")]


def test_the_page_is_what_the_program_lists():
    assert (ROOT / "docs" / "diagnoses.md").read_text(encoding="utf-8") == to_markdown()


def test_no_code_stands_for_two_things():
    codes = [entry.code for entry in ENTRIES]
    assert len(codes) == len(set(codes))


def test_every_listed_code_can_be_told():
    used = set().union(*(constants(p) for p in sources() if str(p.relative_to(ROOT)) not in LISTS))
    assert {entry.code for entry in ENTRIES} <= used


def test_every_code_that_is_told_is_listed():
    known, seen = {entry.code for entry in ENTRIES}, set()
    for path in sources():
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.Call):
                continue
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            place = TELLING.get(name)
            if name == "tell" and len(node.args) != 2:  # of progress
                continue
            if place is not None and len(node.args) > place and isinstance(node.args[place], ast.Constant):
                seen.add(node.args[place].value)
    assert seen and seen <= known


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.code)
def test_a_threshold_says_where_it_is_from(entry):
    assert entry.means and entry.advice
    assert bool(entry.source) == bool(entry.least or entry.sigmas)
