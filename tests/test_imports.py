"""The rooms' imports go one way, and only the named modules read images (docs/architecture.md)."""

from __future__ import annotations

import ast
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from tests.places import ROOT

PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")


def listed(name: str) -> dict[str, str]:
    """A list of the page, by what its lines begin with."""
    lines = PAGE.split(f"```{name}\n")[1].split("```")[0].splitlines()
    return {key.strip(): value.strip() for key, value in (line.split(":") for line in lines)}


# a room takes from itself and from the rooms named here
ROOMS = {room: set(others.split()) for room, others in listed("rooms").items()}
# the floors inside a room, the upper ones first: each takes from itself and from what stands below
FLOORS = {room: floors.split(" / ") for room, floors in listed("floors").items()}
# calib's parts that solve for something; synthetic may use the formats and the geometry alone
GEOMETRY = {"photogonio.calib.geometry.camera", "photogonio.calib.setup", "photogonio.calib.geometry.board"}
DECODERS = {"imread", "imreadmulti", "imdecode", "imreadanimation", "ImageInput", "ImageBuf"}
IMAGE_READERS = {f"capture/files/{name}.py" for name in ("about", "decode", "exr", "heif", "images", "raw")}
HEAVY = ("numpy", "cv2", "scipy", "numba", "matplotlib", "rawpy", "OpenImageIO", "colour", "jinja2", "tqdm")
FILES = [path for room in ROOMS for path in sorted((ROOT / room).rglob("*.py"))]


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


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


def test_imports_go_one_way():
    """All files in one test: one each were a sixth of all tests."""
    wrong = {}
    for path in FILES:
        room = path.relative_to(ROOT).parts[0]
        taken = {room_of(name) for name in imported(tree_of(path))} - {None}
        if not taken <= ROOMS[room] | {room}:
            wrong[str(path.relative_to(ROOT))] = taken
    assert not wrong


def module_of(path: Path) -> str:
    """The dotted name that a file of ours is imported by."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join([*([] if parts[0] == "photogonio" else ["photogonio"]), *parts]).removesuffix(".__init__")


@cache
def ours(path: Path) -> set[str]:
    """The modules of this program that a file imports, those for type checks included."""
    names = set()
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            whole = {f"{node.module}.{alias.name}" for alias in node.names}
            names |= whole & MODULES.keys() or {node.module}
    return {name for name in names if name in MODULES} - {module_of(path)}


MODULES = {module_of(path): path for path in FILES}


def floor_of(name: str) -> tuple[str, int] | None:
    """The room of a module, and its floor there; None for the rooms' own names."""
    room, inside = room_of(name), MODULES[name].relative_to(ROOT).parts[1]
    inside = inside.removesuffix(".py")
    floors = [floor.split() for floor in FLOORS[room]]
    return (
        None if inside == "__init__" else (room, next(k for k, floor in enumerate(floors) if inside in floor))
    )


def upward(path: Path) -> list[str]:
    """The modules of its own room that a file takes from where it should not."""
    own, wrong = floor_of(module_of(path)), []
    for name in ours(path) if own is not None else ():
        other = floor_of(name)
        if other is None or other[0] != own[0]:
            continue
        beside = MODULES[name].relative_to(ROOT).parts[1] == path.relative_to(ROOT).parts[1]
        if not (other[1] > own[1] or (other[1] == own[1] and beside)):
            wrong.append(name)
    return wrong


def test_imports_inside_a_room_go_down():
    wrong = {str(path.relative_to(ROOT)): upward(path) for path in FILES}
    assert {path: names for path, names in wrong.items() if names} == {}


def test_no_imports_go_in_circles():
    left = {name: ours(path) for name, path in MODULES.items()}
    while True:
        free = {name for name, needs in left.items() if not needs & left.keys()}
        if not free:
            break
        left = {name: needs for name, needs in left.items() if name not in free}
    assert not left


def test_no_public_class_name_stands_for_two_things():
    seen: dict[str, list[str]] = {}
    for name, path in MODULES.items():
        for node in tree_of(path).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                seen.setdefault(node.name, []).append(name)
    assert {name: where for name, where in seen.items() if len(where) > 1} == {}


def test_private_names_stay_in_their_module():
    for path in FILES:
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.ImportFrom) and node.module.split(".")[0] == "photogonio":
                assert not [
                    alias.name
                    for alias in node.names
                    if alias.name.startswith("_") and alias.name != "__version__"
                ], path


def test_folders_stay_small():
    folders = {path.parent for path in FILES}
    assert max(len(list(folder.glob("*.py"))) for folder in folders) <= 18


def test_the_check_sees_imports_inside_functions():
    tree = ast.parse("def f():\n    from photogonio.synthetic.brdf.library import MODELS\n")
    assert "photogonio.synthetic.brdf.library" in imported(tree)


def test_synthetic_uses_no_solver():
    for path in sorted((ROOT / "synthetic").rglob("*.py")):
        used = {name for name in imported(tree_of(path)) if name.startswith("photogonio.calib.")}
        allowed = {name for name in used for room in GEOMETRY if f"{name}.".startswith(f"{room}.")}
        assert used == allowed, path


def test_images_are_decoded_in_one_place():
    seen = set()
    for path in FILES:
        attributes = {n.attr for n in ast.walk(tree_of(path)) if isinstance(n, ast.Attribute)}
        if attributes & DECODERS:
            seen.add(str(path.relative_to(ROOT)))
    assert seen <= IMAGE_READERS
    assert "capture/files/decode.py" in seen


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
