"""``fit RESULT/table.npz`` is the fit that ``process`` made, with the same options to the last bit."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.options import Options
from photogonio.pipeline import process
from photogonio.reconstruct.table.facet_table import FacetTable
from photogonio.reconstruct.table.table_file import PHOTOS, load_with, save_table
from photogonio.report import page
from photogonio.result import Result
from photogonio.run.circumstances import unpacked
from photogonio.tabulated import fit
from tests.drawn.tiny_set import RADIUS, TinySet

PLAIN = Options(order=1, lobes=0)


@pytest.fixture(autouse=True, scope="module")
def plain_pictures():
    pixel = cv2.imencode(".png", np.zeros((1, 1, 3), np.uint8))[1].tobytes()
    drawn = tuple(page.Drawn(name, name, "", pixel) for name in ("coverage", "fit", "lobes"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page, "draw_pictures", lambda result, *, source: drawn)
        yield


@pytest.fixture(scope="module")
def plain(plain_pictures, tmp_path_factory) -> tuple[Path, Result]:
    """What ``process`` leaves of the tiny set, and gives: made once, only read."""
    folder = tmp_path_factory.mktemp("plain")
    return folder / "first", process(TinySet(folder / "tiny").folder, folder / "first", PLAIN)


def document(folder: Path) -> dict[str, object]:
    """The coefficient file but for where it came from."""
    found = json.loads((folder / "coefficients.json").read_text(encoding="utf-8"))
    assert found.pop("source")["command"].startswith("photogonio")
    return found


def grounded(tiny_set: TinySet) -> None:
    """On z = 0 and under lamps whose strengths are measured: what lies around the ball is read of each photo."""
    tiny_set.replace("center = [0, 0, 0]", f"center = [0, 0, {RADIUS}]")
    tiny_set.replace("translation = [0, 0, 200.0]", f"translation = [0, 0, {200.0 + RADIUS}]")


@pytest.mark.parametrize(
    "asked", [{}, {"order": 2, "lobes": 0}, {"order": 1, "lobes": 0, "channels": ("G",)}]
)
def test_the_same_coefficients_to_the_last_bit(tmp_path, tiny_set: TinySet, asked):
    options = Options(**asked)
    first = process(tiny_set.folder, tmp_path / "first", options)
    again = fit(tmp_path / "first/table.npz", tmp_path / "again", options)
    assert document(tmp_path / "first") == document(tmp_path / "again")
    assert again.warnings == first.warnings
    assert again.choices == first.choices
    assert not (tmp_path / "again/setup.json").exists()
    # and what that leaves can be fitted again
    fit(tmp_path / "again/table.npz", tmp_path / "third", options)
    assert document(tmp_path / "first") == document(tmp_path / "third")


def test_channels_may_be_chosen_later(tmp_path, tiny_set: TinySet, plain):
    green = replace(PLAIN, channels=("G",))
    process(tiny_set.folder, tmp_path / "green", green)
    fit(plain[0] / "table.npz", tmp_path / "again", green)
    assert document(tmp_path / "green") == document(tmp_path / "again")


def test_stray_light_view_errors_and_lamps_come_along(tmp_path, tiny_set: TinySet):
    grounded(tiny_set)
    found = process(tiny_set.folder, tmp_path / "first", PLAIN)
    table, beside = load_with(tmp_path / "first/table.npz")
    known = unpacked(beside, table, "table.npz")
    assert known.shown.brightness == found.known.shown.brightness
    assert known.shown.spoilt == found.beside.spoilt
    assert known.setup.scale == found.setup.scale
    for view, same in zip(found.setup.views, known.setup.views, strict=True):
        np.testing.assert_array_equal(view.strength, same.strength)
        np.testing.assert_array_equal(view.light.place, same.light.place)


def test_a_sphere_is_asked_nothing_that_process_would_refuse(plain):
    with pytest.raises(InputError, match="sphere"):
        fit(plain[0] / "table.npz", None, Options(symmetry="general"))


def test_tables_of_before_are_fitted_as_before(tmp_path, plain):
    """Without what belongs to their photos."""
    table, beside = load_with(plain[0] / "table.npz")
    save_table(table, tmp_path / "old.npz", source=str(beside["source"]))
    found = fit(tmp_path / "old.npz", tmp_path / "again", PLAIN)
    assert found.setup is None and found.brdf.scale == "relative"
    assert found.name == "old"


@pytest.mark.parametrize(
    "spoil",
    [
        lambda told: told.pop("setup"),
        lambda told: told.update(setup={}),
        lambda told: told["setup"].update(views=[]),
        lambda told: told["setup"]["views"][0].update(strength=[0.0, 0.0, 0.0]),
        lambda told: told.update(brightness={"nobody": 0.5}),
        lambda told: told.update(symmetry="round"),
        lambda told: told.update(version=2),
        lambda told: told.update(left_out=[1]),
    ],
)
def test_circumstances_that_cannot_be_are_refused(tmp_path, plain, spoil):
    table, beside = load_with(plain[0] / "table.npz")
    told = json.loads(str(beside[PHOTOS]))
    spoil(told)
    save_table(table, tmp_path / "bad.npz", beside=beside | {PHOTOS: np.array(json.dumps(told))})
    with pytest.raises(InputError, match=r"bad\.npz"):
        fit(tmp_path / "bad.npz", tmp_path / "out", PLAIN)
    assert not (tmp_path / "out").exists()


def test_the_table_itself_is_as_it_was(plain):
    first, found = plain
    table, _ = load_with(first / "table.npz")
    for f in fields(FacetTable):
        np.testing.assert_array_equal(getattr(table, f.name), getattr(found.table, f.name))
