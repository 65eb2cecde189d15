"""Every reader of files, with small valid files to make wrong."""

from __future__ import annotations

import json
import random
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import OpenImageIO as oiio

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.setup import LeftOut, Light, Setup, ViewSetup
from photogonio.calib.setup_file import load_setup, save_setup, setup_document
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import read_header, read_image
from photogonio.capture.manifest.draft import manifest_text
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.photoset import MANIFEST, Sphere
from photogonio.cli import main
from photogonio.compare.reflectances import load_known
from photogonio.evaluate.history import load_scores
from photogonio.evaluate.truth import load_truth
from photogonio.options import Choice, Options
from photogonio.pipeline import process
from photogonio.reconstruct.brdf.brdf import Brdf, load_brdf
from photogonio.reconstruct.export.formats import find_format
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.goniometer.told import Told
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.cells import cells_of
from photogonio.reconstruct.table.facet_table import FacetTable, accumulate
from photogonio.reconstruct.table.facets import facet_index
from photogonio.reconstruct.table.table_file import save_table
from photogonio.run.circumstances import Circumstances, packed
from photogonio.run.surroundings import Shown
from photogonio.run.tables import read_table
from photogonio.synthetic.brdf.files import read_brdf
from photogonio.synthetic.brdf.library import make_brdf, on_grid
from photogonio.synthetic.render.world import brdf_of
from photogonio.synthetic.scene.plan import camera_of, plan
from photogonio.synthetic.scene.scene import SCENES, load_scene
from photogonio.synthetic.write.manifest import manifest_of
from photogonio.synthetic.write.truth import truth_of
from photogonio.system.progress import Reporter
from photogonio.tabulated import fit
from tests.drawn.tiny_set import TinySet
from tests.fuzz import mutations as by
from tests.fuzz.harness import Target

Ways = list[Callable[[random.Random], bytes]]
INCIDENT, EXIT = np.array([[0.6, 0.0, 0.8]]), np.array([[0.0, 0.6, 0.8]])
RICH = """
format = 1
name = "rich"
[board]
kind = "charuco"
dictionary = "DICT_5X5_250"
squares = [9, 7]
square_length = 20.0
marker_length = 15.0
[sample]
shape = "plane"
outline = [[20, 20], [60, 20], [60, 50], [20, 50]]
height = 0.5
[[mirror_ball]]
center = [10.0, 10.0, 8.0]
radius = 8.0
[[white_patch]]
outline = [[150, 10], [170, 10], [170, 30], [150, 30]]
reflectance = [0.9, 0.9, 0.8]
[radiometry]
encoding = "linear"
gain_electrons = 20000.0
read_noise_electrons = 5.0
black_level = 0.01
white_level = 0.9
vignetting = "none"
[camera]
matrix = [[700, 0, 300], [0, 700, 200], [0, 0, 1]]
distortion = [0.1, 0, 0, 0, 0]
[[light]]
id = "L0"
kind = "point"
position = [100, 100, 300]
radius = 7.0
intensity = [1.0, 1.0, 1.0]
[[light]]
id = "L1"
markers = { ids = [200, 201] }
[[photo]]
file = "sample/s0.png"
role = "sample"
light = "L0"
exposure_time = 0.02
f_number = 8.0
iso = 100
bracket = 1
[[photo]]
file = "sample/s1.png"
role = "calibration"
"""


def document_ways(document: Any, write: Callable[[Any, random.Random], bytes], plain: bytes) -> Ways:
    return [
        lambda rng: write(document, rng),
        lambda rng: write(document, rng),
        lambda rng: by.of_bytes(plain, rng),
    ]


def manifest(folder: Path) -> Ways:
    first = TinySet(folder).manifest
    ways: Ways = []
    for text in (first, RICH):
        ways += document_ways(tomllib.loads(text), by.as_toml, text.encode())
    return ways


def read_manifest(path: Path) -> None:
    load_photoset(path.parent)


def read_draft(path: Path) -> None:
    manifest_text(path.parent)


def scene(folder: Path) -> Ways:
    texts = [path.read_text() for path in sorted(SCENES.glob("*.toml"))]
    ways: Ways = []
    for text in texts:
        ways += document_ways(tomllib.loads(text), by.as_toml, text.encode())
    return ways


