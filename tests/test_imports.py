"""The rooms' imports go one way, and only the named modules read images (docs/architecture.md)."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from tests.places import ROOT

ROOMS = {
    "capture": set(),
    "calib": {"capture"},
    "reconstruct": {"calib", "capture"},
    "synthetic": {"calib", "capture"},
    "photogonio": {"synthetic", "reconstruct", "calib", "capture"},
}
# calib's parts that solve for something; synthetic may use the formats and the geometry alone
GEOMETRY = {"photogonio.calib.geometry.camera", "photogonio.calib.setup", "photogonio.calib.geometry.board"}
DECODERS = {"imread", "imreadmulti", "imdecode", "imreadanimation", "ImageInput", "ImageBuf"}
IMAGE_READERS = {"capture/files/images.py", "capture/files/raw.py"}
HEAVY = ("numpy", "cv2", "scipy", "numba", "matplotlib", "rawpy", "OpenImageIO", "colour", "jinja2", "tqdm")
FILES = [path for room in ROOMS for path in sorted((ROOT / room).rglob("*.py"))]


def imported(tree: ast.AST) -> set[str]:
    """Dotted names of all imports, wherever they stand."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative import"
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names


def room_of(name: str) -> str | None:
    """The room of a dotted name; None for what is not ours."""
    first, _, rest = name.partition(".")
    second = rest.split(".")[0]
    return None if first != "photogonio" else second if second in ROOMS else first


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_go_one_way(path: Path):
    room = path.relative_to(ROOT).parts[0]
    assert {room_of(name) for name in imported(ast.parse(path.read_text()))} - {None} <= ROOMS[room] | {room}


def test_the_check_sees_imports_inside_functions():
    tree = ast.parse("def f():\n    from photogonio.synthetic.brdf.library import MODELS\n")
    assert "photogonio.synthetic.brdf.library" in imported(tree)


def test_synthetic_uses_no_solver():
    for path in sorted((ROOT / "synthetic").rglob("*.py")):
        used = {
            name for name in imported(ast.parse(path.read_text())) if name.startswith("photogonio.calib.")
        }
        allowed = {name for name in used for room in GEOMETRY if f"{name}.".startswith(f"{room}.")}
        assert used == allowed, path


def test_images_are_decoded_in_one_place():
    seen = set()
    for path in FILES:
        attributes = {n.attr for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Attribute)}
        if attributes & DECODERS:
            seen.add(str(path.relative_to(ROOT)))
    assert seen <= IMAGE_READERS
    assert "capture/files/images.py" in seen


@pytest.mark.parametrize("arguments", [["--help"], ["process", "--help"], ["fit", "no.csv", "--order", "x"]])
def test_help_and_argument_errors_import_nothing_heavy(arguments):
    code = (
        "import sys\n"
        "from photogonio.cli import main\n"
        "try:\n    main(sys.argv[1:])\n"
        "except SystemExit:\n    pass\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules], file=sys.stderr)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stderr.splitlines()[-1] == "[]"


def test_the_packages_are_listed_for_the_build():
    import tomllib

    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    found = {
        ".".join([*(["photogonio"] if path.parts[0] != "photogonio" else []), *path.parent.parts])
        for path in (path.relative_to(ROOT) for path in FILES)
        if path.name == "__init__.py"
    }
    assert set(listed) == found
