"""Knees, regressions, hard cases and truth, on numbers made by hand."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.setup import Light, Setup, ViewSetup
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import Sphere
from photogonio.evaluate.history import load_scores, regressions
from photogonio.evaluate.scenes import QUICK, SUITE, load_scenes, rendered
from photogonio.evaluate.tradeoff import (
    FEW,
    FULL,
    Point,
    Run,
    coarser,
    mark_knees,
    settings_of,
    tradeoff_lines,
)
from photogonio.evaluate.truth import calibration_error
from photogonio.system.progress import Reporter


def knee_of(*points: tuple[float, float]) -> int:
    marked = mark_knees([Point("k", str(n), seconds, error) for n, (seconds, error) in enumerate(points)])
    assert sum(point.knee for point in marked) == 1
    return next(n for n, point in enumerate(marked) if point.knee)


def test_the_knee_is_where_more_time_stops_paying():
    assert knee_of((1, 0.5), (2, 0.1), (4, 0.02), (8, 0.019), (16, 0.018)) == 2


def test_points_that_others_beat_are_no_knee():
    assert knee_of((1, 0.5), (2, 0.02), (3, 0.4), (8, 0.018)) == 1


def test_a_straight_front_has_its_best_point_marked():
    assert knee_of((1, 0.8), (2, 0.4), (4, 0.2)) == 2


def test_each_knob_has_its_own_knee_and_auto_is_told():
    points = mark_knees(
        [Point("a", "1", 1, 0.1), Point("a", "2", 2, 0.05, auto=True), Point("b", "x", 1, 0.2)]
    )
    lines = tradeoff_lines(points)
    assert len(lines) == 2
    assert "auto 2 (5.00 %, 2.00 s)" in lines[0]
    assert "knee x" in lines[1]


@pytest.mark.parametrize("turn", [FEW, FULL])
def test_each_knob_has_auto_among_its_settings_and_turns_alone(turn):
    settings = settings_of(3, turn)
    auto = Run(3)
    for knob in {knob for knob, *_ in settings}:
        mine = [(is_auto, run) for name, _, is_auto, run in settings if name == knob]
        assert [run for is_auto, run in mine if is_auto] == [auto]
        assert len({run for _, run in mine}) == len(mine) >= 2
    changed = {name: run for name, _, is_auto, run in settings if not is_auto}
    assert changed["order"].level == 3 and changed["order"].stride == 1
    assert changed["table or samples"].samples and changed["facet level"].order is None


def test_fewer_pixels_go_into_coarser_facets():
    """Half the pixels a side leave a quarter in a facet, as the next coarser level has it."""
    assert [coarser(4, stride) for stride in (1, 2, 4, 8)] == [4, 3, 2, 1]
    assert coarser(1, 8) == 1


def test_regressions_are_named():
    old = {
        "a": {"scene": "a", "error_70": 0.02, "seconds": 4.0},
        "b": {"scene": "b", "error_70": 0.02, "seconds": 4.0},
    }
    new = [
        {"scene": "a", "error_70": 0.021, "seconds": 4.5},
        {"scene": "b", "error_70": 0.03, "seconds": 9.0},
        {"scene": "c", "error_70": 0.5, "seconds": 1.0},
    ]
    found = regressions(old, new)
    assert [line.split(":")[0] for line in found] == ["b", "b"]
    assert "2.00 % before, 3.00 % now" in found[0]


def test_an_earlier_result_must_be_one(tmp_path):
    (tmp_path / "e.json").write_text(json.dumps({"scenes": [{"scene": "a", "error_70": 1, "seconds": 2.0}]}))
    assert load_scores(tmp_path / "e.json")["a"]["error_70"] == 1
    (tmp_path / "f.json").write_text("[]")
    for name in ("f.json", "none.json"):
        with pytest.raises(InputError):
            load_scores(tmp_path / name)


def test_the_suites_scenes_exist():
    assert {scene.name for scene in load_scenes((), quick=False)} == set(SUITE)
    assert set(QUICK) < set(SUITE)
    with pytest.raises(InputError, match="twice"):
        load_scenes(("example", "example"), quick=False)
    with pytest.raises(InputError, match="no such scene"):
        load_scenes(("exmaple",), quick=False)


def test_a_rendered_set_is_taken_from_the_cache_and_a_changed_scene_is_not(tmp_path, monkeypatch):
    made = []

    def render(scene, folder, workers, progress, foreign):
        made.append(scene.name)
        folder.mkdir(parents=True)
        (folder / "truth.json").write_text("{}")

    monkeypatch.setattr("photogonio.evaluate.scenes.synthesize", render)
    (scene,) = load_scenes(("example",), quick=False)
    places = {
        rendered(one, tmp_path, workers=1, reporter=Reporter(quiet=True))
        for one in (scene, scene, replace(scene, seed=5))
    }
    assert len(places) == len(made) == 2


def test_errors_of_calibration_against_a_truth_made_by_hand():
    turn = np.diag([1.0, -1.0, -1.0])
    pose = Pose(turn, np.array([0.0, 0.0, 500.0]))
    light = Light("L", "point", np.array([0.0, 310.0, 425.0]), np.zeros((3, 3)), "mirror balls")
    view = ViewSetup("s.png", light, pose, np.array([2.0e6]), np.zeros(1), "white patch")
    camera = Camera(np.array([[1010.0, 0, 0], [0, 1010.0, 0], [0, 0, 1]]), np.zeros(5), (10, 10))
    setup = Setup(camera, Sphere(np.array([0.0, 0.0, 25.0]), 25.0), (view,), "absolute", ("Y",))
    truth = {
        "camera": {"matrix": [[1000.0, 0, 0], [0, 1000.0, 0], [0, 0, 1]]},
        "radiance_scale": 0.5,
        "photos": [
            {
                "file": "s.png",
                "rotation": turn.tolist(),
                "translation": [3.0, 0.0, 496.0],
                "lights": [{"position": [0.0, 300.0, 425.0], "strength": [4.0e6]}],
                "sample_center": [0.0, 0.0, 25.0],
            }
        ],
    }
    found = calibration_error(setup, truth)
    assert found.focal == pytest.approx(0.01)
    assert found.camera == pytest.approx(5.0)
    # toward the lamp: atan(310 / 400) against atan(300 / 400)
    assert found.light == pytest.approx(np.degrees(np.arctan(0.775) - np.arctan(0.75)), rel=1e-9)
    assert found.light_place == pytest.approx(10 / 500)
    assert found.strength == pytest.approx(1 - 500**2 / (310**2 + 400**2), rel=1e-9)
    assert found.sample == 0.0
