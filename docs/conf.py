"""The site of these pages: ``sphinx-build -W -b html docs docs/_build/html`` (CONTRIBUTING.md)."""

import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parent
sys.path[:0] = [str(DOCS.parent), str(DOCS)]  # the checkout is shown, not what is installed

from pygments.lexers.special import TextLexer  # noqa: E402
from sphinx.application import Sphinx  # noqa: E402

import photogonio  # noqa: E402

project = "photogonio"
author = "the authors of photogonio"
version = release = photogonio.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx_gallery.gen_gallery"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_build", "gallery"]  # the gallery's pages are made of it, in docs/examples

html_theme = "furo"
html_title = "photogonio"

myst_heading_anchors = 3  # links to headings, as a code host makes them

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"

sphinx_gallery_conf = {
    "examples_dirs": "gallery",
    "gallery_dirs": "examples",
    "filename_pattern": r"\.py$",  # all are run
    "image_scrapers": ("gallery_site.written_pictures",),
    "reset_argv": "gallery_site.empty_folder",
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "show_memory": False,
    "abort_on_example_error": True,
}


def setup(app: Sphinx) -> None:
    for word in ("rooms", "floors"):  # lists of architecture.md that a test reads
        app.add_lexer(word, TextLexer)
