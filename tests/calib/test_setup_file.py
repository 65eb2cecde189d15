"""The setup's file gives back what was written, and is refused when it is not one."""

import json
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.setup import (
    BoardSetup,
    Falloff,
    LeftOut,
    Light,
    Marks,
    PrintTone,
    Setup,
    ViewSetup,
)
from photogonio.calib.setup_file import load_setup, save_setup
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import MirrorBall, Plane, Sphere


def view(name: str, rng: np.random.Generator, kind: str = "point", **more: object) -> ViewSetup:
    place = rng.normal(size=3)
    light = Light("lamp", kind, place / np.linalg.norm(place), rng.normal(size=(3, 3)), "mirror balls", 3.5)
    pose = Pose.from_rodrigues(rng.normal(size=3), rng.normal(size=3) / 3)
    return ViewSetup(name, light, pose, rng.random(3), rng.random(3), "white patch", **more)


def setup(sample: Sphere | Plane) -> Setup:
    rng = np.random.default_rng(5)
    marks = Marks(*(rng.normal(size=(n, 2)) for n in (4, 4, 0, 7, 2, 2)))
    full = view("sample/ä 1.png", rng, pose_rms=0.1, pose_covariance=rng.normal(size=(6, 6)), marks=marks)
    return Setup(
        camera=Camera(rng.normal(size=(3, 3)), rng.normal(size=5), (640, 480)),
        sample=sample,
        views=(full, view("b.png", rng, "directional", veil=rng.random(3), veil_error=rng.random(3))),
        scale="absolute",
        channels=("R", "G", "B"),
        left_out=(LeftOut("c.png", "no board"),),
        warnings=("a lamp is far",),
        residuals={"rms": 0.1 + 0.2, "names": ["a", "b"], "good": True},
        source={"program": "photogonio"},
        mirror_balls=(MirrorBall(rng.normal(size=3), 0.1 + 0.7),),
        boards=(BoardSetup("calibration/c.png", full.pose, 0.1 / 3, rng.normal(size=(6, 6)), marks),),
        ambient=rng.random(3),
        falloff=Falloff(rng.normal(size=2), rng.normal(size=(2, 2)), allowed=True),
        scale_error=0.1 / 3,
        tone=PrintTone(
            table=np.sort(rng.random((9, 3)), axis=0),
            error=rng.random((9, 3)),
            seen=np.array([0.1, 0.9]),
            ink=rng.random(3),
            misfit=0.1 / 7,
            photos=10,
            scale_error=0.1 / 9,
            lamps=("flash",),
            places=rng.normal(size=(1, 3)),
            covariance=rng.normal(size=(3, 3)),
            doubts=rng.normal(size=(2, 5, 3)),
            exposures={"a.png": 0.1 / 11},
        ),
    )


SAMPLES = [Sphere(np.array([0.1, 1 / 3, 7.0]), 7.1), Plane(np.array([[0.0, 0], [1, 0], [1, 1.1]]), 0.3)]


def same(a: object, b: object) -> None:
    """Equal to the last bit, NaN to NaN."""
    if is_dataclass(a):
        assert type(a) is type(b)
        for f in fields(a):
            same(getattr(a, f.name), getattr(b, f.name))
    elif isinstance(a, np.ndarray):
        np.testing.assert_array_equal(a, b)
        assert a.shape == b.shape
    elif isinstance(a, tuple):
        assert isinstance(b, tuple) and len(a) == len(b)
        for x, y in zip(a, b, strict=True):
            same(x, y)
    else:
        assert a == b or (a != a and b != b)


@pytest.mark.parametrize("sample", SAMPLES, ids=["sphere", "plane"])
def test_a_setup_comes_back_to_the_last_bit(tmp_path, sample):
    whole = setup(sample)
    save_setup(whole, tmp_path / "setup.json")
    same(whole, load_setup(tmp_path / "setup.json"))


def test_saving_what_was_loaded_writes_the_same_bytes_and_leaves_no_part(tmp_path):
    save_setup(setup(SAMPLES[0]), tmp_path / "one.json")
    save_setup(load_setup(tmp_path / "one.json"), tmp_path / "two.json")
    assert (tmp_path / "one.json").read_bytes() == (tmp_path / "two.json").read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["one.json", "two.json"]


def test_the_file_is_strict_json(tmp_path):
    save_setup(setup(SAMPLES[0]), tmp_path / "setup.json")

    def refuse(text: str) -> None:
        raise AssertionError(f"{text} is not JSON")

    json.loads((tmp_path / "setup.json").read_text(encoding="utf-8"), parse_constant=refuse)


@pytest.mark.parametrize(
    "content",
    [b"", b"not json", b"\xff\xfe\x00", b"[]", b"null", b"{}", b'{"format": "another"}'],
)
def test_what_is_no_setup_is_refused_by_name(tmp_path, content):
    path = tmp_path / "setup.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"setup\.json"):
        load_setup(path)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"nowhere\.json"):
        load_setup(tmp_path / "nowhere.json")


@pytest.mark.parametrize("key", ["camera", "sample", "views", "scale", "channels", "left_out"])
def test_a_setup_without_a_part_is_refused(tmp_path, key):
    path = tmp_path / "setup.json"
    save_setup(setup(SAMPLES[0]), path)
    data = json.loads(path.read_text(encoding="utf-8"))
    del data[key]
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(InputError, match=key):
        load_setup(path)


def test_a_covariance_of_another_shape_is_refused(tmp_path):
    path = tmp_path / "setup.json"
    save_setup(setup(SAMPLES[0]), path)
    data = json.loads(path.read_text(encoding="utf-8"))
    data["residuals"]["sample"] = {"covariance": [[1.0, 0.0], [0.0, 1.0]]}
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(InputError, match=r"residuals\.sample\.covariance"):
        load_setup(path)


def test_a_number_that_is_a_word_is_refused(tmp_path):
    path = tmp_path / "setup.json"
    save_setup(setup(SAMPLES[0]), path)
    data = json.loads(path.read_text(encoding="utf-8"))
    data["views"][0]["strength"] = ["bright", 1, 1]
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(InputError, match="bright"):
        load_setup(path)


def _without(data: dict[str, Any], key: str) -> None:
    del data[key]


@pytest.mark.parametrize(
    "spoil, named",
    [
        (lambda data: _without(data["tone"], "table"), "tone.table: is missing"),
        (lambda data: data.update(tone="curve"), "tone: is not what a setup has there"),
        (lambda data: data["tone"]["table"].reverse(), "tone.table: a tone curve that does not rise"),
        (lambda data: data["tone"]["exposures"].update(a=0.0), "tone.exposures: expected exposures above 0"),
        (
            lambda data: data["views"][1]["light"].update(radius="3 mm"),
            "views[1].light.radius: expected a number",
        ),
        (lambda data: data["camera"].update(size=[640]), "camera.size: expected numbers of shape (2,)"),
        (lambda data: data["boards"][0].update(marks=3), "boards[0].marks: "),
        (lambda data: data.update(source=["photogonio"]), "source: expected an object"),
    ],
)
def test_the_key_that_cannot_be_used_is_named(tmp_path, spoil, named):
    path = tmp_path / "setup.json"
    save_setup(setup(SAMPLES[0]), path)
    data = json.loads(path.read_text(encoding="utf-8"))
    spoil(data)
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(InputError) as told:
        load_setup(path)
    assert str(told.value).startswith(f"{path}: {named}")
