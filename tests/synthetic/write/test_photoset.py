"""Whole sets: readable by the manifest's own reader, true to their truth, the same for any number of workers."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.capture.errors import InputError
from photogonio.capture.files.exposure import stepped
from photogonio.capture.files.images import read_header
from photogonio.capture.manifest.load import load_photoset
from photogonio.compare.reflectances import load_known
from photogonio.synthetic.brdf.library import make_brdf, on_grid
from photogonio.synthetic.scene.hard_cases import changed, hard_case, hard_names
from photogonio.synthetic.scene.parts import BoardScene, MarkerScene
from photogonio.synthetic.scene.scene import built_in, load_scene
from photogonio.synthetic.write.photoset import synthesize

TINY = {"camera": {"size": (150, 100), "focal": 337.0, "calibration": 1}, "lamp": {"count": 3}}
# light that is thrown from one thing to another takes most of the time, and files are not about it
SMALL = {**TINY, "render": {"bounce": False, "near": 1, "edge": 2}}


@pytest.fixture(scope="module")
def example(tmp_path_factory):
    scene = changed(load_scene("example"), camera={"calibration": 1}, lamp={"count": 2})
    return synthesize(scene, tmp_path_factory.mktemp("sets") / "example", workers=2)


@pytest.mark.parametrize(
    ("name", "format"), [("phone-ball", "png"), ("phone-plane", "jpeg"), ("phone-plane", "heic")]
)
def test_same_bytes_for_any_number_of_workers(name, format, tmp_path):
    scene = changed(load_scene(name), **TINY, render={"near": 2, "edge": 2}, sensor={"format": format})
    one, two = (synthesize(scene, tmp_path / str(n), workers=n) for n in (1, 2))
    files = sorted(p.relative_to(one) for p in one.rglob("*") if p.is_file())
    assert len(files) == 6
    for file in files:
        assert (one / file).read_bytes() == (two / file).read_bytes(), file


def test_a_telephone_names_its_times_in_the_files_and_the_truth_has_the_true_ones(tmp_path):
    folder = synthesize(changed(load_scene("phone-plane"), **SMALL), tmp_path / "set")
    photoset = load_photoset(folder)
    truth = {p["file"]: p for p in json.loads((folder / "truth.json").read_text())["photos"]}
    headers = {p.file: read_header(folder / p.file) for p in photoset.photos}
    assert all(photo.exposure_time is None for photo in photoset.photos)
    named = {file: header.exposure for file, header in headers.items()}
    for file, meant in stepped(named)[0].items():  # names of thirds of a stop, undone
        assert meant.exposure_time == pytest.approx(truth[file]["exposure_time"], rel=1e-9)
    lit = [p for p in photoset.photos if p.role == "sample"]
    assert [headers[p.file].flash for p in lit] == [p.light == "flash" for p in lit] == [True, False, True]
    assert photoset.lights[0].attached_to == "camera" and photoset.lights[0].position is None


def test_progress_counts_every_photo(tmp_path):
    seen = []
    scene = changed(load_scene("room-ball"), **SMALL)
    folder = synthesize(scene, tmp_path / "set", progress=lambda done, total: seen.append((done, total)))
    photos = load_photoset(folder).photos
    assert {p.role for p in photos} == {"calibration", "dark", "ambient", "sample"}
    assert seen[-1] == (len(photos), len(photos)) and [d for d, _ in seen] == sorted(d for d, _ in seen)


@pytest.mark.parametrize("name", [*built_in(), *hard_names()])
def test_manifests_are_accepted(name, tmp_path):
    """Every manifest passes the reader's own check; files only have to be there."""
    import tomli_w

    from photogonio.synthetic.scene.plan import camera_of, plan
    from photogonio.synthetic.write.manifest import manifest_of

    scene = hard_case(name).scene if name in hard_names() else load_scene(name)
    shots = plan(scene)
    for shot in shots:
        (tmp_path / shot.file).parent.mkdir(exist_ok=True)
        (tmp_path / shot.file).touch()
    (tmp_path / "photoset.toml").write_text(tomli_w.dumps(manifest_of(scene, camera_of(scene), shots)))
    found = load_photoset(tmp_path)
    assert [p.file for p in found.photos] == [s.file for s in shots] and found.name == name


