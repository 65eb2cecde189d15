"""photoset.toml: everything docs/photoset.md allows is read, everything else refused with one line."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.photoset import Plane, Sphere

FULL = """
format = 1
name = "blue-ceramic"
length_unit = "cm"
[board]
kind = "charuco"
dictionary = "DICT_5X5_250"
squares = [9, 7]
square_length = 20.0
marker_length = 15
first_id = 3
legacy_pattern = true
[sample]
shape = "plane"
outline = [[0, 0], [10, 0], [10, 5], [0, 5]]
height = 0.5
symmetry = "general"
[[mirror_ball]]
center = [15.0, 15.0, 8.0]
radius = 8.0
[[mirror_ball]]
center = [1, 2, 3]
radius = 4
[[white_patch]]
outline = [[150, 10], [170, 10], [170, 30], [150, 30]]
height = 0.25
reflectance = [0.92, 0.92, 0.91]
[[white_patch]]
outline = [[0, 0], [1, 0], [0, 1]]
reflectance = 0.5
[radiometry]
encoding = "gamma"
gamma = 2.2
black_level = 0.01
white_level = 0.99
gain_electrons = 20000
read_noise_electrons = 5
vignetting = "cos4"
demosaic = "ahd"
[camera]
matrix = [[1000, 0, 320], [0, 1001, 240], [0, 0, 1]]
distortion = [0.1, -0.2, 0, 0, 0.3]
rotation = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
translation = [1, 2, 3]
fixed = true
[[light]]
id = "L01"
kind = "point"
position = [1, 2, 3]
intensity = 2
radius = 8.0
[[light]]
id = "L02"
direction = [0, 3, 4]
[[light]]
id = "flash"
attached_to = "camera"
markers = { ids = [40, 41], size = 10 }
[[photo]]
file = "a.png"
role = "calibration"
[[photo]]
file = "sub/b.png"
role = "sample"
light = "L01"
exposure_time = 0.02
f_number = 8
iso = 200
bracket = 3
[[photo]]
file = "c.png"
role = "sample"
light = "L01"
bracket = 3
[[photo]]
file = "c.png"
role = "ambient"
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "set" / "sub").mkdir(parents=True)
    for name in ("a.png", "sub/b.png", "c.png"):
        (tmp_path / "set" / name).write_bytes(b"not looked at")
    (tmp_path / "outside.png").write_bytes(b"")
    return tmp_path / "set"


def write(folder, text):
    (folder / "photoset.toml").write_text(text, encoding="utf-8")
    return folder


def test_every_key_is_read(folder):
    found = load_photoset(write(folder, FULL))
    assert (found.name, found.length_unit, found.symmetry) == ("blue-ceramic", "cm", "general")
    assert (found.board.squares, found.board.marker_length, found.board.first_id) == ((9, 7), 15.0, 3)
    assert found.board.legacy_pattern and isinstance(found.sample, Plane) and found.sample.height == 0.5
    assert [ball.radius for ball in found.mirror_balls] == [8.0, 4.0]
    assert [patch.reflectance for patch in found.white_patches] == [(0.92, 0.92, 0.91), (0.5,)]
    assert found.white_patches[1].height == 0.0
    assert (found.radiometry.gamma, found.radiometry.demosaic) == (2.2, "ahd")
    assert found.camera.fixed and found.camera.matrix[1, 1] == 1001 and len(found.camera.distortion) == 5
    point, distant, flash = found.lights
    assert point.intensity == (2.0,) and point.position.tolist() == [1, 2, 3]
    assert distant.kind is None and distant.direction.tolist() == [0, 0.6, 0.8]
    assert flash.marker_ids == (40, 41) and flash.markers == {"size": 10}
    assert [photo.iso for photo in found.photos] == [None, 200.0, None, None]
    assert [[photo.file for photo in view.photos] for view in found.views("sample")] == [
        ["sub/b.png", "c.png"]
    ]


def test_defaults(folder):
    text = """format = 1
[sample]
shape = "sphere"
center = [0, 0, 1]
radius = 1
[board]
kind = "aruco-grid"
dictionary = "DICT_4X4_50"
markers = [5, 7]
marker_length = 4
marker_separation = 1
[[photo]]
file = "a.png"
role = "sample"
"""
    found = load_photoset(write(folder, text) / "photoset.toml")  # the file is as good as its folder
    assert (found.name, found.length_unit, found.symmetry) == ("set", "mm", "auto")
    assert isinstance(found.sample, Sphere) and found.lights == () and found.camera.matrix is None
    assert (found.radiometry.encoding, found.radiometry.vignetting) == ("auto", "auto")


def test_loose_markers_are_read(folder):
    board = """[board]
kind = "markers"
dictionary = "DICT_4X4_50"
[[board.marker]]
id = 7
corners = [[0, 1, 0], [1, 1, 0], [1, 0, 0], [0, 0, 0]]
"""
    found = load_photoset(write(folder, swapped("[board]", board, whole=True)))
    ((number, corners),) = found.board.marker_corners
    assert number == 7 and corners.shape == (4, 3)


