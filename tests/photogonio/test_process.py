"""``photogonio process`` on a tiny set of known answer, and on the same set spoilt in every way."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import OpenImageIO as oiio
import pytest

from photogonio import pipeline
from photogonio.cli import main
from photogonio.report import page
from tests.drawn.tiny_set import ALBEDO, HEIGHT, WIDTH, TinySet

FILES = [
    "coefficients.json",
    "coverage.png",
    "fit.png",
    "lobes.png",
    "report.html",
    "setup.json",
    "table.npz",
]
QUICK = ("--lobes", "none", "--order", "2")


@pytest.fixture
def plain_pictures(monkeypatch):
    """One pixel each, for tests that are not about pictures: drawing them takes most of a tiny set's time."""
    pixel = cv2.imencode(".png", np.zeros((1, 1, 3), np.uint8))[1].tobytes()
    drawn = tuple(page.Drawn(name, name, "", pixel) for name in ("coverage", "fit", "lobes"))
    monkeypatch.setattr(page, "draw_pictures", lambda result, *, source: drawn)


def process(capsys, folder: Path, out: Path, *options: str) -> tuple[int, str, str]:
    status = main(["process", str(folder), "-o", str(out), *options])
    return status, *capsys.readouterr()


def test_the_answer_is_the_balls_albedo(capsys, tmp_path, tiny_set: TinySet):
    status, out, err = process(capsys, tiny_set.folder, tmp_path / "out", *QUICK, "--json")
    assert status == 0, err
    numbers = json.loads(out)
    # photos are 3 x radiance + 0.001 of black, which adds about 0.5 % of a typical pixel
    np.testing.assert_allclose(numbers["albedo"], 3 * ALBEDO, rtol=0.01)
    assert numbers["scale"] == "relative"
    assert numbers["photos_used"] == 6
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == FILES
    setup = json.loads((tmp_path / "out/setup.json").read_text())
    assert setup["source"]["command"] == "photogonio process tiny --order 2 --lobes none"
    assert list(setup["source"]["inputs"]) == ["photoset.toml", "6 photos"]


@pytest.mark.usefixtures("plain_pictures")
def test_one_and_two_workers_give_the_same_bytes(capsys, tmp_path, tiny_set: TinySet, monkeypatch):
    monkeypatch.setenv("PHOTOGONIO_CACHE", "")
    for workers in ("1", "2"):
        assert process(capsys, tiny_set.folder, tmp_path / workers, *QUICK, "--workers", workers)[0] == 0
    for name in FILES:
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes(), name


@pytest.mark.usefixtures("plain_pictures")
def test_a_second_run_calibrates_and_reduces_nothing_and_gives_the_same_bytes(
    capsys, tmp_path, tiny_set: TinySet, monkeypatch
):
    assert process(capsys, tiny_set.folder, tmp_path / "plain", *QUICK)[0] == 0
    monkeypatch.setenv("PHOTOGONIO_CACHE", str(tmp_path / "kept"))
    _, first, _ = process(capsys, tiny_set.folder, tmp_path / "first", *QUICK)
    _, second, _ = process(capsys, tiny_set.folder, tmp_path / "second", *QUICK)
    assert "calibrated before" not in first and "calibrated before" in second
    assert "6 of 6 photos were reduced before" in second
    for name in FILES:
        plain = (tmp_path / "plain" / name).read_bytes()
        assert plain == (tmp_path / "first" / name).read_bytes() == (tmp_path / "second" / name).read_bytes()


@pytest.mark.usefixtures("plain_pictures")
@pytest.mark.parametrize("change", ["photo", "manifest"])
def test_a_changed_set_is_calibrated_anew(capsys, tmp_path, tiny_set: TinySet, monkeypatch, change):
    monkeypatch.setenv("PHOTOGONIO_CACHE", str(tmp_path / "kept"))
    process(capsys, tiny_set.folder, tmp_path / "first", *QUICK)
    if change == "photo":
        tiny_set.write("sample/s2.png", np.full((HEIGHT, WIDTH), 0.2))
    else:
        tiny_set.replace("radius = 25.0", "radius = 24.9")
    assert "calibrated before" not in process(capsys, tiny_set.folder, tmp_path / "second", *QUICK)[1]


@pytest.mark.usefixtures("plain_pictures")
def test_channels_are_obeyed_or_refused(capsys, tmp_path, tiny_set: TinySet):
    status, out, _ = process(capsys, tiny_set.folder, tmp_path / "g", *QUICK, "--channels", "G", "--json")
    assert (status, json.loads(out)["channels"]) == (0, ["G"])
    refused(capsys, tiny_set.folder, tmp_path / "x", "--channels", "X", said="--channels X")