def small_setup() -> Setup:
    pose = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 500.0]))
    lamp = Light("L", "point", np.array([100.0, 0, 300]), np.eye(3), "given", radius=7.0)
    view = ViewSetup("s0.png", lamp, pose, np.ones(3), np.full(3, 0.01), "white patch", pose_rms=0.2)
    camera = Camera(np.array([[900.0, 0, 400], [0, 900, 300], [0, 0, 1]]), np.zeros(5), (800, 600))
    left = (LeftOut("s1.png", "no board"),)
    return Setup(camera, Sphere(np.array([0.0, 0, 25]), 25.0), (view,), "absolute", ("R", "G", "B"), left)


def setup(folder: Path) -> Ways:
    document = setup_document(small_setup())
    return document_ways(document, by.as_json, json.dumps(document).encode())


def read_setup(path: Path) -> None:
    save_setup(load_setup(path), path)


def coefficients(folder: Path) -> Ways:
    ways: Ways = []
    for symmetry, modes in (
        ("isotropic", [[0, 0, 0], [1, 1, 1], [2, 0, 0]]),
        ("general", [[0, 0, 0, 0], [1, 1, 1, -1], [2, 0, 0, 0]]),
    ):
        brdf = Brdf(
            2, ("R", "G"), np.array(modes), np.full((3, 2), 0.1), np.full((3, 2), 0.01), symmetry=symmetry
        )
        brdf.save(folder / "coefficients.json")
        document = json.loads((folder / "coefficients.json").read_text())
        for version in (document["version"], 1):
            lobes = [{"model": "ggx", "roughness": 0.2, "f0": [0.04, 0.05], "weight": [1.0, 0.5]}]
            changed = document | {"version": version, "lobes": lobes if version == 1 else document["lobes"]}
            changed |= {"valid": {"theta_i_max": 70.0, "theta_r_max": 70.0}}
            ways += document_ways(changed, by.as_json, json.dumps(changed).encode())
    return ways


def read_coefficients(path: Path) -> None:
    brdf = load_brdf(path)
    brdf(INCIDENT, EXIT)
    brdf.directional_albedo(0.3)


def read_expansion(path: Path) -> None:
    read_brdf(path)(INCIDENT, EXIT)


def small_table(level: int = 2) -> FacetTable:
    rng = np.random.default_rng(0)
    theta, phi = rng.uniform(0.1, 1.2, (2, 240)), rng.uniform(0, 6.28, (2, 240))
    incident, exit = unit_vectors(theta[0], 0 * phi[0]), unit_vectors(theta[1], phi[1])
    value = 0.1 * (1 + 0.02 * rng.normal(size=(240, 3)))
    return accumulate(
        level=level,
        channels=("R", "G", "B"),
        name="s0.png",
        isotropic=True,
        facet_i=facet_index(incident, level),
        facet_r=facet_index(exit, level),
        incident=incident,
        exit=exit,
        place=np.array([0.0, 0, 25]) + 25.0 * incident,
        omega=np.ones(240),
        value=value,
        variance=(0.02 * value) ** 2,
    )


def table(folder: Path) -> Ways:
    known = Circumstances(
        name="set",
        setup=small_setup(),
        shown=Shown((None,), {"s0.png": 0.3}, True, None, "nobody knows"),
        symmetry="isotropic",
        level=Choice("facet level", "2", "asked for"),
        left_out=(LeftOut("s1.png", "black"),),
    )
    path = folder / "table.npz"
    save_table(small_table(), path, source='{"scale": "absolute"}', beside=packed(known))
    with np.load(path) as file:
        arrays = dict(file)
    plain = path.read_bytes()
    return [*2 * [lambda rng: by.as_npz(arrays, rng)], lambda rng: by.of_bytes(plain, rng)]


def read_facets(path: Path) -> None:
    read = read_table(path, Options(), Told(), Reporter(quiet=True))
    if len(read.table):
        cells_of(read.table)


def fit_facets(path: Path) -> None:
    fit(path, None, Options(order=1, lobes=0, workers=1))


def grid(folder: Path) -> Ways:
    axes = np.radians([10.0, 40.0, 70.0]), np.radians([10.0, 50.0, 70.0]), np.radians([0.0, 90.0, 180.0])
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    arrays = {"grid": nodes, "brdf": on_grid(make_brdf("lambert", {"albedo": (0.5, 0.4, 0.3)}), nodes)}
    path = folder / "grid.npz"
    np.savez(path, **arrays)
    plain = path.read_bytes()
    return [*2 * [lambda rng: by.as_npz(arrays, rng)], lambda rng: by.of_bytes(plain, rng)]


def read_both(path: Path) -> None:
    """For comparing, and for rendering."""
    known = load_known(path)
    if known.evaluate is not None:
        known.evaluate(INCIDENT, EXIT)
    if path.suffix == ".npz":
        read_brdf(path)(INCIDENT, EXIT)


