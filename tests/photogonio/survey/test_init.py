"""A manifest of what photos show, to which photos can be added."""

import json

import cv2
import numpy as np
import pytest

from photogonio.calib.geometry.visibility import behind_ball
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.manifest.stub import stub_manifest
from photogonio.capture.photoset import Photo, Sphere
from photogonio.capture.target.layout import make_target
from photogonio.cli import main
from photogonio.survey.checker import Checker
from photogonio.survey.folder import SetFolder
from tests.drawn.boards import CAMERA, draw, looking_at

MIDDLE = np.array([48.0, 36.0, 0.0])
EYES = [np.array(eye) for eye in ([48.0, -90.0, 220.0], [160.0, 40.0, 210.0], [-60.0, 60.0, 200.0])]
BALL = Sphere(np.array([50.0, 33.0, 14.0]), 14.0)
SQUARE = 20.0 / 12.0  # what squares are taken for, over what they are


def photo(path, eye, *, ball):
    pose = looking_at(eye, MIDDLE)
    level = draw(CAMERA, pose, 0.003, 1)
    if ball:
        width, height = CAMERA.size
        x, y = np.meshgrid(np.arange(float(width)), np.arange(float(height)))
        rays = CAMERA.world_rays(pose, np.column_stack([x.ravel(), y.ravel()]))
        points = eye - (eye[2] / rays[:, 2])[:, None] * rays
        level[behind_ball(points, eye, BALL.center, BALL.radius).reshape(height, width)] = 0.35
    codes = np.round(np.clip(level, 0, 1) * 65535).astype(np.uint16)
    path.parent.mkdir(exist_ok=True)
    cv2.imwrite(str(path), np.repeat(codes[..., None], 3, axis=2))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("PHOTOGONIO_CACHE", "")
    photo(tmp_path / "set" / "b0.png", EYES[0], ball=False)
    for k, eye in enumerate(EYES):
        photo(tmp_path / "set" / f"s{k}.png", eye, ball=True)
    return tmp_path / "set"


def test_init_sees_board_roles_and_sample_and_adds_what_comes_later(folder, capsys, monkeypatch):
    assert main(["init", str(folder), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["photos"] == {"calibration": 1, "sample": 3}
    found = load_photoset(folder)
    assert found.board.squares == (8, 6) and found.board.square_length == 20.0
    np.testing.assert_allclose(found.sample.center, SQUARE * BALL.center, atol=SQUARE)
    text = (folder / "photoset.toml").read_text().replace("radius = ", "radius = 2")
    text = text.replace("\n", "\r\n")
    (folder / "photoset.toml").write_bytes(text.encode())
    assert main(["init", str(folder), "--quiet"]) == 0
    assert (folder / "photoset.toml").read_bytes() == text.encode()
    (folder / "late.png").write_bytes((folder / "s0.png").read_bytes())
    monkeypatch.setattr("photogonio.survey.recognise.find_sample", lambda *given: None)  # it was found above
    assert main(["init", str(folder), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["added"] == 1
    again = (folder / "photoset.toml").read_bytes().decode()
    assert (
        again.startswith(text) and again.count("\r\n") == again.count("\n") and again.count('"late.png"') == 1
    )


def test_places_of_the_sheet_where_nothing_may_lie_are_to_be_checked(folder):
    assert main(["target", "-o", str(folder / "sheet.pdf"), "--quiet"]) == 0
    manifest = folder / "photoset.toml"
    check = "# CHECK: [[mirror_ball]] and [[white_patch]]"
    for k, own in enumerate((False, True)):
        for name in ("b0.png", "s0.png", "s1.png", "s2.png"):
            (folder / name).unlink(missing_ok=True)
        (folder / f"dark{k}.png").write_bytes(
            cv2.imencode(".png", np.zeros((60, 80), np.uint16))[1].tobytes()
        )
        if own:
            text = manifest.read_text().split("[[photo]]")[0]
            manifest.write_text(
                "\n".join(line for line in text.splitlines() if not line.startswith("#")) + "\n"
            )
        assert main(["init", str(folder), "--quiet"]) == 0
        assert (check in manifest.read_text()) is not own


def test_a_photo_is_told_before_its_lamp_is_looked_for(folder, monkeypatch):
    checker = Checker.of(SetFolder.of(folder))
    order = []
    monkeypatch.setattr(Checker, "_lamp", lambda *given: order.append("lamp"))
    for k in range(2):
        checker.look(Photo(f"s{k}.png", "sample"), lambda one: order.append(one.photo.file))
    assert order == ["s0.png", "lamp", "lamp"]


def test_a_list_of_photos_is_left_as_it_is(tmp_path, monkeypatch, capsys):
    """TOML has no way to add a table to `photo = [...]`."""
    monkeypatch.setenv("PHOTOGONIO_CACHE", "")
    for name in ("a", "b"):
        cv2.imwrite(str(tmp_path / f"{name}.png"), np.zeros((40, 60, 3), np.uint8))
    text = 'photo = [{ file = "a.png", role = "sample" }]\n' + stub_manifest(make_target())
    (tmp_path / "photoset.toml").write_text(text)
    assert main(["init", str(tmp_path)]) == 2
    said = capsys.readouterr().err.strip()
    assert "photoset.toml: has photo or light as a list" in said and "\n" not in said
    assert (tmp_path / "photoset.toml").read_text() == text


def test_a_second_target_keeps_the_manifest(tmp_path, capsys):
    assert main(["target", "-o", str(tmp_path / "sheet.pdf")]) == 0
    manifest = tmp_path / "photoset.toml"
    manifest.write_text(manifest.read_text().replace("my-set", "mine"))
    assert main(["target", "-o", str(tmp_path / "sheet.pdf")]) == 0
    assert 'name = "mine"' in manifest.read_text()
    assert main(["target", "--paper", "a3", "-o", str(tmp_path / "other.pdf")]) == 2
    assert "another [board]" in capsys.readouterr().err and not (tmp_path / "other.pdf").exists()
