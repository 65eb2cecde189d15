"""What is packaged elsewhere asks for what pyproject.toml asks for."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# names of conda-forge's packages, where they differ
CALLED = {
    "opencv-contrib-python-headless": "py-opencv",
    "openimageio": "py-openimageio",
    "matplotlib": "matplotlib-base",
}


def tool() -> dict:
    with (ROOT / "pyproject.toml").open("rb") as file:
        return tomllib.load(file)


def project() -> dict:
    return tool()["project"]


def cited() -> str:
    """The version of CITATION.cff: the last, or before the first the next."""
    return re.search(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)[1]  # type: ignore[index]


def floors(lines: list[str]) -> dict[str, str]:
    """Oldest version by name."""
    split = (re.fullmatch(r"([\w.-]+) ?>=([\w.]+)", line) for line in lines)
    return {match[1].lower(): match[2] for match in split if match}


def listed(text: str, key: str) -> list[str]:
    """The items of a list of the recipe."""
    match = re.search(rf"^( *){key}:\n((?:\1  ?- .*\n|\1  - .*\n)+)", text, re.MULTILINE)
    assert match, key
    return [line.strip().removeprefix("- ") for line in match[2].splitlines()]


def test_the_conda_recipe_asks_for_what_the_project_asks_for():
    told, recipe = project(), (ROOT / "packaging/conda/recipe.yaml").read_text()
    assert re.search(r'^  version: "(.+)"$', recipe, re.MULTILINE)[1] == cited()  # type: ignore[index]
    wanted = floors(told["dependencies"])
    assert len(wanted) == len(told["dependencies"])
    run = listed(recipe, "run")
    assert run[0] == "python >=${{ python_min }}"
    assert floors(run[1:]) == {CALLED.get(name, name): version for name, version in wanted.items()}
    assert len(run) == len(wanted) + 1
    built_by = tool()["build-system"]["requires"]
    assert floors(built_by).items() <= floors(listed(recipe, "host")).items() and len(built_by) == 2
    for name, where in told["scripts"].items():
        assert f"{name} = {where}" in listed(recipe, "entry_points")
    assert told["description"] in recipe and f"license: {told['license']}" in recipe


def test_every_floor_can_be_asked_for_alone():
    """``.ci/dependencies floors`` turns each into one line of releases."""
    told = project()
    for one in told["dependencies"] + told["optional-dependencies"]["test"]:
        assert re.fullmatch(r"[\w.-]+>=[\d.]+", one), one


def test_the_version_comes_of_tags():
    """Nothing else states one that could be forgotten; before the first tag, and in an archive, the next is begun."""
    told = tool()
    assert project()["dynamic"] == ["version"] and "version" not in project()
    assert told["tool"]["setuptools_scm"]["fallback_version"] == f"{cited()}.dev0"