def truth(folder: Path) -> Ways:
    middle = [15.0, 45.0, 75.0]
    photo = {
        "file": "s0.png",
        "role": "sample",
        "rotation": np.eye(3).tolist(),
        "translation": [0.0, 0.0, 500.0],
        "exposure_time": 0.02,
        "lights": [
            {
                "id": "L",
                "kind": "point",
                "position": [0.0, 0.0, 300.0],
                "radius": 7.0,
                "strength": [1.0, 1.0, 1.0],
            }
        ],
        "sample_center": [0.0, 0.0, 25.0],
    }
    values = np.full((27, 3), 0.1).tolist()
    ways: Ways = []
    for model in ({"model": "plastic", "albedo": [0.5, 0.4, 0.3], "roughness": 0.2}, {"file": "gone.csv"}):
        document = {
            "format": "photogonio-truth",
            "version": 1,
            "camera": {"matrix": np.eye(3).tolist(), "distortion": [0.0] * 5, "size": [800, 600]},
            "radiance_scale": 1.0,
            "ambient": [0.0, 0.0, 0.0],
            "photos": [photo, photo | {"file": "s1.png"}],
            "brdf": {
                "model": model,
                "isotropic": True,
                "reciprocal": True,
                "grid": {"theta_i": middle, "theta_r": middle, "dphi": [30.0, 90.0, 150.0], "values": values},
            },
        }
        ways += document_ways(document, by.as_json, json.dumps(document).encode())
    return ways


def read_truth(path: Path) -> None:
    load_truth(path.parent)


def scores(folder: Path) -> Ways:
    document = {"scenes": [{"scene": "example", "error_70": 0.004, "seconds": 3.0}]}
    return document_ways(document, by.as_json, json.dumps(document).encode())


def rows(folder: Path) -> Ways:
    angles = np.stack(np.meshgrid([0, 30, 60], [0], [0, 30, 60], [0, 90, 180]), -1).reshape(-1, 4)
    lines = ["theta_i,phi_i,theta_r,phi_r,value"]
    lines += [",".join(map(str, row)) + ",0.1" for row in angles.tolist()]
    text = ("\n".join(lines) + "\n").encode()
    return [*2 * [lambda rng: by.of_lines(text, rng)], lambda rng: by.of_bytes(text, rng)]


def read_rows(path: Path) -> None:
    read_samples(path, Told())


def render_rows(path: Path) -> None:
    read_brdf(path)(INCIDENT, EXIT)


def image(suffix: str) -> Callable[[Path], Ways]:
    def make(folder: Path) -> Ways:
        rng = np.random.default_rng(0)
        pixels = rng.integers(0, 60000, (12, 16, 3)).astype(np.uint16)
        path = folder / f"photo{suffix}"
        if suffix == ".exr":
            spec = oiio.ImageSpec(16, 12, 3, "half")
            out = oiio.ImageOutput.create(str(path))
            out.open(str(path), spec)
            out.write_image((pixels / 60000).astype(np.float32))
            out.close()
        else:
            eight = suffix in (".jpg", ".webp")
            cv2.imwrite(str(path), (pixels >> 8).astype(np.uint8) if eight else pixels)
        plain = path.read_bytes()
        return [lambda rng: by.of_bytes(plain, rng)]

    return make


def read_photo(path: Path) -> None:
    try:
        read_header(path)
    except InputError:
        pass
    read_image(path)


def exported(form: str, file: str) -> Callable[[Path], Ways]:
    """What is exported and can be compared again."""

    def make(folder: Path) -> Ways:
        modes = np.array([[0, 0, 0], [1, 1, 1], [2, 0, 0]])
        count = 1 if form == "scatmech" else 3
        brdf = Brdf(2, ("R", "G", "B")[:count], modes, np.full((3, count), 0.1), np.full((3, count), 0.01))
        find_format(form).write(brdf, folder / file)
        plain = (folder / file).read_bytes()
        ways: Ways = [lambda rng: by.of_bytes(plain, rng), lambda rng: by.of_lines(plain, rng)]
        if file.endswith(".gltf"):
            ways += document_ways(json.loads(plain), by.as_json, plain)
        return ways

    return make


def photos(folder: Path) -> Ways:
    """One photo of a set; the others are whole."""
    TinySet(folder)
    plain = (folder / "sample/s3.png").read_bytes()
    return [lambda rng: by.of_bytes(plain, rng)]


def process_set(path: Path) -> None:
    folder = next(one for one in path.parents if (one / MANIFEST).is_file())
    process(folder, None, Options(order=1, lobes=0, workers=1))


