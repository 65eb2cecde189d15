"""The pages of docs/: each can be found from the first one, and where a link leads there is something."""

from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import unquote

import pytest

from tests.places import ROOT

DOCS = ROOT / "docs"
PAGES = sorted(DOCS.glob("*.md"))
LINKING = [*PAGES, *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md"))]
CODE = re.compile(r"^```.*?^```|`[^`\n]*`", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)\s]+)\)")
TREE = re.compile(r"^```\{toctree\}\n(.*?)^```", re.MULTILINE | re.DOTALL)


def listed() -> list[str]:
    """The pages that the tables of contents name, in their order."""
    blocks = TREE.findall((DOCS / "index.md").read_text(encoding="utf-8"))
    lines = [line.strip() for block in blocks for line in block.splitlines()]
    return [line for line in lines if line and not line.startswith(":")]


def heading_anchors(page: Path) -> set[str]:
    """Of a page's headings, as a code host makes them."""
    headings = re.findall(r"^#+ (.*)$", CODE.sub("", page.read_text(encoding="utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def leads_nowhere(page: Path, link: str) -> bool:
    if re.match(r"[a-z]+:", link):
        return False
    name, _, anchor = unquote(link).partition("#")
    target = (page.parent / name).resolve() if name else page
    if not (target.exists() and target.is_relative_to(ROOT)):
        return True
    return bool(anchor) and anchor not in heading_anchors(target)


def test_each_page_is_in_the_table_of_contents_once():
    pages = [page.stem for page in PAGES if page.stem != "index"]
    assert sorted(name for name in listed() if "/" not in name) == pages


@pytest.mark.parametrize("page", LINKING, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    links = LINK.findall(CODE.sub("", page.read_text(encoding="utf-8")))
    assert [link for link in links if leads_nowhere(page, link)] == []


def test_a_link_to_nothing_is_noticed():
    page = DOCS / "index.md"
    assert leads_nowhere(page, "no-such-page.md") and leads_nowhere(page, "guide.md#no-such-heading")
    assert leads_nowhere(page, "../../README.md")
    assert not leads_nowhere(page, "metrics.md#error-measures")
