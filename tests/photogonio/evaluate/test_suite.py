"""The suite: words choose sets of it, one that is measured is kept, and a former evaluation is held against it."""

from __future__ import annotations

import json
import math

import pytest

from photogonio.capture.errors import InputError
from photogonio.evaluate import suite
from photogonio.evaluate.history import load_scores, regressions
from photogonio.evaluate.suite import MATERIALS, SetScore, run_suite, suite_line, suite_scenes
from photogonio.synthetic.brdf.library import make_brdf
from photogonio.system.progress import Reporter


def test_every_material_by_every_shape_lamp_and_kit():
    scenes = suite_scenes([])
    assert len(MATERIALS) == 24 and len({scene.name for scene in scenes}) == len(scenes) == 24 * 2 * 2 * 3
    assert all(make_brdf(**_split(brdf)) for brdf in MATERIALS.values())
    assert len({json.dumps(brdf) for brdf in MATERIALS.values()}) == 24


def _split(brdf):
    return {"model": brdf["model"], "parameters": {key: v for key, v in brdf.items() if key != "model"}}


def test_words_of_one_kind_are_either_and_of_several_kinds_both():
    names = {scene.name for scene in suite_scenes(["retro", "metal-30", "ball", "phone"])}
    assert names == {
        f"{material}_ball_{lamp}_phone" for material in ("retro", "metal-30") for lamp in ("near", "distant")
    }
    with pytest.raises(InputError, match=r"did you mean .plastic"):
        suite_scenes(["plastic-24"])


def test_kits_have_what_they_say():
    full, phone, bare = suite_scenes(["lambert", "ball", "near"])
    assert full.board and full.mirror_ball and not full.lamp.given
    assert phone.board and not phone.mirror_ball and phone.sensor.bits == 8 and not phone.lamp.given
    assert bare.board is None and bare.lamp.given and bare.camera.given


def test_what_was_measured_is_kept(tmp_path, monkeypatch):
    calls = []

    def measure(scene, sets):
        calls.append(scene.name)
        return SetScore(scene.name, error_70=0.01, of_stated=0.5, told=("a",), seconds=2.0)

    monkeypatch.setattr(suite, "measured", measure)
    words = ["lambert", "ball", "near"]
    first, again = (list(run_suite(words, tmp_path, workers=1, reporter=Reporter(quiet=True))) for _ in "ab")
    assert len(calls) == 3 and [one.error_70 for one in first] == [one.error_70 for one in again]
    damaged = next(tmp_path.glob("*.json"))
    damaged.write_text("{")
    list(run_suite(words, tmp_path, workers=1, reporter=Reporter(quiet=True)))
    assert len(calls) == 4


def test_a_set_that_is_refused_now_has_become_worse(tmp_path):
    good, bad = SetScore("a", error_70=0.01, seconds=1.0), SetScore("a", refused="no board")
    place = tmp_path / "evaluate.json"
    place.write_text(json.dumps({"sets": [good.to_dict(), bad.to_dict() | {"set": "b"}]}))
    former = load_scores(place, "set")
    assert regressions(former, [bad.to_dict()]) == ["a: refused now: no board"]
    assert regressions(former, [good.to_dict() | {"set": "b"}]) == []
    assert "refused: no board" in suite_line(bad) and math.isnan(bad.error_70)
