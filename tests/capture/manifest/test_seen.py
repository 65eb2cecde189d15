"""What photos show stands in a manifest that reads back as it was."""

import tomllib

import numpy as np

from photogonio.capture.manifest.entries import MANIFEST_KEYS
from photogonio.capture.manifest.schema import read_table
from photogonio.capture.manifest.seen import sample_lines, seen_manifest, with_sample
from photogonio.capture.manifest.stub import stub_manifest
from photogonio.capture.photoset import CharucoBoard, GridBoard, Plane, Sphere
from photogonio.capture.target.layout import make_target

BALL = Sphere(np.array([61.237, 40.5, 12.0]), 12.0)
FLAT = Plane(np.array([[10.0, 10], [50, 12], [48, 40], [9, 38]]), 0.5)


def read(text):
    return read_table(tomllib.loads(text), MANIFEST_KEYS, "x:")


def test_boards_and_samples_come_back():
    for board in (
        CharucoBoard("DICT_6X6_250", (5, 8), 20.0, 10.0, 3, True),
        GridBoard("DICT_5X5_250", (6, 5), 14.0, 6.0),
    ):
        text = seen_manifest(
            name='a "b"',
            board=board,
            sample=sample_lines(BALL),
            notes=["CHECK: this"],
            encoding="srgb",
            flash=True,
        )
        values = read(text)
        assert values["board"] == board and values["name"] == 'a "b"'
        np.testing.assert_allclose(values["sample"][0].center, BALL.center, atol=0.005)
        assert values["light"][0].attached_to == "camera"


def test_a_flat_piece_comes_back_with_its_doubts():
    text = sample_lines(FLAT, ["its outline"])
    assert text.startswith("# CHECK: its outline\n")
    found = read("format = 1\n" + text)["sample"][0]
    np.testing.assert_allclose(found.outline, FLAT.outline)


def test_the_example_of_a_stub_gives_way_and_what_somebody_wrote_stays():
    stub = stub_manifest(make_target())
    text = with_sample(stub, sample_lines(BALL))
    before, after = read(stub), read(text)
    assert after["sample"][0].radius == 12.0 and before["board"] == after["board"]
    assert len(before["mirror_ball"]) == len(after["mirror_ball"])
    assert with_sample(stub.replace("radius = 25.0", "radius = 24.0"), sample_lines(BALL)) is None
    assert with_sample("format = 1\n" + sample_lines(FLAT), sample_lines(BALL)) is None
