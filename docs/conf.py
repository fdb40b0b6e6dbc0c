"""How Sphinx builds these documents: `make docs`, into docs/_build/html."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
import warnings
from pathlib import Path

import focalgradient
from focalgradient.dataset.columns import COLUMNS, TITLES

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
exclude_patterns = ["_build", "blur_page", "examples", "generated/*.md"]  # the last are included
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


def tables_of_columns() -> str:
    """What the columns of the data sets' tables mean, as their sidecars say it."""
    rows = []
    for task, columns in COLUMNS.items():
        rows += [f"### {TITLES[task]} (`{task}`)", "", "| column | what it is | unit or values |", "|---|---|---|"]
        for column in columns:
            said = column.described()
            values = said.get("Units") or ", ".join(said.get("Levels", {})) or said.get("Format", "text")
            rows.append(f"| `{column.name}` | {said['Description']} | {values} |")
        rows.append("")
    return "\n".join(rows)


def list_of_figures() -> str:
    """The programs of `analysis/` that make a figure, with their first line."""
    rows = ["| program | what it shows |", "|---|---|"]
    for path in sorted(ROOT.parent.glob("analysis/*.py")):
        module = ast.parse(path.read_text(encoding="utf-8"))
        if any(isinstance(part, ast.FunctionDef) and part.name == "make" for part in module.body):
            first = (ast.get_docstring(module) or "").split("\n\n")[0].replace("\n", " ")
            rows.append(f"| `analysis/{path.name}` | {first} |")
    return "\n".join(rows) + "\n"


(ROOT / "generated").mkdir(exist_ok=True)
for file, text in (("columns.md", tables_of_columns()), ("figures.md", list_of_figures())):
    (ROOT / "generated" / file).write_text(text, encoding="utf-8")

REPORT = ROOT.parent / "results" / "report.html"
"""What `make reproduce` wrote, if it was run."""

if REPORT.is_file():
    tags.add("reproduced")  # noqa: F821  Sphinx gives `tags`
    html_extra_path = [str(REPORT)]

autosummary_context = {"names": {room: names(room) for room in ROOMS}}