def test_board_corners_lie_where_the_truth_says(example):
    truth = json.loads((example / "truth.json").read_text())
    camera = Camera(
        *(np.array(truth["camera"][k]) for k in ("matrix", "distortion")), tuple(truth["camera"]["size"])
    )
    board = cv2.aruco.CharucoBoard(
        (9, 7), 20.0, 15.0, cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_250)
    )
    points = np.array(board.getChessboardCorners()) * [1, -1, -1] + [0, 140, 0]
    for photo in truth["photos"]:
        image = cv2.imread(str(example / photo["file"]), cv2.IMREAD_UNCHANGED).mean(axis=-1) / 65535
        seen = np.clip(255 * np.sqrt(image / 0.6), 0, 255).astype(np.uint8)
        corners, ids, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(seen)
        pose = Pose(np.array(photo["rotation"]), np.array(photo["translation"]))
        error = corners.reshape(-1, 2) - camera.project(pose, points[ids.ravel()])
        # OpenCV's corners err by some hundredths of a pixel; half a pixel would be a shifted convention
        assert len(ids) > 12 and np.abs(np.median(error, axis=0)).max() < 0.05
        assert np.sqrt(np.median(error**2)) < 0.08


@pytest.mark.parametrize("kind", ["aruco-grid", "markers"])
def test_other_boards_are_seen_too(kind, tmp_path):
    """Every marker of a grid, or loose ones turned on the page, found where the truth puts its corners."""
    turn, quad = np.array([[0.8, -0.6], [0.6, 0.8]]), np.array([[-12, 12], [12, 12], [12, -12], [-12, -12.0]])
    loose = {5: np.array([30.0, 30.0]) + quad, 9: np.array([120.0, 90.0]) + quad @ turn.T}
    grid = {
        r * 4 + c: np.array([20 + 40 * c, 100 - 40 * r]) + quad * 15 / 12 for r in range(3) for c in range(4)
    }
    corners = grid if kind == "aruco-grid" else loose
    board = BoardScene(
        kind=kind, dictionary="DICT_4X4_50", squares=None, square_length=None,
        markers=(4, 3) if kind == "aruco-grid" else None,
        marker_length=30.0, marker_separation=10.0 if kind == "aruco-grid" else None,
        marker=tuple(MarkerScene(k, tuple((*p, 0.0) for p in quad)) for k, quad in loose.items()),
    )  # fmt: skip
    if kind == "aruco-grid":
        corners = {k: quad - [5.0, 5.0] for k, quad in corners.items()}
    scene = changed(load_scene("example"), lamp={"count": 1}, camera={"calibration": 1})
    folder = synthesize(replace(scene, board=board), tmp_path / "set")
    assert load_photoset(folder).board.kind == kind
    truth = json.loads((folder / "truth.json").read_text())
    camera = Camera(
        *(np.array(truth["camera"][k]) for k in ("matrix", "distortion")), tuple(truth["camera"]["size"])
    )
    (photo,) = (p for p in truth["photos"] if p["role"] == "calibration")
    image = cv2.imread(str(folder / photo["file"]), cv2.IMREAD_UNCHANGED).mean(axis=-1) / 65535
    seen = np.clip(255 * np.sqrt(image / 0.6), 0, 255).astype(np.uint8)
    fine = cv2.aruco.DetectorParameters()
    fine.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50), fine)
    quads, ids, _ = detector.detectMarkers(seen)
    pose = Pose(np.array(photo["rotation"]), np.array(photo["translation"]))
    seen_ids = set(ids.ravel().tolist())  # a corner of the page may be out of the picture
    assert seen_ids <= set(corners) and len(seen_ids) >= min(len(corners), 9)
    for found, k in zip(quads, ids.ravel(), strict=True):
        expected = camera.project(pose, np.column_stack([corners[k], np.zeros(4)]))
        error = found.reshape(4, 2) - expected  # single corners are drawn inward by blur and tone, all alike
        assert np.abs(error.mean(axis=0)).max() < 0.15 and np.abs(error).max() < 0.8