def test_what_a_sphere_cannot_be_asked(capsys, tmp_path, tiny_set: TinySet):
    refused(capsys, tiny_set.folder, tmp_path / "x", "--symmetry", "general", said="sphere")
    refused(capsys, tiny_set.folder, tmp_path / "x", "--level", "9", said="--level 9")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--channels", "X"), "--channels X: expected some of"),
        (("--level", "7"), "--level 7"),
        (("--order", "99"), "--order 99"),
    ],
)
def test_what_no_photos_can_be_asked_is_refused_before_any_work(
    capsys, tmp_path, tiny_set: TinySet, monkeypatch, options, said
):
    monkeypatch.setattr(pipeline, "calibrated", lambda *words, **named: pytest.fail("calibrated first"))
    refused(capsys, tiny_set.folder, tmp_path / "x", *options, said=said)


@pytest.mark.parametrize("command", ["process", "compare"])
def test_results_are_not_written_among_photos(capsys, tiny_set: TinySet, command):
    before = sorted(tiny_set.folder.rglob("*"))
    words = [str(tiny_set.folder)] * (2 if command == "compare" else 1)
    status = main([command, *words, "-o", str(tiny_set.folder)])
    _, err = capsys.readouterr()
    assert (status, err.count("\n")) == (2, 1) and "is a photo set" in err
    assert sorted(tiny_set.folder.rglob("*")) == before


