"""How Sphinx builds these documents: `make docs`, into docs/_build/html."""

from __future__ import annotations

import importlib
import inspect
import re
import warnings
from pathlib import Path

import focalgradient

project = "focalgradient"
author = "the focalgradient maintainers"
version = release = focalgradient.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx_click",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
    "sphinxcontrib.bibtex",
]
myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
bibtex_bibfiles = ["references.bib"]
autosummary_generate = True
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_ivar = True
default_role = "code"  # in docstrings `name` is code
exclude_patterns = ["_build", "blur_page", "examples"]
suppress_warnings = ["config.cache", "misc.highlighting_failure"]  # a lexer for CSV there is none
nitpicky = False
templates_path = ["_templates"]

html_static_path = ["_static"]
html_css_files = ["own.css"]
html_theme = "pydata_sphinx_theme"
html_title = "focalgradient"
html_theme_options = {"show_toc_level": 2, "navigation_with_keys": False, "secondary_sidebar_items": ["page-toc"]}

sphinx_gallery_conf = {
    "examples_dirs": ["examples"],
    "gallery_dirs": ["gallery"],
    "filename_pattern": r"/plot_",
    "backreferences_dir": "generated/backreferences",
    "doc_module": ("focalgradient",),
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_signature": False,
    "remove_config_comments": True,
}

warnings.filterwarnings("ignore", message=".*Matplotlib is currently using agg.*")
ROOT = Path(__file__).parent

ROOMS = re.findall(r"^   (focalgradient[\w.]*)$", (ROOT / "api.rst").read_text(encoding="utf-8"), re.MULTILINE)


def names(room: str) -> list[str]:
    """What a room's page lists: its functions and classes."""
    own = ((name, getattr(importlib.import_module(room), name)) for name in importlib.import_module(room).__all__)
    return [name for name, value in own if inspect.isroutine(value) or inspect.isclass(value)]


autosummary_context = {"names": {room: names(room) for room in ROOMS}}
