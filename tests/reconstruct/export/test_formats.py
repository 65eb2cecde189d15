"""Formats by name."""

from __future__ import annotations

import json
from xml.etree import ElementTree

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.export import loss, principled, radiance_tree
from photogonio.reconstruct.export.formats import FORMATS, find_format
from photogonio.reconstruct.export.loss import PLACE
from tests.drawn.exports import satin


def test_an_unknown_format_is_refused():
    with pytest.raises(
        InputError, match="csv, merl, mitsuba, radiance, openpbr, gltf, modes, scatmech, pabopto"
    ):
        find_format("obj")


def test_a_basis_is_radiances_alone():
    assert find_format("radiance", "klems").write is not find_format("radiance", "tree").write
    assert find_format("radiance").write is find_format("radiance", "tree").write
    with pytest.raises(InputError, match="--basis klems: --format merl has none"):
        find_format("merl", "klems")


def test_what_keeps_every_digit_loses_none_to_speak_of(tmp_path):
    FORMATS["modes"].write(satin(), tmp_path / "a.json")
    loss = FORMATS["modes"].loss(satin(), tmp_path / "a.json")
    assert max(loss.rms) < 1e-12
    np.testing.assert_allclose(loss.albedo, 1.0, rtol=1e-12)


WITHOUT_ROOM = {"merl", "scatmech"}


@pytest.mark.parametrize("name", ["csv", "mitsuba", "openpbr", "gltf", "modes", "pabopto", "radiance"])
def test_files_with_room_say_their_loss_and_where_they_came_from(tmp_path, name, monkeypatch):
    monkeypatch.setattr(radiance_tree, "_DEEPEST", {3: 4, 4: 2})
    monkeypatch.setattr(loss, "_PAIRS", 600)
    monkeypatch.setattr(principled, "_ROUGHNESS", np.array([0.5]))
    form, where = FORMATS[name], tmp_path / "a"
    source = 'photogonio export "a.json" --format x & <b>'
    _, lost = form.put(satin(), where, source=source)
    files = sorted(where.iterdir()) if form.folder else [where]
    for file in files:
        text = file.read_bytes().decode("latin-1")
        assert PLACE not in text and f"photogonio: {lost}"[:40] in text and "export" in text
    if name in ("openpbr", "radiance"):
        ElementTree.parse(where)
    if name in ("gltf", "modes"):
        assert source in json.dumps(json.loads(where.read_text()), ensure_ascii=False).replace('\\"', '"')
    assert {one for one, form in FORMATS.items() if form.state is None} == WITHOUT_ROOM


@pytest.mark.parametrize("name", sorted({*FORMATS} - {"openpbr", "gltf"}))  # which take seconds
def test_no_file_holds_its_own_name_which_is_another_in_each_run(tmp_path, name, monkeypatch):
    monkeypatch.setattr(radiance_tree, "_DEEPEST", {3: 4, 4: 2})
    brdf = satin(("Y",)) if name == "scatmech" else satin()
    for one in ("first-name", "other-name"):
        FORMATS[name].write(brdf, tmp_path / one)
    first, other = (sorted([tmp_path / n, *(tmp_path / n).glob("*")]) for n in ("first-name", "other-name"))
    assert [f.read_bytes() for f in first if f.is_file()] == [f.read_bytes() for f in other if f.is_file()]


def test_suffixes_are_those_that_consumers_look_for():
    suffixes = {name: form.suffix for name, form in FORMATS.items()}
    assert suffixes["mitsuba"] == ".bsdf" and suffixes["openpbr"] == ".mtlx" and suffixes["merl"] == ".binary"
    assert all(suffix.startswith(".") for suffix in suffixes.values())


def test_no_two_formats_take_the_same_name_nor_that_of_a_result():
    suffixes = [form.suffix for form in FORMATS.values()]
    assert len(set(suffixes)) == len(suffixes) and ".json" not in suffixes
