"""What a first look tells: every code has its entry here, and the keys that are advised are the manifest's."""

from __future__ import annotations

import ast
import re

from photogonio.capture.codes import ENTRIES
from photogonio.capture.manifest import entries
from tests.places import ROOT

TABLES = {"radiometry": entries.RADIOMETRY_TABLE, "camera": entries.CAMERA_TABLE}
KEYS = {key for table in (*TABLES.values(), entries.LIGHT_TABLE, entries.PHOTO_TABLE) for key in table}


def told() -> set[str]:
    """Codes of the diagnoses that this room makes."""
    calls = [
        node
        for path in (ROOT / "capture").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Diagnosis"
    ]
    return {call.args[0].value for call in calls if call.args and isinstance(call.args[0], ast.Constant)}


def test_every_code_that_is_told_is_listed_here():
    assert len(told()) > 5
    assert told() <= {entry.code for entry in ENTRIES}


def test_keys_that_are_advised_are_keys_of_the_manifest():
    advised = [piece for entry in ENTRIES for piece in entry.advice.split("`")[1::2]]
    found = [
        re.fullmatch(r"(?:\[(\w+)\])? ?(\w*)(?: = (.+))?", piece) for piece in advised if piece[0] != '"'
    ]
    assert len(found) > 5 and all(found)
    for table, key, value in (match.groups() for match in found):
        known = KEYS if table is None else set(TABLES[table])
        assert not key or key in known, key
        if value is not None:
            rule = next(keys[key].rule for keys in TABLES.values() if key in keys)
            rule(True if value == "true" else value.strip('"'), key)  # which raises, if it may not be said