def test_white_patch_has_the_radiance_that_the_truth_implies(example):
    """reflectance / pi I cos / d^2 seconds at the patch's middle, to the photon noise of 49 pixels."""
    truth = json.loads((example / "truth.json").read_text())
    camera = Camera(
        *(np.array(truth["camera"][k]) for k in ("matrix", "distortion")), tuple(truth["camera"]["size"])
    )
    middle = np.array([160.0, 20.0, 0.3])
    for photo in (p for p in truth["photos"] if p["role"] == "sample"):
        image = cv2.imread(str(example / photo["file"]), cv2.IMREAD_UNCHANGED)[..., ::-1] / 65535
        pose = Pose(np.array(photo["rotation"]), np.array(photo["translation"]))
        x, y = np.round(camera.project(pose, middle[None])[0]).astype(int)
        (light,) = photo["lights"]
        away = np.array(light["position"]) - middle
        d = np.linalg.norm(away)
        expected = 0.9 / np.pi * light["strength"][0] * away[2] / d**3 * photo["exposure_time"]
        noise = np.sqrt(expected / 20_000 / 49)
        found = image[y - 3 : y + 4, x - 3 : x + 4].mean(axis=(0, 1))
        assert found == pytest.approx(expected, abs=5 * noise + 2e-3 * expected)


def test_truth_holds_the_brdf_on_the_grid(example):
    brdf = json.loads((example / "truth.json").read_text())["brdf"]
    parameters = {k: v for k, v in brdf["model"].items() if k != "model"}
    axes = [np.radians(brdf["grid"][k]) for k in ("theta_i", "theta_r", "dphi")]
    assert [len(a) for a in axes] == [18, 18, 36]
    grid = np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")], axis=-1)
    model = make_brdf(brdf["model"]["model"], parameters)
    assert np.array(brdf["grid"]["values"]) == pytest.approx(on_grid(model, grid), rel=1e-6)


def test_a_brdf_from_a_file_is_kept_beside_the_truth(tmp_path):
    """A coefficient file of one channel, not isotropic: the truth is all of it, not the grid alone."""
    modes = {"modes": [[0, 0, 0, 0], [1, 1, 1, 1]], "coefficients": [[1.2], [0.3]], "symmetry": "reciprocal"}
    (tmp_path / "mine.json").write_text(json.dumps({"quantity": "brdf", **modes}))
    scene = changed(load_scene("example"), **SMALL, brdf={"file": "mine.json"})
    folder = synthesize(replace(scene, folder=str(tmp_path)), tmp_path / "set")
    (tmp_path / "mine.json").unlink()
    found = load_known(folder / "truth.json")
    incident, exit = np.array([[0.6, 0.0, 0.8]]), np.array([[0.0, 0.6, 0.8]])
    # docs/modes.md: Z_0^0 = 1 / sqrt(2 pi); Z_1^1 = sqrt(2) sqrt(2 / 2 pi) rho cos(phi), rho^2 = 1 - 0.8
    for i, r, both in ((incident, incident, 1.0), (incident, exit, 0.0)):
        expected = 1.2 / (2 * np.pi) + 0.3 * both * (2 / np.pi) * 0.2
        assert found.evaluate(i, r) == pytest.approx(np.full((1, 1), expected))
    assert not found.isotropic


def test_brackets_are_one_scene_at_several_times(tmp_path):
    scene = changed(load_scene("example"), **SMALL)
    scene = changed(scene, sensor={"brackets": (0.25, 1.0), "gain_electrons": 0.0})
    folder = synthesize(scene, tmp_path / "set")
    short, long = (cv2.imread(str(folder / f"sample/s001_{n}.png"), -1) / 65535 for n in (0, 1))
    below = long < 1
    assert long[below] == pytest.approx(4 * short[below], abs=2.5 / 65535)
    assert {p.bracket for p in load_photoset(folder).photos if p.role == "sample"} == {0, 1, 2}


def test_other_peoples_folders_are_left_alone(tmp_path):
    (tmp_path / "mine.txt").write_text("precious")
    with pytest.raises(InputError, match="is there already"):
        synthesize(changed(load_scene("example"), **SMALL), tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["mine.txt"]


def test_an_earlier_set_is_replaced_whole(tmp_path):
    scene = changed(load_scene("example"), **SMALL)
    folder = synthesize(scene, tmp_path / "set")
    synthesize(changed(scene, lamp={"count": 1}), folder)
    assert len(list(folder.rglob("s*.png"))) == 1 and len(list(tmp_path.iterdir())) == 1


def test_a_bad_brdf_leaves_nothing_behind(tmp_path):
    scene = changed(load_scene("example"), **SMALL, brdf={"model": "lambert", "colour": 1})
    with pytest.raises(InputError, match="colour"):
        synthesize(scene, tmp_path / "set")
    assert not list(tmp_path.iterdir())
