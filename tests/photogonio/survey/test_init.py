"""A manifest of what photos show, to which photos can be added."""

import json

import cv2
import numpy as np
import pytest
from PIL import Image

from photogonio.calib.geometry.visibility import behind_ball
from photogonio.calib.identify.quick_look import QuickLook
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.manifest.stub import stub_manifest
from photogonio.capture.photoset import Photo, Sphere
from photogonio.capture.target.layout import make_target
from photogonio.cli import main
from photogonio.survey.checker import Checker
from photogonio.survey.folder import SetFolder
from photogonio.survey.recognise import bracketed
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
        told = manifest.read_text()
        assert (check in told) is not own
        remarks = [line for line in told.splitlines() if line.startswith("#")]
        assert not any(line.endswith(("..", ":.")) for line in remarks)


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


def of_phone(folder, *, flash):
    """The folder's photos as a phone's JPEGs, every second one by its flash."""
    for k, path in enumerate(sorted(folder.glob("*.png"))):
        exif = Image.Exif()
        exif[0x010F], exif[0x0110] = "Maker", "Phone"
        exif.get_ifd(0x8769)[0x9209] = 1 if flash and k % 2 else 16
        codes = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)[..., 0].astype(float) / 65535
        Image.fromarray(np.round(255 * codes ** (1 / 2.2)).astype(np.uint8)).convert("RGB").save(
            path.with_suffix(".jpg"), quality=95, exif=exif
        )
        path.unlink()


@pytest.mark.parametrize("flash", [True, False])
def test_photos_beside_those_by_flash_have_lights_of_their_own(folder, flash):
    """A photo without a light's id is lit by the only light there is: it must not be the flash."""
    of_phone(folder, flash=flash)
    assert main(["init", str(folder), "--quiet"]) == 0
    found = load_photoset(folder)
    lights = {p.file: p.light for p in found.photos if p.role == "sample"}
    own = {"s0.jpg": "flash", "s1.jpg": "s1", "s2.jpg": "flash"}
    assert lights == (own if flash else dict.fromkeys(own))
    assert [light.id for light in found.lights] == (["flash"] if flash else [])
    assert found.radiometry.encoding == "unknown"  # a phone's own curve


def test_exposures_of_one_view_are_a_bracket_by_any_tone_curve():
    """Two exposures through a curve that no power is are one curve of each other; under another lamp they are not."""
    rng = np.random.default_rng(5)
    light = rng.uniform(0.02, 0.9, (60, 80)).cumsum(axis=1)
    light *= 0.9 / light.max()
    bend = lambda x: x**0.8 / (x**0.8 + 1.0)  # noqa: E731
    look = lambda x: QuickLook((80, 60), 0.9, 0.0, x.astype(np.float32), np.zeros(x.shape, bool), 1)  # noqa: E731
    photos = [Photo(f"{k}.jpg", "sample", None, time) for k, time in enumerate((0.02, 0.005, 0.005))]
    poses = dict.fromkeys([p.file for p in photos], looking_at(EYES[0], MIDDLE))
    other = 0.25 * light * np.linspace(0.6, 1.4, 60)[:, None]
    seen = {"0.jpg": look(bend(light)), "1.jpg": look(bend(0.25 * light)), "2.jpg": look(bend(other))}
    pair = lambda k: [p.bracket for p in bracketed([photos[0], photos[k]], poses, seen)]  # noqa: E731
    assert pair(1) == [1, 1] and pair(2) == [None, None]
