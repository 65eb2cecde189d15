"""The program installed as a wheel: all that it needs is in it, and no file of a user's stands in its way."""

import os
import shutil
import subprocess
import sys
import tomllib
import zipfile

import pytest

from tests.places import ROOT

NAMES = ("capture", "calib", "reconstruct", "synthetic")


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A folder that holds what the wheel holds; libraries come from the environment that runs the tests."""
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    for name in ("photogonio", *NAMES):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source / name)
    flags = ["-q", "--no-deps", "--no-build-isolation"]
    subprocess.run(
        [sys.executable, "-m", "pip", "wheel", *flags, "-w", folder, source], check=True, capture_output=True
    )
    with zipfile.ZipFile(next(folder.glob("*.whl"))) as wheel:
        wheel.extractall(folder / "site")
    return folder / "site"


def run(site, cwd, code):
    return subprocess.run(
        [
            sys.executable,
            "-c",
            f"import sys; sys.path.insert(0, {str(site)!r})\nsys.path.insert(0, '')\n{code}",
        ],
        cwd=cwd,
        env={key: value for key, value in os.environ.items() if key != "PYTHONPATH"},
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()


def test_a_user_s_own_files_of_the_same_names_do_no_harm(installed, tmp_path):
    for name in NAMES:
        (tmp_path / f"{name}.py").write_text("raise RuntimeError('the user\\'s own')\n")
    code = "import photogonio\n" + "".join(
        f"from photogonio import {n}; print({n}.__file__)\n" for n in NAMES
    )
    assert run(installed, tmp_path, code) == [
        str(installed / "photogonio" / n / "__init__.py") for n in NAMES
    ]


def test_the_wheel_holds_scenes_and_templates_and_nothing_at_the_top(installed, tmp_path):
    assert {path.name for path in installed.iterdir() if not path.name.endswith(".dist-info")} == {
        "photogonio"
    }
    assert run(
        installed,
        tmp_path,
        "from photogonio.synthetic.scene.scene import load_scene; print(load_scene('example').name)",
    ) == ["example"]
    assert (installed / "photogonio" / "report" / "templates" / "report.html").is_file()
    typed = {path.parent for path in installed.rglob("py.typed")}
    assert typed == {installed / "photogonio", *(installed / "photogonio" / name for name in NAMES)}


def test_every_room_is_mapped_to_its_folder():
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-dir"]
    assert listed == {"photogonio": "photogonio", **{f"photogonio.{name}": name for name in NAMES}}