def use_coefficients(path: Path) -> None:
    for form in ("csv", "merl", "mitsuba", "scatmech"):
        out = path.with_suffix(".out")
        status = main(["export", str(path), "--format", form, "-o", str(out)])
        out.unlink(missing_ok=True)
        assert status in (0, 2)
    out = path.with_suffix(".svg")
    assert main(["show", str(path), "-o", str(out)]) in (0, 2)
    out.unlink(missing_ok=True)


def fit_rows(path: Path) -> None:
    fit(path, None, Options(order=1, lobes=0, workers=1))


def plan_scene(path: Path) -> None:
    """All that is done of a scene before it is rendered."""
    scene = load_scene(path)
    camera, shots = camera_of(scene), plan(scene)
    manifest_of(scene, camera, shots)
    truth_of(scene, camera, brdf_of(scene), shots)


COMMANDS = (
    "fit",
    "compare",
    "show",
    "export",
    "target",
    "init",
    "synthesize",
    "calibrate",
    "process",
    "evaluate",
    "",
)
WORDS = (
    *"-o --out --quiet --json --order --lobes --level --symmetry --channels --physics --columns --where --quantity "
    "--angles --azimuth --workers --format --channel --mask --scale --paper --kind --square --dictionary --list --hard "
    "--against --cache auto none 0 1 2 -1 nan 1e400 R,G R,, a=b = theta_i=x csv merl mitsuba scatmech a4 charuco "
    "aruco-grid DICT_4X4_50 isotropic x ä no-such no-such.csv no-such.npz no-such.json no-such.toml . .. "
    "/dev/null".split(),
    *("", "\0", "9" * 400, "x" * 300),
)


def command(folder: Path) -> Ways:
    def words(rng: random.Random) -> bytes:
        chosen = [rng.choice(COMMANDS)] + [rng.choice(WORDS) for _ in range(rng.randint(0, 6))]
        return "\n".join(chosen).encode("utf-8", "surrogateescape")

    return [words]


def run_command(path: Path) -> None:
    """Only commands that end soon are let run: without an input that is there they all do."""
    words = str(path).split("\n")
    heavy = {"evaluate": (), "synthesize": (), "target": (), "init": ("", ".", "..")}
    if words[0] == "evaluate" or any(word in words[1:] for word in heavy.get(words[0], ())):
        words = [*words, "--no-such-option"]
    if words[0] == "target":  # writes where it is
        words = [*words, "-o", "/no-such-folder-at-all/target.pdf", "--square", "-1"]
    try:
        status = main(words)
    except SystemExit as stop:
        status = stop.code
    if status not in (0, 2):
        raise AssertionError(f"status {status} of {words}")


TARGETS = (
    Target("manifest", MANIFEST, manifest, read_manifest, share=4),
    Target("draft", MANIFEST, manifest, read_draft),
    Target("scene", "scene.toml", scene, load_scene, share=4),
    Target("setup", "setup.json", setup, read_setup, share=4),
    Target("coefficients", "coefficients.json", coefficients, read_coefficients, share=4),
    Target("expansion", "coefficients.json", coefficients, read_expansion, share=2),
    Target("table", "table.npz", table, read_facets, share=4),
    Target("grid", "grid.npz", grid, read_both, share=4),
    Target("truth", "truth.json", truth, read_both, share=4),
    Target("whole truth", "truth.json", truth, read_truth, share=2),
    Target("scores", "evaluate.json", scores, load_scores),
    Target("rows", "rows.csv", rows, read_rows, share=4),
    Target("rows to render", "rows.csv", rows, render_rows, share=2),
    *(
        Target(f"image{suffix}", f"photo{suffix}", image(suffix), read_photo, share=2)
        for suffix in (".png", ".tif", ".jpg", ".exr", ".webp")
    ),
    Target("openpbr", "brdf.mtlx", exported("openpbr", "brdf.mtlx"), read_both),
    Target("gltf", "brdf.gltf", exported("gltf", "brdf.gltf"), read_both),
    Target("scatmech", "brdf.csv", exported("scatmech", "brdf.csv"), read_both),
    Target("command", "", command, run_command, share=2),
    # seconds each: only when asked for
    Target("fit", "table.npz", table, fit_facets, share=0),
    Target("fit rows", "rows.csv", rows, fit_rows, share=0),
    Target("set", MANIFEST, manifest, process_set, share=0),
    Target("photos", "sample/s3.png", photos, process_set, share=0),
    Target("use", "coefficients.json", coefficients, use_coefficients, share=0),
    Target("plan", "scene.toml", scene, plan_scene, share=0),
)