def swapped(old, new, *, whole=False):
    """The full manifest with one line, or one whole table, replaced."""
    if not whole:
        assert FULL.count(old) >= 1
        return FULL.replace(old, new, 1)
    start = FULL.index(old)
    end = FULL.index("\n[", start + 1) + 1
    return FULL[:start] + new + FULL[end:]


BROKEN = {  # what to replace, by what, what the message says
    "misspelt key": (
        "square_length = 20.0",
        "square_lenght = 20.0",
        ["board:", "square_lenght", "square_length"],
    ),
    "unknown table": ("[camera]", "[cammera]", ["cammera", "did you mean 'camera'"]),
    "unknown key": ("fixed = true", "zoom = 3", ["zoom", "camera"]),
    "not TOML": ('name = "blue-ceramic"', 'name = "blue', ["not valid TOML", "line 3"]),
    "no format": ("format = 1", "", ["'format' is required"]),
    "later format": ("format = 1", "format = 2", ["format", "found 2"]),
    "no sample shape": ('shape = "plane"', "", ["sample", "'shape' is required"]),
    "sphere without radius": ('shape = "plane"', 'shape = "sphere"', ["sample", "'center'"]),
    "plane with a radius": ("height = 0.5", "radius = 1", ["radius", 'shape = "plane"']),
    "unknown shape": ('shape = "plane"', 'shape = "plan"', ["did you mean 'plane'"]),
    "wrong type": (
        "square_length = 20.0",
        'square_length = "20"',
        ["square_length", "expected a number", "'20'"],
    ),
    "boolean for number": (
        "square_length = 20.0",
        "square_length = true",
        ["square_length", "expected a number"],
    ),
    "wrong length": (
        "center = [1, 2, 3]",
        "center = [1, 2]",
        ["mirror_ball[1]", "center", "3 finite numbers"],
    ),
    "ragged": ("outline = [[0, 0], [1, 0], [0, 1]]", "outline = [[0, 0], [1], [0, 1]]", ["outline", "n x 2"]),
    "not finite": ("center = [1, 2, 3]", "center = [1, nan, 3]", ["center", "finite"]),
    "infinite": ("radius = 4", "radius = inf", ["radius", "finite"]),
    "out of range": ("radius = 4", "radius = -4", ["mirror_ball[1]", "radius", "above 0", "-4"]),
    "percent": ("reflectance = 0.5", "reflectance = 92", ["reflectance", "at most 1.5"]),
    "concave outline": (
        "outline = [[0, 0], [1, 0], [0, 1]]",
        "outline = [[0, 0], [4, 0], [1, 1], [0, 4]]",
        ["outline", "convex"],
    ),
    "star": (
        "outline = [[0, 0], [1, 0], [0, 1]]",
        "outline = [[0, 3], [2, -3], [-3, 1], [3, 1], [-2, -3]]",
        ["outline", "convex"],
    ),
    "unknown dictionary": ('"DICT_5X5_250"', '"DICT_5X5_25"', ["dictionary", "did you mean 'DICT_5X5_250'"]),
    "dictionary too small": ("first_id = 3", "first_id = 240", ["board", "marker 270", "249"]),
    "marker as large as a square": ("marker_length = 15", "marker_length = 20", ["marker_length"]),
    "gamma missing": ("gamma = 2.2", "", ["radiometry", "gamma"]),
    "levels crossed": ("white_level = 0.99", "white_level = 0.005", ["white_level", "black_level"]),
    "flat without photos": ('vignetting = "cos4"', 'vignetting = "flat"', ["vignetting", '"flat"']),
    "no such paper": ('vignetting = "cos4"', 'paper = "ofice"', ["paper", "did you mean 'office'"]),
    "skew": ("[[1000, 0, 320]", "[[1000, 5, 320]", ["matrix", "fx, 0, cx"]),
    "mirrored": ("[[0, -1, 0], [1, 0, 0], [0, 0, 1]]", "[[0, 1, 0], [1, 0, 0], [0, 0, 1]]", ["rotation"]),
    "rotation alone": ("translation = [1, 2, 3]", "", ["rotation needs translation"]),
    "distortion of a strange length": ("[0.1, -0.2, 0, 0, 0.3]", "[0.1, -0.2, 0]", ["distortion", "found 3"]),
    "light twice": ('id = "L02"', 'id = "L01"', ["light[1]", '"L01" is used twice']),
    "point with direction": (
        "position = [1, 2, 3]",
        "direction = [1, 2, 3]",
        ["direction", 'kind = "point"'],
    ),
    "no direction": ("direction = [0, 3, 4]", "direction = [0, 0, 0]", ["direction", "length"]),
    "photo twice": (
        'file = "a.png"\nrole = "calibration"',
        'file = "c.png"\nrole = "sample"',
        ["named twice"],
    ),
    "unknown role": ('role = "ambient"', 'role = "ambiant"', ["photo[3]", "did you mean 'ambient'"]),
    "missing file": ('file = "a.png"', 'file = "z.png"', ["photo[0]", "no such file", '"z.png"']),
    "backslash": ('file = "sub/b.png"', 'file = "sub\\\\b.png"', ["photo[1]", "forward slashes"]),
    "absolute path": ('file = "a.png"', 'file = "/etc/hostname"', ["photo[0]", "relative"]),
    "drive": ('file = "a.png"', 'file = "C:/a.png"', ["photo[0]", "relative"]),
    "leaves the folder": ('file = "a.png"', 'file = "../outside.png"', ["photo[0]", "leaves the folder"]),
    "a folder": ('file = "a.png"', 'file = "sub"', ["photo[0]", "no such file"]),
    "a name too long for a file": ('file = "a.png"', f'file = "{"z" * 5000}"', ["photo[0]", "no such file"]),
    "bracket of two lights": (
        'light = "L01"\nbracket = 3',
        'light = "L02"\nbracket = 3',
        ["bracket 3", "L02"],
    ),
    "exposure": ("exposure_time = 0.02", "exposure_time = 0", ["photo[1]", "exposure_time"]),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_manifests_are_refused_in_one_line(folder, case):
    old, new, said = BROKEN[case]
    with pytest.raises(InputError) as caught:
        load_photoset(write(folder, swapped(old, new)))
    message = str(caught.value)
    assert "\n" not in message and str(folder) in message and len(message) < 400
    for piece in said:
        assert piece in message


def test_unknown_encoding_needs_brackets_or_a_printed_board(folder):
    text = FULL.replace('encoding = "gamma"\ngamma = 2.2', 'encoding = "unknown"').replace("bracket = 3", "")
    assert load_photoset(write(folder, text)).radiometry.encoding == "unknown"
    bare = swapped("[board]", "", whole=True)
    bare = bare.replace('encoding = "gamma"\ngamma = 2.2', 'encoding = "unknown"').replace("bracket = 3", "")
    with pytest.raises(InputError, match="bracket"):
        load_photoset(write(folder, bare))


def test_a_kind_of_paper_needs_a_board_that_is_printed_on_it(folder):
    with_paper = ('vignetting = "cos4"', 'vignetting = "cos4"\npaper = "recycled"')
    assert load_photoset(write(folder, FULL.replace(*with_paper))).radiometry.paper == "recycled"
    with pytest.raises(InputError, match="paper: says what the"):
        load_photoset(write(folder, swapped("[board]", "", whole=True).replace(*with_paper)))


def test_no_board_needs_a_camera_with_a_pose(folder):
    text = swapped("[board]", "", whole=True)
    load_photoset(write(folder, text))
    without_pose = "\n".join(
        line for line in text.splitlines() if not line.startswith(("rotation", "translation"))
    )
    with pytest.raises(InputError, match=r"without \[board\]"):
        load_photoset(write(folder, without_pose))


def test_links_may_not_leave_the_folder(folder):
    (folder / "a.png").unlink()
    (folder / "a.png").symlink_to(folder / "c.png")
    load_photoset(write(folder, FULL))
    (folder / "a.png").unlink()
    (folder / "a.png").symlink_to(folder.parent / "outside.png")
    with pytest.raises(InputError, match="leaves the folder"):
        load_photoset(folder)
    (folder / "a.png").unlink()
    (folder / "a.png").symlink_to(folder / "a.png")
    with pytest.raises(InputError, match=r"photo\[0\] file: .*(leads to itself|no such file)"):
        load_photoset(folder)
    (folder / "a.png").unlink()
    (folder / "door").symlink_to(folder.parent)
    with pytest.raises(InputError, match="leaves the folder"):
        load_photoset(write(folder, swapped('file = "a.png"', 'file = "door/outside.png"')))


def test_a_folder_without_manifest_says_how_to_make_one(tmp_path):
    with pytest.raises(InputError, match=r"photogonio init .*photogonio target"):
        load_photoset(tmp_path)
    with pytest.raises(InputError, match="no such folder"):
        load_photoset(tmp_path / "nowhere")
    with pytest.raises(InputError, match="not UTF-8"):
        (tmp_path / "photoset.toml").write_bytes(b'name = "\xff"')
        load_photoset(tmp_path)


def test_no_photos_says_what_to_do(folder):
    text = FULL[: FULL.index("[[photo]]")]
    with pytest.raises(InputError, match="photogonio init"):
        load_photoset(write(folder, text))


@pytest.mark.parametrize("name", ["uw-gray-sphere", "traced-eggshell-ball", "traced-green-plane"])
def test_real_sets_load(shared, name):
    found = load_photoset(shared / "data" / name)
    assert found.name == name and len(found.views("sample")) >= 12
    assert np.isfinite([ball.radius for ball in found.mirror_balls]).all()