@pytest.mark.usefixtures("plain_pictures")
@pytest.mark.parametrize("spoil", ["truncated", "saturated", "black", "another size"])
def test_one_bad_photo_is_left_out_and_named(capsys, tmp_path, tiny_set: TinySet, spoil):
    path = tiny_set.folder / "sample/s3.png"
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if spoil == "truncated":
        path.write_bytes(path.read_bytes()[:2000])
    elif spoil == "another size":
        cv2.imwrite(str(path), image[:, : WIDTH // 2])
    else:
        cv2.imwrite(str(path), np.full_like(image, 65535 if spoil == "saturated" else 0))
    status, out, err = process(capsys, tiny_set.folder, tmp_path / "out", *QUICK, "--json")
    if spoil == "another size":  # one camera has one size: the set is refused
        assert status == 2
        assert "s3.png" in err
        return
    assert status == 0, err
    numbers = json.loads(out)
    assert [photo["photo"] for photo in numbers["left_out"]] == ["sample/s3.png"]
    assert numbers["photos_used"] == 5
    assert "s3.png" in err
    assert "s3.png" in (tmp_path / "out/report.html").read_text()


def refused(capsys, folder: Path, out: Path, *options: str, said: str) -> None:
    """Status 2, one line that says what and where, nothing written."""
    status, stdout, err = process(capsys, folder, out, *options, "--quiet")
    assert (status, stdout) == (2, "")
    assert err.count("\n") == 1
    assert said in err
    assert not out.exists()
    assert not list(out.parent.glob(".part*"))


def every_photo(image: Callable[[np.ndarray], np.ndarray]) -> Callable[[TinySet], None]:
    def spoil(tiny: TinySet) -> None:
        for name in tiny.photos:
            path = str(tiny.folder / name)
            cv2.imwrite(path, image(cv2.imread(path, cv2.IMREAD_UNCHANGED)))

    return spoil


def not_finite(tiny: TinySet) -> None:
    for name in tiny.photos:
        image = cv2.imread(str(tiny.folder / name), cv2.IMREAD_UNCHANGED).astype(np.float32) / 65535
        image[HEIGHT // 2] = np.nan
        written = tiny.folder / name.replace("png", "exr")
        out = oiio.ImageOutput.create(str(written))
        assert out.open(str(written), oiio.ImageSpec(WIDTH, HEIGHT, 3, "float"))
        assert out.write_image(image)
        out.close()
    tiny.replace(".png", ".exr")


def truncated(tiny: TinySet) -> None:
    for name in tiny.photos:
        path = tiny.folder / name
        path.write_bytes(path.read_bytes()[:1000])


def board_unseen(tiny: TinySet) -> None:
    tiny.manifest = tiny.manifest.split("[camera]")[0] + "[[light]]" + tiny.manifest.split("[[light]]", 1)[1]
    tiny.replace(
        "[sample]",
        '[board]\nkind = "charuco"\ndictionary = "DICT_5X5_250"\nsquares = [9, 7]\n'
        "square_length = 20.0\nmarker_length = 15.0\n[sample]",
    )


def no_light(tiny: TinySet) -> None:
    for k in range(6):
        tiny.manifest = tiny.manifest.replace(f'[[light]]\nid = "L{k}"', f'[[light]]\nid = "M{k}"')
    tiny.save()


REFUSALS: dict[str, tuple[Callable[[TinySet], None], str]] = {
    "misspelt key": (lambda t: t.replace("radius =", "raduis ="), "raduis"),
    "unknown table": (lambda t: t.replace("[sample]", "[filter]\nx = 1\n[sample]"), "filter"),
    "wrong type": (lambda t: t.replace("radius = 25.0", 'radius = "25"'), "radius"),
    "no TOML": (lambda t: t.replace("format = 1", "format = = 1"), "photoset.toml"),
    "no manifest": (lambda t: (t.folder / "photoset.toml").unlink(), "photogonio init"),
    "missing file": (lambda t: (t.folder / "sample/s2.png").unlink(), "s2.png"),
    "path leaves the folder": (lambda t: t.replace("sample/s2.png", "../s2.png"), "../s2.png"),
    "truncated images": (truncated, "s0.png"),
    "images of unequal size": (lambda t: t.write("sample/s2.png", np.full((30, 40), 0.1)), "s2.png"),
    "sample outside the picture": (
        lambda t: t.replace("center = [0, 0, 0]", "center = [400, 0, 0]"),
        "outside",
    ),
    "too few board corners": (board_unseen, "too few board corners"),
    "no usable light": (no_light, "light"),
    "every pixel saturated": (every_photo(lambda image: np.full_like(image, 65535)), "saturated"),
    "every pixel black": (every_photo(np.zeros_like), "black"),
    "pixels not finite": (not_finite, ".exr"),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_what_cannot_be_used_is_refused_in_one_line(capsys, tmp_path, tiny_set: TinySet, case):
    spoil, said = REFUSALS[case]
    spoil(tiny_set)
    refused(capsys, tiny_set.folder, tmp_path / "out", *QUICK, said=said)


@pytest.mark.usefixtures("plain_pictures")
def test_calibrate_alone_writes_the_same_setup(capsys, tmp_path, tiny_set: TinySet):
    assert main(["calibrate", str(tiny_set.folder), "-o", str(tmp_path / "setup.json"), "--json"]) == 0
    numbers = json.loads(capsys.readouterr().out)
    assert len(numbers["views"]) == 6
    assert process(capsys, tiny_set.folder, tmp_path / "out", *QUICK)[0] == 0
    alone, whole = (
        json.loads(path.read_text()) for path in (tmp_path / "setup.json", tmp_path / "out/setup.json")
    )
    told = alone["warnings"], alone["diagnoses"]
    assert set(told[0]) <= set(whole["warnings"]) and set(told[1]) <= set(whole["diagnoses"])
    for setup in (alone, whole):
        for key in ("source", "warnings", "diagnoses"):  # process tells of the fit too
            setup.pop(key)
    assert alone == whole


def test_what_is_told_stands_in_the_setup(capsys, tmp_path, tiny_set: TinySet):
    status, out, err = process(capsys, tiny_set.folder, tmp_path / "out", *QUICK, "--json")
    assert status == 0, err
    numbers, setup = json.loads(out), json.loads((tmp_path / "out/setup.json").read_text())
    assert numbers["warnings"] and setup["warnings"] == numbers["warnings"]
    assert list(setup["diagnoses"]) == list(numbers["diagnoses"])


def test_calibrate_says_how_sure_it_is_and_draws_every_photo(capsys, tmp_path, tiny_set: TinySet):
    out = tmp_path / "found.json"
    assert main(["calibrate", str(tiny_set.folder), "-o", str(out)]) == 0
    said = capsys.readouterr().out
    assert "camera: given" in said and "fx            400" in said
    assert said.count("L0: direction") == 1
    assert all(f"{photo}: board" in said for photo in tiny_set.photos)
    pictures = sorted(path.name for path in (tmp_path / "found-photos").iterdir())
    assert pictures == sorted(photo.replace("/", "-") + ".jpg" for photo in tiny_set.photos)
    drawn = cv2.imread(str(tmp_path / "found-photos" / pictures[0])).astype(int)
    assert drawn.shape == (HEIGHT, WIDTH, 3)
    ring = (
        400.0 * 25.0 / np.sqrt(200.0**2 - 25.0**2)
    )  # of the ball's outline about the picture's middle, pixels
    x, y = round((WIDTH - 1) / 2 + ring), round((HEIGHT - 1) / 2)
    blue, _, red = drawn[y, x - 1 : x + 2].max(0)
    assert blue > red + 60  # the sample's outline is blue, the photo gray
