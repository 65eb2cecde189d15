"""docs/architecture.md: its table of folders is made of their docstrings (``python -m tests.test_architecture``)."""

import ast

from tests.places import ROOT

PAGE = ROOT / "docs" / "architecture.md"
BEGIN, END = "<!-- subpackages -->\n", "<!-- end -->\n"
ROOMS = ("capture", "calib", "reconstruct", "synthetic", "photogonio")


def table() -> str:
    """One row a folder of a room: its question, and what goes in and comes out."""
    rows = ["| folder | question | takes and gives |", "|---|---|---|"]
    for room in ROOMS:
        rows.append(f"| **`{room}`** | **{' '.join(docstring(room).split(chr(10) * 2)[0].split())}** | |")
        for path in sorted((ROOT / room).glob("*/__init__.py")):
            name = path.parent.relative_to(ROOT).as_posix()
            question, rest = docstring(name).split("\n\n", 1)
            rows.append(f"| `{name}` | {' '.join(question.split())} | {' '.join(rest.split())} |")
    return "\n".join(rows) + "\n"


def docstring(folder: str) -> str:
    return ast.get_docstring(ast.parse((ROOT / folder / "__init__.py").read_text(encoding="utf-8"))) or ""


def with_table(page: str) -> str:
    head, rest = page.split(BEGIN)
    return head + BEGIN + table() + END + rest.split(END)[1]


def test_the_table_of_folders_is_what_the_folders_say():
    page = PAGE.read_text(encoding="utf-8")
    assert page == with_table(page), "run: python -m tests.test_architecture"


def test_every_folder_says_what_it_takes_and_gives():
    for room in ROOMS:
        for path in sorted((ROOT / room).rglob("*/__init__.py")):
            assert "gives " in docstring(path.parent.relative_to(ROOT).as_posix()).lower(), path


def test_files_that_the_page_names_are_there():
    page = PAGE.read_text(encoding="utf-8")
    named = {word for word in page.split("`")[1::2] if "/" in word and " " not in word and "*" not in word}
    named = {word for word in named if word.split("/")[0] in (*ROOMS, "tests", "docs")}
    assert named and all((ROOT / name).exists() for name in named), sorted(
        name for name in named if not (ROOT / name).exists()
    )


if __name__ == "__main__":
    PAGE.write_text(with_table(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
